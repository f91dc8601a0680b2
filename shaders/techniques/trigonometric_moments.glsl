#version 450
// Trigonometric moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018. A pixel keeps the means of powers of points of the circle, real and
// imaginary parts in turn (2 NODES numbers), and b0; of words of 16 bits the words.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   NODES                  2, 3 or 4 moments
//   BITS                   16 or 32: of a stored number
//   B0_IS_HALF             0 or 1, with 16 bits: b0 is a float or a half float
//   LAYERS                 0, or how many of the nearest fragments are kept: moments are then of
//                          all others (arrays/front.glsl)
//   ENGINE                 0 or 1: factors and what is read of them are as engines ship them, in
//                          floats alone (engine/trig2.glsl and its kin); of words of 32 bits
#include "meshes/extensions.glsl"
#include "arrays/reads.glsl"
#if ENGINE && (PASS == FACTOR || READS)
#include "arrays/begin_engine.glsl"
#if NODES == 2
#include "engine/trig2.glsl"
#elif NODES == 3
#include "engine/trig3.glsl"
#else
#include "engine/trig4.glsl"
#endif
#include "arrays/end_engine.glsl"
#endif
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/kept_sums.h"
#include "kernels/warp.h"
#include "kernels/power_moments.h"
#include "kernels/circle_sums.h"
#include "kernels/moment_words.h"
#include "kernels/trigonometric_moments.h"
#include "arrays/fragments.glsl"
#include "arrays/means.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define NUMBERS (2 * NODES)
#include "arrays/front.glsl"
#define BOUNDED 0 // by no network
// In factors: nodes as z and g with what rounding took, residues, d, f, f, b0.

#if PASS == CAPTURE
#if BITS == 16
uniform number half_angle; // of all depths

void capture(uint p) {
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = K(0.0);
    s.b0 = K(0.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface f = surface_at(i);
        s = blended(s, circle_terms(half_angle, warped(f.depth)), absorbance_of(f.alpha), B0_IS_HALF);
    }
    for (int k = 0; k < 2 * NODES; ++k) state[STATE_SIZE * p + k] = SCALAR(s.word[k]);
    state[STATE_SIZE * p + NUMBERS] = SCALAR(s.b0);
}
#endif
#endif

#if GATHERS && BITS == 32
uniform double quarter_angle;   // what z = 1 lies at, from z = 0, by 4
uniform double middle[NUMBERS]; // powers of the point that z = 0 is

void gather(uint p, uint n) {
    precise kept_sum total[4];
    precise kept_sum re[NODES][4];
    precise kept_sum im[NODES][4];
    for (int lane = 0; lane < 4; ++lane) {
        total[lane] = nothing_kept();
        for (int k = 0; k < NODES; ++k) re[k][lane] = im[k][lane] = nothing_kept();
    }
    for (uint i = 0u; i < n; i += 4u)
        for (uint lane = 0u; lane < 4u; ++lane) { // as C's lanes add up
            bool there = i + lane < n;
            moment_term t = term_of(p, there ? i + lane : i);
            precise double weight = there ? t.absorbed : 0.0lf;
            precise double z = there ? t.z : 0.0lf;
            precise quad_point x = quad_point_of(z, quarter_angle);
            precise quad_point power = quad_point(weight * x.re, weight * x.im);
            total[lane] = kept_with(total[lane], weight);
            for (int k = 0; k < NODES; ++k) {
                if (k > 0) power = quad_turned(power, x);
                re[k][lane] = kept_with(re[k][lane], power.re);
                im[k][lane] = kept_with(im[k][lane], power.im);
            }
        }
    precise double all = total_kept(total[0], total[1], total[2], total[3]);
    precise double inverse = inverse_of_sum(all);
    for (int k = 0; k < NODES; ++k) {
        precise double across = total_kept(re[k][0], re[k][1], re[k][2], re[k][3]);
        precise double along = total_kept(im[k][0], im[k][1], im[k][2], im[k][3]);
        across = across * inverse;
        along = along * inverse;
        precise double turned_re = across * middle[2 * k] - along * middle[2 * k + 1];
        precise double turned_im = across * middle[2 * k + 1] + along * middle[2 * k];
        mean_gathered[2 * k] = turned_re;
        mean_gathered[2 * k + 1] = turned_im;
    }
    total_gathered = all;
}

#if PASS == CAPTURE
void capture(uint p) {
    gather(p, offsets[p + 1u] - offsets[p]);
    for (int k = 0; k < NUMBERS; ++k) state[STATE_SIZE * p + k] = SCALAR(mean_gathered[k]);
    state[STATE_SIZE * p + NUMBERS] = SCALAR(total_gathered);
#if LAYERS
    hold_nearest(p);
#endif
}
#endif
#endif

#if PASS != CAPTURE
uniform number zone_turns; // as wrapping_zone has them
uniform number zone_edge;
uniform number zone_scale;
#endif

// Of triangles: targets of 32 bits add up terms; words of 16 bits take one fragment after the
// other.

