// Moments in words of 16 bits, which fragments change one after the other: MBOIT section 3.4 and
// the matrices of its supplement. A text of moments comes before; of it, this has
//
// NODES     2, 3 or 4
// CIRCLE    1: trigonometric moments; 0: powers
//
// A word has, of [0, 1], a number that moments are spread to, odd and even ones apart, and an
// offset; a fragment is added as it stands (csrc/kernels/moment_words.h, which this follows in
// vectors). Of words a pixel's sums are made again, and all is as without words from there on.

// 1: total absorbance is a half float; 0: a float.
#ifndef HALF_TOTAL
#define HALF_TOTAL 1
#endif

// Total absorbance, then two words in each: an odd and an even moment, or cosine and sine.
struct state { uint word[NODES + 1]; };

#if HALF_TOTAL
float total_of(state held) { return unpackHalf2x16(held.word[0]).x; }
uint word_of_total(float b0) { return packHalf2x16(vec2(min(b0, 65504.0), 0.0)); }
#else
float total_of(state held) { return uintBitsToFloat(held.word[0]); }
uint word_of_total(float b0) { return floatBitsToUint(b0); }
#endif

// Two words, as numbers of [0, 1]; and the other way round.
vec2 pair_of(uint w) { return vec2(float(w & 65535u), float(w >> 16u)) / 65535.0; }

uint words_of(vec2 x) {
    vec2 w = clamp(x, vec2(0.0), vec2(1.0)) * 65535.0 + 0.5;
    return uint(w.x) | (uint(w.y) << 16u);
}

#if CIRCLE
// Angles of words begin at z = -1, those of sums at z = 0, half of what all depths have behind.
const vec2 HALF_TURN = vec2(-0.98768834, 0.15643447);

// What a pixel keeps once a fragment has come. Words have half of a point of the circle, whose
// powers are those of multiples of an angle.
state inserted(state held, float z, float alpha) {
    float a = absorbance(alpha), b0 = total_of(held), sum = max(b0 + a, 1e-30);
    vec2 once = turned(on_the_circle(z), HALF_TURN), more = once;
    state o;
    o.word[0] = word_of_total(b0 + a);
    for (int k = 1; k < NODES + 1; ++k) {
        o.word[k] = words_of(((pair_of(held.word[k]) - 0.5) * b0 + more * (0.5 * a)) / sum + 0.5);
        more = turned(more, once);
    }
    return o;
}
#else
#if NODES == 2
#define numbers vec2
#elif NODES == 3
#define numbers vec3
#else
#define numbers vec4
#endif

// What words stand for, without offsets.
struct spread { numbers odd; numbers even; };

#if NODES == 2
const vec2 OFFSET = vec2(0.0);
#elif NODES == 3
const vec3 OFFSET = vec3(0.0, 0.0, 0.018888946);
#else
const vec4 OFFSET = vec4(0.97248197, 1.0, 0.9991792, 0.9917783);
#endif

spread unpacked(state held) {
    vec2 a = pair_of(held.word[1]), b = pair_of(held.word[2]);
    spread o;
#if NODES == 2
    o.odd = vec2(a.x, b.x) - 0.5;
    o.even = vec2(a.y, b.y) - OFFSET;
#elif NODES == 3
    vec2 c = pair_of(held.word[3]);
    o.odd = vec3(a.x, b.x, c.x) - 0.5;
    o.even = vec3(a.y, b.y, c.y) - OFFSET;
#else
    vec2 c = pair_of(held.word[3]), d = pair_of(held.word[4]);
    o.odd = vec4(a.x, b.x, c.x, d.x) - 0.5;
    o.even = vec4(a.y, b.y, c.y, d.y) - OFFSET;
#endif
    return o;
}

state packed(float b0, numbers odd, numbers even) {
    numbers x = odd + 0.5, y = even + OFFSET;
    state o;
    o.word[0] = word_of_total(b0);
    o.word[1] = words_of(vec2(x.x, y.x));
    o.word[2] = words_of(vec2(x.y, y.y));
#if NODES > 2
    o.word[3] = words_of(vec2(x.z, y.z));
#endif
#if NODES > 3
    o.word[4] = words_of(vec2(x.w, y.w));
#endif
    return o;
}

