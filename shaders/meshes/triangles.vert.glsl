#version 450
// Triangles without images.
#include "meshes/corners.glsl"