#if PASS == DRAW_TERMS
uniform double quarter_angle; // what z = 1 lies at, from z = 0, by 4
void set_terms(surface s, uint p) {
    precise double weight = double(absorbance_of(s.alpha));
    precise quad_point x = quad_point_of(double(warped(s.depth)), quarter_angle);
    precise quad_point power = quad_point(weight * x.re, weight * x.im);
    for (int k = 0; k < NODES; ++k) {
        if (k > 0) power = quad_turned(power, x);
        numbers[2 * k] = number(power.re);
        numbers[2 * k + 1] = number(power.im);
    }
    numbers[2 * NODES] = number(weight);
}
#elif PASS == DRAW_ORDERED
uniform number half_angle; // of all depths
void take(surface s) {
    stored held;
    for (int k = 0; k < 2 * NODES; ++k) held.word[k] = numbers[k];
    held.b0 = numbers[2 * NODES];
    held = blended(held, circle_terms(half_angle, warped(s.depth)), absorbance_of(s.alpha), B0_IS_HALF);
    for (int k = 0; k < 2 * NODES; ++k) numbers[k] = held.word[k];
    numbers[2 * NODES] = held.b0;
}
#elif PASS == COLLECT
uniform double middle[2 * NODES]; // powers of the point that z = 0 is
void collect(uint p) {
    precise double b0 = double(numbers[2 * NODES]), inverse = inverse_of_sum(b0);
    for (int k = 0; k < NODES; ++k) {
        precise double re = double(numbers[2 * k]) * inverse;
        precise double im = double(numbers[2 * k + 1]) * inverse;
        precise double turned_re = re * middle[2 * k] - im * middle[2 * k + 1];
        precise double turned_im = re * middle[2 * k + 1] + im * middle[2 * k];
        state[STATE_SIZE * p + 2 * k] = BITS == 16 ? numbers[2 * k] : SCALAR(turned_re);
        state[STATE_SIZE * p + 2 * k + 1] = BITS == 16 ? numbers[2 * k + 1] : SCALAR(turned_im);
    }
    state[STATE_SIZE * p + NUMBERS] = numbers[2 * NODES];
}
#endif

#if ENGINE
#include "arrays/engine_moments.glsl"
#else
#if PASS == FACTOR
#include "kernels/pairs.h"
#include "kernels/power_rules.h"
#include "kernels/trigonometric_rules.h"

#if !LAYERS
uniform double bias;
#endif
uniform double least; // pivots below are rounding alone

void factor(uint p) {
    double b0 = double(state[STATE_SIZE * p + NUMBERS]);
    if (b0 == 0.0) { // as most pixels of many pictures; nothing asks for more
        factors[FACTORS_SIZE * p + 5u * NODES + 3u] = SCALAR(0.0);
        set_total(p, 1.0);
        return;
    }
    double b[2 * NODES];
    for (int k = 0; k < 2 * NODES; ++k) b[k] = double(state[STATE_SIZE * p + k]);
#if BITS == 16
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = b[k];
    s.b0 = b0;
    decoded d = circle_decoded(s);
    for (int k = 0; k < 2 * NODES; ++k) b[k] = double(SCALAR(d.b[k]));
#endif
#if LAYERS
    b0 = tail_of(p, b0, b);
    b = tail_mean;
#endif
    circle_moments m;
    for (int k = 0; k < NODES; ++k) {
        m.re[k] = b[2 * k];
        m.im[k] = b[2 * k + 1];
    }
#if LAYERS
    circle_rule r =
        circle_rule_of(m, wrapping_zone(zone_turns, zone_edge, zone_scale), K(0.0), K(1e-15));
#else
    circle_rule r = circle_rule_of(m, wrapping_zone(zone_turns, zone_edge, zone_scale), bias, least);
#endif
    uint at = FACTORS_SIZE * p;
    for (int i = 0; i < NODES; ++i) {
        SCALAR z = SCALAR(r.z[i]);
        SCALAR g = SCALAR(r.g[i]);
        factors[at + i] = z;
        factors[at + NODES + i] = SCALAR(r.z[i] - double(z));
        factors[at + 2u * NODES + i] = g;
        factors[at + 3u * NODES + i] = SCALAR(r.g[i] - double(g));
        factors[at + 4u * NODES + i] = SCALAR(r.e[i]);
    }
    factors[at + 5u * NODES] = SCALAR(r.d);
    factors[at + 5u * NODES + 1u] = SCALAR(r.f_front);
    factors[at + 5u * NODES + 2u] = SCALAR(r.f_back);
    factors[at + 5u * NODES + 3u] = SCALAR(b0);
#if !LAYERS
    set_total(p, exponential(-b0));
#endif
}
#endif

#if READS
uniform number beta;

circle_rule ray;
number ray_b0;

void load_ray(uint p) {
    uint at = FACTORS_SIZE * p;
    for (int k = 0; k < NODES; ++k) {
        ray.z[k] = factors[at + k];
        ray.z_low[k] = factors[at + NODES + k];
        ray.g[k] = factors[at + 2u * NODES + k];
        ray.g_low[k] = factors[at + 3u * NODES + k];
        ray.e[k] = factors[at + 4u * NODES + k];
    }
    ray.d = factors[at + 5u * NODES];
    ray.f_front = factors[at + 5u * NODES + 1u];
    ray.f_back = factors[at + 5u * NODES + 2u];
    ray_b0 = factors[at + 5u * NODES + 3u];
}

#if LAYERS
number in_tail(uint p, surface s) {
#else
number in_front(uint p, surface s) {
#endif
    if (ray_b0 == K(0.0)) return K(ABSORBS == 1 ? 0.0 : 1.0);
    wrapping_zone zone = wrapping_zone(zone_turns, zone_edge, zone_scale);
    number own = own_absorbance(s.alpha);
#if ABSORBS == 1
    return circle_absorbance_before(ray, zone, ray_b0, warped(s.depth), own, beta);
#else
    return circle_transmittance(ray, zone, ray_b0, warped(s.depth), own, beta);
#endif
}
#endif
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
