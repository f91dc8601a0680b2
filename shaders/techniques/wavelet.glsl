#version 450
// Wavelet transparency: Aizenshtein, Smal and McGuire, 2022. A pixel keeps Haar coefficients; what
// fragments read is the absorbance at the end of each cell.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   LEVELS                 2 to 5, of wavelets
//   DENSITY                0 or 1: of the absorbance in front of a depth, or of its density
//   BITS                   32: summed in double, stored as a number; 16: each sum rounded to half
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/haar_wavelet.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define CELLS int(STATE_SIZE)

#if BITS == 16
#define SUM number
#define BLENDED(sum) min(rounded_to_half(sum), K(65504.0))
#else
#define SUM double
#define BLENDED(sum) (sum)
#endif

#if PASS == CAPTURE || PASS == EXPAND
void expand(uint p) {
    haar_coefficients stored;
    for (int k = 0; k < CELLS; ++k) stored.c[k] = number(state[uint(CELLS) * p + uint(k)]);
    haar_cells cells = haar_cells_of(LEVELS, DENSITY, stored);
    for (int k = 0; k < CELLS; ++k) factors[uint(CELLS) * p + uint(k)] = cells.end[k];
}
#endif

#if PASS == EXPAND
void own_pass(uint p) { expand(p); }
#elif PASS == CAPTURE
void capture(uint p) {
    precise SUM sum[CELLS];
    for (int k = 0; k < CELLS; ++k) sum[k] = SUM(0);
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; ++i) {
        surface s = surface_at(i);
        haar_event e = haar_event_of(LEVELS, DENSITY, warped(s.depth), absorbance_of(s.alpha));
        int cell = int(e.cell);
        sum[0] = BLENDED(sum[0] + SUM(e.scaling));
        for (int level = 0; level < LEVELS; ++level)
            for (int k = 0; k < 1 << level; ++k) { // no index that differs by thread
                int at = (1 << level) + k;
                precise SUM blended = BLENDED(sum[at] + SUM(e.wavelet[level]));
                sum[at] = k == cell >> (LEVELS - level) ? blended : sum[at];
            }
    }
    for (int k = 0; k < CELLS; ++k) state[uint(CELLS) * p + uint(k)] = SCALAR(sum[k]);
    if (OF_BLOCKS == 0) expand(p);
}
#endif

#if PASS == FACTOR
void factor(uint p) { set_total(p, exponential(-double(factors[uint(CELLS) * (p + 1u) - 1u]))); }
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) {
    haar_place place = haar_place_of(LEVELS, DENSITY, warped(s.depth));
    uint first = uint(CELLS) * p;
    uint cell = uint(place.cell);
    number start = cell > 0u ? number(factors[first + cell - 1u]) : K(0.0);
    number own = own_absorbance(s.alpha);
    number end = number(factors[first + cell]);
#if ABSORBS == 1
    return haar_absorbance(DENSITY, start, end, place.inside, own);
#else
    return haar_transmittance(DENSITY, start, end, place.inside, own);
#endif
}
#if BITS == 16
#define BLOCK_NUMBER(x) rounded_to_half(x)
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
