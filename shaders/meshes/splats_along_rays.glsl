// Splats by the most of their density along each ray.
#define ALONG_RAYS
#include "meshes/splat_surface.glsl"
