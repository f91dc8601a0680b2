// Means over blocks of pixels in place of each pixel's own sums: pixels read the four blocks around
// them, bilinearly. The program has what adds and scales sums.
//
// MEANS_OF_BLOCKS  defined
// LEAST_SHADED     what blocks let through at least, as they may hide all of a pixel's fragments
//                  behind its neighbours', and what is left is scaled to what these cover; defined
//                  without OWN_TOTAL
// OWN_TOTAL        1: what is read is scaled to the pixel's own absorbance; 0: it is not, and what
//                  a pixel covers is the product of 1 - alpha
#include "engine/low_resolution.glsl"

#if OWN_TOTAL
vec4 resolve(vec4 shaded_sum, float total) { return covered(shaded_sum, total); }
#else
#include "engine/multiplied_up.glsl"
#endif
