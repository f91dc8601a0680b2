#version 450
// Between our pictures and the textures of others, whose first row is the lowest.
//
//   TAKES   1: opaque surfaces that they have drawn; 0: they are given the picture
#include "arrays/bindings.glsl"

uniform int height;

#if TAKES
layout(binding = THEIR_COLOR) uniform sampler2D their_color;
layout(binding = THEIR_DEPTH) uniform sampler2D their_depth;
uniform double near, far;  // of the projection that they were drawn with
uniform float occluder_scale;  // as in occluders.frag.glsl
layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.x, height - 1 - int(gl_FragCoord.y));
    float depth = texelFetch(their_depth, pixel, 0).r;
    bool there = depth < 1.0; // else nothing was drawn, and the colour is the background
    color = vec4(texelFetch(their_color, pixel, 0).rgb, there ? 1.0 : 0.0);
    gl_FragDepth = there ? float(near * far / (far - double(depth) * (far - near))) * occluder_scale : 1.0;
}
#else
layout(std430, binding = ANSWERS) readonly restrict buffer Answers { float answers[]; };
uniform int width;
layout(location = 0) out vec4 color;

void main() {
    int p = (height - 1 - int(gl_FragCoord.y)) * width + int(gl_FragCoord.x);
    color = vec4(answers[4 * p], answers[4 * p + 1], answers[4 * p + 2], answers[4 * p + 3]);
}
#endif
