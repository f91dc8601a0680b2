// Splats by the most of their density along each ray.
#define ALONG_RAYS 1
#define ALL 1
#include "meshes/splat_surface.glsl"
