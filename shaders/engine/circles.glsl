// The circle of trigonometric moments as a line: y = tan of half the angle from z = 0. MBOIT eq. 5
// and 6 with a wrapping zone of theta = pi / 10.
#include "engine/turns.glsl"

// TURN: half the angle from z = 0 to z = 1, (2 pi - theta) / 4; REST: pi / 2 - TURN. The zone is
// where |1 / y| < EDGE = tan(theta / 4); there, ZONE_SCALE is of what eq. 6 takes off 1.
const float TURN = 1.49225651;
const float REST = 0.0785398163;
const float EDGE = 0.0787017068;
const float ZONE_SCALE = 5.55281508;

// tan(|z| TURN), or where |z| > 0.5 its inverse; good to a few ulps of how far the angle is from
// z = 0 and from the zone's middle.
float tangent_of(float size) {
    float a = size > 0.5 ? (1.0 - size) * TURN + REST : size * TURN, q = a * a;
    float t = q * (q * (q * 0.0097733503 + 0.0024640302) + 0.02483893) + 0.053296898;
    return (q * (q * t + 0.13340177) + 0.33333105) * q * a + a;
}

// tan(z TURN).
float on_the_line(float z) {
    float t = tangent_of(abs(z)), y = abs(z) > 0.5 ? 1.0 / t : t;
    return z < 0.0 ? -y : y;
}

// The cosine and sine of the angle from z = 0, by the tangent that is read there.
vec2 on_the_circle(float z) {
    float t = tangent_of(abs(z)), c = 2.0 / (t * t + 1.0), s = c * t, d = c - 1.0;
    return vec2(abs(z) > 0.5 ? -d : d, z < 0.0 ? -s : s);
}

// Eq. 6 in the zone, as a function of 1 / y from EDGE, at the end of depth, to -EDGE, where angles
// start again: with t the tangent of half the angle left, 7 - psi = 2 t (1 + t) / (1 + t^2).
vec2 wrapped_shares(vec2 inverse) {
    vec2 left = (EDGE + inverse) * ((1.0 - EDGE) * inverse + (1.0 + EDGE));
    return clamp(1.0 - ZONE_SCALE * left / (inverse * inverse + 1.0), vec2(0.0), vec2(1.0));
}

// How much of the outermost nodes on both sides is in front; y is -y where the ray is seen from its
// end.
vec2 shares_of_ends(float low, float high, bool mirrored) {
    vec2 inverse = vec2(max(1.0 / min(low, -1.0), -EDGE), min(1.0 / max(high, 1.0), EDGE));
    vec2 share = wrapped_shares(mirrored ? -inverse : inverse);
    return mirrored ? 1.0 - share : share;
}

#if PLAIN
#define PLUS +
#define LESS -
#define sum_of(x, y, sign) x sign y
#define mixed(a, x, b, y, low) a * x + b * y + low
#define mixed_alone(a, x, b, y) a * x + b * y
#else
#define PLUS 1.0
#define LESS -1.0
#define mixed_alone(a, x, b, y) mixed(a, x, b, y, 0.0)

// x + sign y.
vec2 sum_of(vec2 x, vec2 y, float sign) {
    precise float h = sign * y.x, s = x.x + h, of_y = s - x.x, of_x = s - of_y, a = x.x - of_x;
    precise float b = h - of_y, l = a + b, low = sign * y.y + x.y;
    l = l + low;
    return vec2(s, l);
}

// a x + b y, and what is beside it.
vec2 mixed(float a, float x, float b, float y, float low) {
    precise float p = a * x, q = b * y, l = low - left_of(p, a, x);
    l = l - left_of(q, b, y);
    return sum_of(vec2(p, l), vec2(q, 0.0), 1.0);
}
#endif
