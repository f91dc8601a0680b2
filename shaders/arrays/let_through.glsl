// What all fragments of a pixel let through, multiplied up in their order.
double let_through(uint p) {
    precise double through = 1.0;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) through *= 1.0 - double(alphas[i]);
    return through;
}
