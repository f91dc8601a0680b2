// Moments in words of 16 bits, which fragments change one after the other: MBOIT section 3.4 and
// the matrices of its supplement. A text of moments comes before; of it, this has
//
// NODES     2, 3 or 4
// CIRCLE    1: trigonometric moments; 0: powers
//
// Of words a pixel's sums are made again, and all is as without words from there on.
#include "engine/dialect.glsl"

// 1: total absorbance is a half float; 0: a float.
#ifndef HALF_TOTAL
#define HALF_TOTAL 1
#endif

#define PRECISE
#define NAMED(name) name
#define rounded_to_single(x) x

float half_sum(float held, float added) { return rounded_to_half(min(held + added, 65504.0)); }

struct circle_point { float cosine; float sine; };

circle_point sine_cosine_of_angle(float angle) { return circle_point(cos(angle), sin(angle)); }

#include "kernels/moment_words.h"

// Total absorbance, then two words in each.
struct state { uint word[NODES + 1]; };

stored unpacked(state held) {
    stored o;
    o.b0 = HALF_TOTAL == 1 ? unpackHalf2x16(held.word[0]).x : uintBitsToFloat(held.word[0]);
    for (int i = 0; i < NODES; ++i) {
        o.word[2 * i] = float(held.word[i + 1] & 65535u);
        o.word[2 * i + 1] = float(held.word[i + 1] >> 16u);
    }
    return o;
}

state packed(stored s) {
    state o;
    o.word[0] = HALF_TOTAL == 1 ? packHalf2x16(vec2(s.b0, 0.0)) : floatBitsToUint(s.b0);
    for (int i = 0; i < NODES; ++i) {
        uint low = uint(clamp(s.word[2 * i], 0.0, 65535.0));
        uint high = uint(clamp(s.word[2 * i + 1], 0.0, 65535.0));
        o.word[i + 1] = low | (high << 16u);
    }
    return o;
}

#if CIRCLE
// Angles of words begin at z = -1, those of sums at z = 0, half of what all depths have behind.
const vec2 HALF_TURN = vec2(-0.98768834, 0.15643447);
const vec2 BACK = vec2(-0.98768834, -0.15643447);

// Of powers of a point of the circle.
terms terms_at(float z) {
    vec2 once = turned(on_the_circle(z), HALF_TURN), power = once;
    terms t;
    for (int i = 0; i < NODES; ++i) {
        t.of[2 * i] = 0.5 * power.x;
        t.of[2 * i + 1] = 0.5 * power.y;
        t.offset[2 * i] = 0.5;
        t.offset[2 * i + 1] = 0.5;
        power = turned(power, once);
    }
    return t;
}

vec2 point_of(stored s, int i) {
    vec2 held = vec2(s.word[2 * i], s.word[2 * i + 1]) * (2.0 / 65535.0) - 1.0;
    return s.b0 > 0.0 ? held : vec2(0.0);
}
#else
terms terms_at(float z) { return power_terms(z); }
#endif

// What a pixel keeps once a fragment has come.
state inserted(state held, float z, float alpha) {
    return packed(blended(unpacked(held), terms_at(z), absorbance(alpha), HALF_TOTAL));
}

// The sums that words stand for.
sums sums_of_words(state held) {
    stored s = unpacked(held);
    float b0 = s.b0;
#if CIRCLE
    vec2 back2 = turned(BACK, BACK);
    vec4 low = vec4(turned(point_of(s, 0), BACK), turned(point_of(s, 1), back2));
#else
    decoded m = power_decoded(s);
    vec4 low = vec4(m.b[0], m.b[1], m.b[2], m.b[3]);
#endif
    sums o;
    o.target0 = low * b0;
#if NODES == 2
    o.target1 = b0;
#elif CIRCLE && NODES == 3
    o.target1 = turned(point_of(s, 2), turned(back2, BACK)) * b0;
    o.target2 = b0;
#elif CIRCLE
    vec2 third = turned(point_of(s, 2), turned(back2, BACK));
    o.target1 = vec4(third, turned(point_of(s, 3), turned(back2, back2))) * b0;
    o.target2 = b0;
#elif NODES == 3
    o.target1 = vec2(m.b[4], m.b[5]) * b0;
    o.target2 = b0;
#else
    o.target1 = vec4(m.b[4], m.b[5], m.b[6], m.b[7]) * b0;
    o.target2 = b0;
#endif
    return o;
}

factors factor_of_words(state held) { return factor(sums_of_words(held)); }

float transmittance_of_words(state held, float z, float alpha) {
    return transmittance(factor(sums_of_words(held)), z, alpha);
}

vec4 resolve_words(vec4 shaded_sum, state held) { return covered(shaded_sum, unpacked(held).b0); }
