// What reaches fragments that `indices` has from front to back: into `state`, one number a
// fragment, and the pixel's total.
void go_through(uint p) {
    precise double through = 1.0;
    uint end = offsets[p + 1u];
    for (uint at = offsets[p]; at < end; ++at) {
        uint i = indices[at];
        state[i] = SCALAR(through);
        through = through * (1.0 - double(alphas[i]));
    }
    set_total(p, through);
}
