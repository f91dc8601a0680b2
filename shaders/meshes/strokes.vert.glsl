#version 450
// Parts of strokes.
#include "meshes/strokes.glsl"
#include "meshes/boxes.glsl"
