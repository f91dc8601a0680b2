#version 450
// Splats.
#include "meshes/splats.glsl"
#include "meshes/boxes.glsl"
