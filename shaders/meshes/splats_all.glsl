// Projected splats, all of them.
#define ALL 1
#include "meshes/splat_surface.glsl"
