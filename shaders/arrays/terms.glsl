// What fragments add to sums of moments, one after the other.
//
//   NUMBERS   means that a state of moments has
//   LAYERS    0, or how many of the nearest fragments are taken out again (arrays/front.glsl)
//   GATHERS   if it is given, in which passes sums are made
//   TERM_DEPTH(depth)   if it is given, of what depth moments are; else of that which is warped
//   OWN_TERMS   if it is defined, moment_term term_of(uint p, uint i) follows
#ifndef TERM_DEPTH
#define TERM_DEPTH(depth) warped(depth)
#endif

struct moment_term {
    double absorbed;
    double z;
};

#ifndef GATHERS
#define GATHERS (PASS == CAPTURE || (LAYERS && PASS == FACTOR))
#endif

#if GATHERS
double total_gathered;
double mean_gathered[NUMBERS];

#ifdef OWN_TERMS
moment_term term_of(uint p, uint i);
#elif LAYERS && PASS == FACTOR // of the nearest
moment_term term_of(uint p, uint i) {
    uint at = 2u * (LAYERS * p + i);
    return moment_term(doubles[at], doubles[at + 1u]);
}
#else
moment_term term_of(uint p, uint i) {
    surface f = surface_at(offsets[p] + i);
    return moment_term(double(absorbance_of(f.alpha)), double(TERM_DEPTH(f.depth)));
}
#endif
#endif
