// Another seed draws other samples; a frame's number, where noise is to differ from frame to frame.
#ifndef SEED
#define SEED 0
#endif

// The mask of samples that a fragment covers. Depth is at full precision: what has the same depth
// and opacity in a pixel covers the same samples.
uint covered_samples(uint row, uint column, float depth, float alpha) {
    uint key = fragment_key(uint(SEED), row, column, depth, alpha);
    return coverage_of(key, 0u, alpha, SAMPLES, STRATIFIED).low;
}
