// A fragment for each thread of a yardstick, and its answer.

layout(local_size_x = 64) in;

struct fragment {
    float z;     // its depth in [-1, 1]
    float alpha; // its opacity
};

layout(std430, binding = 0) readonly buffer a_fragments { fragment fragments[]; };
layout(std430, binding = 2) buffer an_answer { float answer[]; };

fragment this_fragment() { return fragments[gl_GlobalInvocationID.x]; }

void give(float value) { answer[gl_GlobalInvocationID.x] = value; }
