// To `sums`, whole numbers in a buffer: one that grows beyond what a slice holds may not wrap.
void add(uint at, uint steps) {
    if (steps > 0u && atomicAdd(sums[at], steps) >= 0x80000000u) atomicMin(sums[at], 0x80000000u);
}
