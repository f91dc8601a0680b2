// What a triangle with an image is in a pixel.
#define TEXTURED 1
#include "meshes/surface.glsl"
