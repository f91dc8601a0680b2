#version 450
// Moment Transparency: Sharpe 2018. A pixel keeps of each pass four means of powers of depth, and
// b0; with two passes each fragment keeps z, and, as two whole numbers in `indices`, the double
// that the first leaves of its absorbance.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   PASSES                 1 or 2: of moments
//   STORAGE                of kernels/options.h
//   SYMMETRIC              0 or 1: depth lies in [0, 1] or [-1, 1]
//   OF_BLOCKS              0 or 1: moments are of blocks of pixels (arrays/blocks.glsl). Where
//                          these are made factors are of blocks, offsets and state of the pixels
//                          that they take.
//   FROM_TRIANGLES         defined where triangles, not arrays, are captured; then
//   ROUND                  0 or 1: of two passes of moments, which is drawn
#define NODES 2
#include "meshes/extensions.glsl"
#include "kernels/options.h"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/kept_sums.h"
#include "kernels/warp.h"
#include "kernels/power_moments.h"
#include "kernels/moment_transparency.h"
#include "arrays/fragments.glsl"
#include "arrays/means.glsl"
#include "arrays/warp.glsl"

#define EACH (STATE_SIZE / PASSES) // numbers of one pass: moments and b0
// In factors: nodes, what rounding took from them, residues, pivot, b0, the passes' ratio; in wide
// of the first of two passes: nodes, residues, pivot, b0.

uniform number shrink; // what alpha is less for
uniform number beta;
uniform uint exclude_self; // 1: a fragment does not occlude itself

#ifdef FROM_TRIANGLES
uint state_of(uint p) { return STATE_SIZE * p; }
#else
uint state_of(uint p) {
    return STATE_SIZE * p + (PASSES == 2 && OF_BLOCKS == 0 ? offsets[p] : 0u);
}
#endif
uint kept_of(uint p, uint i) { return STATE_SIZE * (p + 1u) + i; } // of a fragment

// these compute rules
#if DOUBLE && (PASS == CAPTURE || PASS == FACTOR || PASS == BETWEEN || OF_BLOCKS == 1)
#include "kernels/nonlinear_moments.h"
#include "kernels/pairs.h"
#include "kernels/power_rules.h"

uniform double bias;
uniform double safe[2 * NODES]; // what bias moves moments toward
uniform double least;           // pivots below are rounding alone

double held_total(double b0) {
#if STORAGE == STORAGE_FLOAT32
    return b0;
#else
    return half_absorbance(b0);
#endif
}

// The moments that begin at `at`, and as the storage keeps them.
moments moments_of(uint at) {
    moments m;
    for (int k = 0; k < 4; ++k) m.b[k] = double(state[at + k]);
    return m;
}

moments held_moments(moments m) {
#if STORAGE == STORAGE_UNORM16
    four f;
    for (int k = 0; k < 4; ++k) f.x[k] = m.b[k];
#if SYMMETRIC
    f = symmetric_moments(symmetric_words(f));
#else
    f = unit_moments(unit_words(f));
#endif
    for (int k = 0; k < 4; ++k) m.b[k] = double(SCALAR(f.x[k]));
#endif
    return m;
}

rule rule_of(moments m) {
    moments far_from_degenerate;
    for (int k = 0; k < 4; ++k) far_from_degenerate.b[k] = safe[k];
    rule r = gauss_rule(HELD_AS_FLOATS, m, bias, far_from_degenerate, least);
#if STORAGE == STORAGE_NLQM
    double low = SYMMETRIC == 1 ? -1.0 : 0.0;
    nonlinear words = nonlinear_words(nonlinear_of(r), low, 1.0 - low);
    r = rule_of_nonlinear(nonlinear_values(words, low, 1.0 - low));
#endif
    return r;
}

void keep_rule(uint at, rule r) {
    for (int i = 0; i < 2; ++i) {
        SCALAR g = SCALAR(r.g[i]);
        factors[at + i] = g;
        factors[at + 2u + i] = SCALAR(r.g[i] - double(g));
        factors[at + 4u + i] = SCALAR(r.e[i]);
    }
    factors[at + 6u] = SCALAR(r.d);
}
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE || PASS == TAKEN_SECOND \
    || PASS == DRAW_SHADES || PASS == DRAW_TERMS
rule kept_rule(uint at) {
    rule r;
    for (int i = 0; i < 2; ++i) {
        r.g[i] = factors[at + i];
        r.g_low[i] = factors[at + 2u + i];
        r.e[i] = factors[at + 4u + i];
    }
    r.d = factors[at + 6u];
    return r;
}
#endif

#if PASS == CAPTURE || PASS == SECOND || PASS == TAKEN_SECOND
#if PASSES == 2 && OF_BLOCKS == 0
double z_of(uint p, uint i) { return double(state[kept_of(p, i)]); }
#else
double z_of(uint p, uint i) { return double(warped(number(depths[i]))); }
#endif

