// The network of bounded neural transmittance: two layers of 8, rectified, and a sigmoid. An output
// of the first layer has weights of four inputs of a fragment, those of its pixel's, and a bias.
//
// EACH  how many numbers that are, of NETWORK

// Weights k to k + 3 times four inputs, and the rest.
float weighed(int k, vec4 x, float rest) {
    return NETWORK[k] * x.x + (NETWORK[k + 1] * x.y + (NETWORK[k + 2] * x.z
           + (NETWORK[k + 3] * x.w + rest)));
}

// Outputs j to j + 3 of the first layer, of which the pixel's inputs made `known`, rectified;
// output j of the second.
vec4 first_layer(int j, vec4 known, vec4 seen) {
    int k = EACH * j;
    return max(vec4(weighed(k, seen, known.x), weighed(k + EACH, seen, known.y),
                    weighed(k + 2 * EACH, seen, known.z), weighed(k + 3 * EACH, seen, known.w)),
               vec4(0.0));
}

float second_layer(int j, vec4 a, vec4 b) {
    int k = 8 * EACH + 9 * j;
    return max(weighed(k + 4, b, weighed(k, a, NETWORK[k + 8])), 0.0);
}

// What the network says of a fragment; low, high: the first layer's sums of its pixel.
float answer_of(vec4 low, vec4 high, vec4 seen) {
    vec4 a = first_layer(0, low, seen), b = first_layer(4, high, seen);
    float last = NETWORK[8 * EACH + 80];
    for (int j = 0; j < 8; ++j) last += NETWORK[8 * EACH + 72 + j] * second_layer(j, a, b);
    return 1.0 / (1.0 + exp2(clamp(-1.44269504 * last, -115.0, 115.0)));
}

// What reaches a fragment that has `mass` of a distribution of 1 at it and in front of it, of b0 in
// all; beside: its distance from the mean in deviations; low, high: the first layer's sums.
float bounded_through(vec2 mass, float b0, float beside, float alpha, vec4 low, vec4 high) {
    float absorbs = absorbance(alpha), own = min(absorbs / max(b0, 1e-12), 1.0);
    float least = clamp(mass.y, 0.0, 1.0 - own);
    float room = max(min(mass.x, 1.0 - least) - own, 0.0);
    vec4 seen = vec4(least, room, absorbs, clamp(beside, -8.0, 8.0));
    return exp2(-1.44269504 * b0 * (answer_of(low, high, seen) * room + least));
}
