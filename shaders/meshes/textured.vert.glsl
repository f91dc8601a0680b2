#version 450
// Triangles with images.
#define TEXTURED 1
#include "meshes/corners.glsl"
