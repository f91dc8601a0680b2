// What four power moments of a pixel's fragments prove about the light in front of a place
// (csrc/core/techniques/power_bounds.c), but that each pixel allows for the roundings of its own
// fragments. In `doubles` of a pixel: the moments as stored, the rule of biased ones, b0, and what
// max_alpha has cut off.
//
//   NODES     2
//   NUMBERS   4
//   PROVES    0 or 1: whether the pass asks
//   SECOND_RULE   0 or 1: there are other moments of the same total, and their rule, behind these
#define LAYERS 0
#define HELD_RULE uint(NUMBERS)
#define HELD_TOTAL (HELD_RULE + 2u * NODES + 1u)
#define HELD_HIDDEN (HELD_TOTAL + 1u)
#define HELD_SLICES (HELD_HIDDEN + 1u)

uniform number moments_near; // as arrays/warp.glsl has them, to [-1, 1]
uniform number moments_low;
uniform number moments_high;
uniform number moments_scale;
uniform number moments_inverse;

number depth_of_moments(number depth) {
    if (warp == STEPS_NONE) return depth;
    if (warp == STEPS_LEVEL) return moments_low;
    if (warp == STEPS_LINEAR)
        return linear_warp(depth, moments_near, moments_low, moments_high, moments_scale);
    return log_warp(depth, moments_near, moments_inverse, moments_low, moments_high, moments_scale);
}

#define TERM_DEPTH(depth) depth_of_moments(depth)
#define GATHERS (PASS == HOLD_MOMENTS)
#include "arrays/terms.glsl"

#if GATHERS
#include "kernels/kept_sums.h"
#include "arrays/means.glsl"
#include "arrays/power_sums.glsl"

void own_pass(uint p) {
    gather(p, offsets[p + 1u] - offsets[p]);
    uint at = DOUBLES_SIZE * p;
    for (uint k = 0u; k < NUMBERS; ++k) doubles[at + k] = double(SCALAR(mean_gathered[k]));
    doubles[at + HELD_TOTAL] = double(SCALAR(total_gathered));
}
#endif

#if PASS == FACTOR
#include "kernels/power_moments.h"
#include "kernels/pairs.h"
#include "kernels/power_rules.h"

uniform double bias;
uniform double safe[NUMBERS]; // what bias moves moments toward
uniform double least;         // pivots below are rounding alone

void factor(uint p) {
    uint at = DOUBLES_SIZE * p;
    precise double hidden = 0.0;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        double alpha = double(alphas[i]);
        precise double more = 0.0;
        if (alpha > max_alpha)
            more = alpha < 1.0 ? absorbance(alpha) - absorbance(max_alpha) : 1e300;
        hidden += more;
    }
    doubles[at + HELD_HIDDEN] = hidden;
    moments far_from_degenerate;
    for (uint k = 0u; k < NUMBERS; ++k) far_from_degenerate.b[k] = safe[k];
    for (uint other = 0u; other <= uint(SECOND_RULE); ++other) {
        moments m;
        for (uint k = 0u; k < NUMBERS; ++k) m.b[k] = doubles[at + k];
        rule r = gauss_rule(HELD_AS_FLOATS, m, bias, far_from_degenerate, least);
        for (uint i = 0u; i < NODES; ++i) {
            doubles[at + HELD_RULE + i] = r.g[i];
            doubles[at + HELD_RULE + NODES + i] = r.e[i];
        }
        doubles[at + HELD_RULE + 2u * NODES] = r.d;
        at += HELD_SLICES;
    }
}
#endif

#if PROVES
#include "arrays/begin_double.glsl"
#if !NUMBERS_ARE_DOUBLE
#undef ELEMENTARY // which is there of floats
#define circle_point circle_point_of_doubles
#include "kernels/dialect_numbers.glsl" // in double
#include "kernels/elementary.h" // in double
#undef circle_point
#endif
#include "kernels/power_moments.h" // in double
#include "kernels/power_bounds.h" // in double
#include "arrays/end_double.glsl"

uniform double unit; // a rounding of the fragments' precision

struct light_between {
    double lower;
    double upper;
    double b0;
    certain pixel;  // shares of it that moments prove
    certain slices; // shares of theirs that the second ones prove, no rounding allowed for
};

certain held_at(uint at, number depth, double blur, double slack) {
    moments m;
    rule r;
    for (uint k = 0u; k < NUMBERS; ++k) m.b[k] = doubles[at + k];
    for (uint i = 0u; i < NODES; ++i) {
        r.g[i] = doubles[at + HELD_RULE + i];
        r.g_low[i] = 0.0lf;
        r.e[i] = doubles[at + HELD_RULE + NODES + i];
    }
    r.d = doubles[at + HELD_RULE + 2u * NODES];
    return certain_at(r, m, double(depth_of_moments(depth)), blur, slack);
}

// `own` is the absorbance of what is known to lie at z.
light_between proven_at(uint p, number depth, number own) {
    uint at = DOUBLES_SIZE * p;
    double b0 = doubles[at + HELD_TOTAL];
    double hidden = doubles[at + HELD_HIDDEN];
    precise double rounding = 4.0lf * unit;
    precise double each = rounding + 1.1102230246251565e-16lf * double(offsets[p + 1u] - offsets[p]);
    certain shares[1 + SECOND_RULE]; // by a loop, as compilers paste what they call
    for (uint k = 0u; k <= uint(SECOND_RULE); ++k) {
        double allowed = k == 0u ? 1.0lf : 0.0lf;
        shares[k] = held_at(at + HELD_SLICES * k, depth, allowed * rounding, allowed * each);
    }
    certain share = shares[0];
    precise double doubt = each * (b0 + double(own));
    precise double most = max(min(b0 * share.at_most - double(own), b0 - double(own)), 0.0lf);
    most += doubt + hidden * (1.0lf + each);
    precise double least_absorbed = max(b0 * share.at_least - doubt, 0.0lf);
    light_between light;
    light.b0 = b0;
    light.pixel = share;
    light.slices = shares[SECOND_RULE];
    light.lower = most > 0.0lf ? min(exponential(-most), 1.0lf - 1.1102230246251565e-16lf) : 1.0lf;
    light.upper = min(1.0lf, exponential(-least_absorbed));
    return light;
}

// An answer within it: T, or with ABSORBS minus its logarithm.
number within_proven(number x, light_between light) {
#if ABSORBS == 1
    precise double lower = -logarithm(light.upper);
    precise double upper = light.lower > 0.0lf ? -logarithm(light.lower) : 1e300lf;
    return number(min(max(double(x), lower), upper));
#else
    return number(min(max(double(x), light.lower), light.upper));
#endif
}
#endif