#if PASS == TAKEN_SECOND
rule first_rule;
number first_b0;
#endif

double weight_of(uint i) {
#if PASS == TAKEN_SECOND
    real T = transmittance(first_rule, first_b0, warped(number(depths[i])), K(0.0), beta);
    real seen = scaled_absorbance(number(alphas[i]), shrink) * T;
    return double(seen);
#elif PASS == SECOND
    return packDouble2x32(uvec2(indices[2u * i], indices[2u * i + 1u]));
#else
    return double(scaled_absorbance(number(alphas[i]), shrink));
#endif
}

struct sums {
    double b[4]; // means of powers
    double b0;
};

#define NUMBERS 4
#define GATHERS 1
#define OWN_TERMS
#include "arrays/terms.glsl"

moment_term term_of(uint p, uint i) {
    uint of = offsets[p] + i;
    return moment_term(weight_of(of), z_of(p, of));
}
#include "arrays/power_sums.glsl"

sums sums_of(uint p) {
    gather(p, offsets[p + 1u] - offsets[p]);
    return sums(mean_gathered, total_gathered);
}
#endif

#ifdef FROM_TRIANGLES
// Targets add up terms, and multiply up what is let through.

#if PASS == DRAW_TERMS
void set_terms(surface s, uint p) {
    real power = scaled_absorbance(s.alpha, shrink);
    real z = warped(s.depth);
#if ROUND == 1
    number own = exclude_self == 1u ? power : K(0.0);
    uint at = FACTORS_SIZE * p;
    power = power * transmittance(kept_rule(at), factors[at + 7u], z, own, beta);
#endif
    numbers[4] = power;
    for (int k = 0; k < 4; ++k) {
        power = power * z;
        numbers[k] = power;
    }
#if OF_BLOCKS == 0
    numbers[5] = s.alpha;
#endif
}
#elif PASS == COLLECT
void collect(uint p) {
    uint at = STATE_SIZE * p + EACH * ROUND;
    number b0 = numbers[4];
    real inverse = inverse_held(b0);
    for (int k = 0; k < 4; ++k) state[at + k] = numbers[k] * inverse;
    state[at + 4u] = b0;
#if OF_BLOCKS == 0
    set_total(p, double(numbers[5]));
#endif
}
#elif PASS == BETWEEN
void after_round(uint p) {
#if OF_BLOCKS == 1
    uint at = STATE_SIZE * p + EACH * ROUND;
    moments m = held_moments(moments_of(at));
    for (int k = 0; k < 4; ++k) state[at + k] = SCALAR(m.b[k]);
    state[at + 4u] = SCALAR(held_total(double(state[at + 4u])));
    keep_rule(FACTORS_SIZE * p, rule_of(m));
    factors[FACTORS_SIZE * p + 7u] = state[at + 4u];
#else
    keep_rule(FACTORS_SIZE * p, rule_of(held_moments(moments_of(STATE_SIZE * p))));
    factors[FACTORS_SIZE * p + 7u] = SCALAR(held_total(double(state[STATE_SIZE * p + 4u])));
#endif
}
#endif
#if OF_BLOCKS == 1 && PASS == DRAW_SHADES
#define SHADES_SECOND // of a pixel, not of a block: what is let through
number second_of(surface s) { return s.alpha; }
#elif OF_BLOCKS == 1 && PASS == RESOLVE
#define RESOLVES_DRAWN
contribution resolved_drawn(uint p, vec4 held, vec4 second) {
    set_total(p, double(second.x));
    return contribution(double[3](double(held.r), double(held.g), double(held.b)), double(held.a));
}
#endif
#endif

#define HOLDS_BLOCKS
#include "arrays/blocks.glsl"

void keep_sums(uint at, double b[4], double b0) {
    for (int k = 0; k < 4; ++k) state[at + k] = SCALAR(b[k]);
    state[at + 4u] = SCALAR(b0);
}

#if PASS == TAKEN_SECOND
layout(std430, binding = ASKED) readonly restrict buffer Takers { uint block_of[]; };

void own_pass(uint p) {
    first_rule = kept_rule(FACTORS_SIZE * block_of[p]);
    first_b0 = number(blocks[STATE_SIZE * block_of[p] + 4u]);
    sums s = sums_of(p);
    keep_sums(STATE_SIZE * p + EACH, s.b, s.b0);
}
#endif

