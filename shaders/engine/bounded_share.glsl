// The network of bounded neural transmittance: two layers of 8, rectified, and a sigmoid. An output
// of the first layer has weights of four inputs of a fragment, those of its pixel's, and a bias.
//
// EACH  how many numbers that are, of NETWORK

// Output j of the first layer, of which the pixel's inputs made `sum`, rectified; of the second.
float first_layer(int j, float sum, vec4 seen) {
    int k = EACH * j;
    return max(NETWORK[k] * seen.x + (NETWORK[k + 1] * seen.y + (NETWORK[k + 2] * seen.z
               + (NETWORK[k + 3] * seen.w + sum))), 0.0);
}

float second_layer(int j, vec4 a, vec4 b) {
    int k = 8 * EACH + 9 * j;
    float low = NETWORK[k] * a.x + (NETWORK[k + 1] * a.y + (NETWORK[k + 2] * a.z
                + (NETWORK[k + 3] * a.w + NETWORK[k + 8])));
    return max(NETWORK[k + 4] * b.x + (NETWORK[k + 5] * b.y + (NETWORK[k + 6] * b.z
               + (NETWORK[k + 7] * b.w + low))), 0.0);
}

// What reaches a fragment that has `mass` of a distribution of 1 at it and in front of it, of b0 in
// all; beside: its distance from the mean in deviations; low, high: the first layer's sums.
float bounded_through(vec2 mass, float b0, float beside, float alpha, vec4 low, vec4 high) {
    float absorbs = absorbance(alpha), own = min(absorbs / max(b0, 1e-12), 1.0);
    float least = clamp(mass.y, 0.0, 1.0 - own);
    float room = max(min(mass.x, 1.0 - least) - own, 0.0);
    vec4 seen = vec4(least, room, absorbs, clamp(beside, -8.0, 8.0));
    vec4 a = vec4(first_layer(0, low.x, seen), first_layer(1, low.y, seen),
                  first_layer(2, low.z, seen), first_layer(3, low.w, seen));
    vec4 b = vec4(first_layer(4, high.x, seen), first_layer(5, high.y, seen),
                  first_layer(6, high.z, seen), first_layer(7, high.w, seen));
    float last = NETWORK[8 * EACH + 80];
    for (int j = 0; j < 8; ++j) last += NETWORK[8 * EACH + 72 + j] * second_layer(j, a, b);
    float beta = 1.0 / (1.0 + exp2(clamp(-1.44269504 * last, -115.0, 115.0)));
    return exp2(-1.44269504 * b0 * (beta * room + least));
}