// Spread evenly over what words hold.
spread spread_at(float z) {
    spread o;
    float z2 = z * z, z3 = z2 * z, z4 = z2 * z2;
#if NODES == 2
    o.odd = vec2(1.5, 0.8660254) * z - vec2(2.0, 0.38490018) * z3;
    o.even = vec2(4.0, 0.5) * z2 + vec2(-4.0, 0.5) * z4;
#elif NODES == 3
    o.odd = vec3(2.5, -1.8749987, 1.2658304) * z + vec3(-10.0, 4.2075753, -1.4764488) * z3
            + vec3(8.0, -1.8325768, 0.7106166) * (z4 * z);
    o.even = vec3(4.0, 9.0, -0.57759804) * z2 + vec3(-4.0, -24.0, 4.6193666) * z4
             + vec3(0.0, 16.0, -3.079539) * (z2 * z4);
#else
    float z6 = z2 * z4;
    o.odd = vec4(3.4804463, 1.2679719, -2.167156, 0.97433287) * z
            + vec4(-27.576075, -0.9287558, 6.179502, -0.44342682) * z3
            + vec4(55.12674, -2.0752046, -0.27651557, -0.36049166) * (z4 * z)
            + vec4(-31.53111, 1.2359885, -4.2358303, 0.31014946) * (z6 * z);
    o.even = vec4(0.28050414, -2.0136228, -7.310105, -15.895422) * z2
             + vec4(-0.75763386, 0.22155137, 13.985598, 79.61863) * z4
             + vec4(0.39217958, -1.0610795, -0.114305764, -127.457275) * z6
             + vec4(-0.8875319, 2.838872, -7.43619, 63.734947) * (z4 * z4);
#endif
    return o;
}

// The moments that are spread so.
spread gathered(spread s) {
    numbers x = s.odd, y = s.even;
    spread o;
#if NODES == 2
    o.odd = vec2(1.7320508, 1.299038) * x.y - vec2(0.33333333, 0.75) * x.x;
    o.even = vec2(0.125, -0.125) * y.x + y.y;
#elif NODES == 3
    o.odd = vec3(-0.028777892, 0.099952355, 0.25893354) * x.x
            + vec3(0.4763555, 0.8453258, 0.90779614) * x.y
            + vec3(1.5524281, 1.0547258, 0.83327335) * x.z;
    o.even = vec3(1.2530436e-5, -0.24998747, -0.37498826) * y.x
             + vec3(0.16668494, 0.16668494, 0.21876714) * y.y
             + vec3(0.8660254, 0.8660254, 0.8118988) * y.z;
#else
    o.odd = vec4(-0.004823997, -0.023340221, -0.010888537, -0.030871335) * x.x
            + vec4(-0.4232015, -0.8328291, -0.92639375, -0.9379892) * x.y
            + vec4(0.034831237, 0.019340605, -0.11723395, -0.21803337) * x.z
            + vec4(1.671792, 1.2102151, 0.9837233, 0.84599173) * x.w;
    o.even = vec4(-0.97622025, -1.0482835, -1.0311527, -0.99603844) * y.x
             + vec4(-0.45613927, -0.22972664, -0.07784442, 0.017543862) * y.y
             + vec4(-0.050433554, 0.025960833, 0.0044340887, -0.036141425) * y.z
             + vec4(8.388004e-4, -0.0013363269, -0.010374494, -0.0031784) * y.w;
#endif
    return o;
}

// What a pixel keeps once a fragment has come.
state inserted(state held, float z, float alpha) {
    float a = absorbance(alpha), b0 = total_of(held), sum = max(b0 + a, 1e-30);
    spread s = unpacked(held), t = spread_at(z);
    return packed(b0 + a, (s.odd * b0 + t.odd * a) / sum, (s.even * b0 + t.even * a) / sum);
}
#endif

// The sums that words stand for. Those of angles are turned back by half a turn, or a multiple.
sums sums_of_words(state held) {
    float b0 = total_of(held);
    sums o;
#if CIRCLE
    float whole = 2.0 * b0;
    vec2 a = turned(pair_of(held.word[1]) - 0.5, vec2(-0.98768834, -0.15643447));
    vec2 b = turned(pair_of(held.word[2]) - 0.5, vec2(0.95105652, 0.30901699));
    o.target0 = vec4(a, b) * whole;
#if NODES > 2
    vec2 c = turned(pair_of(held.word[3]) - 0.5, vec2(-0.89100652, -0.4539905));
#endif
#if NODES == 3
    o.target1 = c * whole;
#elif NODES == 4
    vec2 d = turned(pair_of(held.word[4]) - 0.5, vec2(0.80901699, 0.58778525));
    o.target1 = vec4(c, d) * whole;
#endif
#else
    spread m = gathered(unpacked(held));
    o.target0 = vec4(m.odd.x, m.even.x, m.odd.y, m.even.y) * b0;
#if NODES == 3
    o.target1 = vec2(m.odd.z, m.even.z) * b0;
#elif NODES == 4
    o.target1 = vec4(m.odd.z, m.even.z, m.odd.w, m.even.w) * b0;
#endif
#endif
#if NODES == 2
    o.target1 = b0;
#else
    o.target2 = b0;
#endif
    return o;
}

factors factor_of_words(state held) { return factor(sums_of_words(held)); }

float transmittance_of_words(state held, float z, float alpha) {
    return transmittance(factor_of_words(held), z, alpha);
}

vec4 resolve_words(vec4 shaded_sum, state held) { return covered(shaded_sum, total_of(held)); }
