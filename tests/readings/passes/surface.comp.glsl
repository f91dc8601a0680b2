#version 450
// Points of triangles as kernels/surface.h finds them, one a thread: z, an attribute, and light.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/surface.h"

struct asked {
    number second;  // weights on the screen
    number third;
    number inverse_z[3];
    number value[3];  // the attribute at the corners
    number normal[9]; // of the corners
    number right;     // seen along (right, up, 1)
    number up;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Asked { asked points[]; };
layout(std430, binding = 1) writeonly restrict buffer Found { number found[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    asked q = points[i];
    surface_point p = point_of_surface(q.second, q.third, q.inverse_z);
    number normal[3];
    for (int k = 0; k < 3; ++k)
        normal[k] = interpolated(p, q.normal[k], q.normal[3 + k], q.normal[6 + k]);
    found[3 * i] = p.z;
    found[3 * i + 1] = interpolated(p, q.value[0], q.value[1], q.value[2]);
    found[3 * i + 2] = lambert(normal, q.right, q.up);
}