#if PASS == BLOCK_FIRST || PASS == BLOCK_SECOND
void hold_block(uint block, uint at) {
    moments m;
    for (int k = 0; k < 4; ++k) m.b[k] = double(blocks[at + k]);
    m = held_moments(m);
    for (int k = 0; k < 4; ++k) blocks[at + k] = SCALAR(m.b[k]);
    blocks[at + 4u] = SCALAR(held_total(double(blocks[at + 4u])));
    if (PASS == BLOCK_FIRST && PASSES == 2) keep_rule(FACTORS_SIZE * block, rule_of(m));
}
#endif

#if PASS == CAPTURE
void capture(uint p) {
    uint at = state_of(p);
    sums s = sums_of(p);
    keep_sums(at, s.b, s.b0);
#if PASSES == 2 && OF_BLOCKS == 0
    rule r = rule_of(held_moments(moments_of(at)));
    for (int i = 0; i < 2; ++i) {
        doubles[DOUBLES_SIZE * p + i] = r.g[i];
        doubles[DOUBLES_SIZE * p + 2u + i] = r.e[i];
    }
    doubles[DOUBLES_SIZE * p + 4u] = r.d;
    doubles[DOUBLES_SIZE * p + 5u] = STORAGE == STORAGE_FLOAT32 ? s.b0 : held_total(double(SCALAR(s.b0)));
#endif
    if (OF_BLOCKS == 0) set_total(p, let_through(p));
}
#elif PASS == SECOND
void own_pass(uint p) {
    sums s = sums_of(p);
    keep_sums(state_of(p) + EACH, s.b, s.b0);
}
#endif

#if PASS == WARPED
void own_pass(uint p, surface s) { state[kept_of(p, s.place)] = SCALAR(warped(s.depth)); }
#endif

#if PASS == SEEN
void own_pass(uint p, surface s) {
    rule r;
    for (int i = 0; i < 2; ++i) {
        r.g[i] = doubles[DOUBLES_SIZE * p + i];
        r.g_low[i] = 0.0;
        r.e[i] = doubles[DOUBLES_SIZE * p + 2u + i];
    }
    r.d = doubles[DOUBLES_SIZE * p + 4u];
    double z = double(state[kept_of(p, s.place)]);
    real a = scaled_absorbance(s.alpha, shrink);
    real own = exclude_self == 1u ? a : K(0.0);
    real seen = a * transmittance(r, doubles[DOUBLES_SIZE * p + 5u], z, own, beta);
    uvec2 bits = unpackDouble2x32(seen);
    indices[2u * s.place] = bits.x;
    indices[2u * s.place + 1u] = bits.y;
}
#endif

#if PASS == FACTOR
void factor(uint p) {
    uint first = state_of(p);
    uint last = first + EACH * (PASSES - 1u);
    uint at = FACTORS_SIZE * p;
    double b0 = double(state[last + 4u]);
    double first_b0 = double(state[first + 4u]);
#if OF_BLOCKS == 1
    keep_rule(at, rule_of(moments_of(last))); // blocks have them as the storage keeps them
#else
    keep_rule(at, rule_of(held_moments(moments_of(last))));
    b0 = held_total(b0);
    first_b0 = held_total(first_b0);
#endif
    factors[at + 7u] = SCALAR(b0);
    factors[at + 8u] = SCALAR(first_b0);
}
#endif

#if PASS == RATIO_PASS
void own_pass(uint p) {
    uint at = FACTORS_SIZE * p;
    factors[at + 8u] = SCALAR(covered_ratio(factors[at + 8u], factors[at + 7u]));
}
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE || PASS == DRAW_SHADES
rule ray;
number ray_b0;
number ray_ratio;

void load_ray(uint p) {
    uint at = FACTORS_SIZE * p;
    ray = kept_rule(at);
    ray_b0 = factors[at + 7u];
    ray_ratio = factors[at + 8u];
}

number own_absorbance(uint p, surface s) {
    if (exclude_self == 0u || s.place == ~0u) return K(0.0);
#if PASSES == 2
    return number(packDouble2x32(uvec2(indices[2u * s.place], indices[2u * s.place + 1u])));
#else
    return scaled_absorbance(s.alpha, shrink);
#endif
}

number in_front(uint p, surface s) {
#if ABSORBS == 1
    return absorbance_before(ray, ray_b0, warped(s.depth), own_absorbance(p, s), beta);
#endif
    number T = transmittance(ray, ray_b0, warped(s.depth), own_absorbance(p, s), beta);
#if PASSES == 2
    T = two_pass_transmittance(T, ray_ratio);
#elif OF_BLOCKS == 1
    T = next_to_nothing(T);
#endif
    return T;
}
#endif

#if STORAGE != STORAGE_FLOAT32 && OF_BLOCKS == 0 && PASS == COMPOSITE
#define OVERFLOWS
bool overflowed(uint p) { return state[STATE_SIZE * p + 4u] >= MOST_HALF; }
#endif
#include "arrays/questions.glsl"
