#version 450
// What the published pass over trigonometric moments costs: algorithm 2 of Moment-Based Order-
// Independent Transparency (Muenstermann, Krumpen, Klein, Peters 2018), written plainly from the
// paper, each fragment with its own factorisation. A yardstick: moit draws nothing with it.
//
// Loops have counts that depend on no other loop, so that compilers unroll them.
//
// MOMENTS : 2, 3 or 4, of two numbers each. BIAS : what they are shrunk by.

#include "published/fragments.glsl"
#include "published/complex.glsl"

#define N MOMENTS
#define ZONE 0.31415927 // the angle for no depth

layout(std430, binding = 1) buffer a_moments { float moments[]; };

// The point of the circle for a depth, (5)
vec2 point_of(float z) {
    float angle = (6.2831853 - ZONE) * (0.5 * z + 0.5);
    return vec2(cos(angle), sin(angle));
}

#if PASS == 1
void main() {
    fragment at = this_fragment();
    float absorbance = -log(1.0 - at.alpha);
    uint to = gl_GlobalInvocationID.x * (2 * N + 1);
    moments[to] = absorbance;
    vec2 x = point_of(at.z), power = absorbance * x;
    for (int i = 0; i < N; ++i) {
        moments[to + 1 + 2 * i] = power.x;
        moments[to + 2 + 2 * i] = power.y;
        power = times(power, x);
    }
}
#else

#if N == 2
void roots_of(vec2 q[N + 1], out vec2 x[N]) {
    vec2 leading = inverse_of(q[2]);
    quadratic_roots(times(q[1], leading), times(q[0], leading), x[0], x[1]);
}
#elif N == 3
void roots_of(vec2 q[N + 1], out vec2 x[N]) {
    vec2 leading = inverse_of(q[3]);
    vec2 a = times(q[2], leading) / 3.0, b = times(q[1], leading) / 3.0, c = times(q[0], leading);
    vec2 aa = times(a, a), size = aa - b;
    vec2 u = cubic_part(size, 0.5 * (3.0 * times(a, b) - c) - times(aa, a));
    const vec2 turn = vec2(-0.5, 0.8660254);
    for (int i = 0; i < N; ++i) {
        x[i] = u + over(size, u) - a;
        u = times(u, turn);
    }
}
#else
// Neumark's two quadratics, by a root of the resolvent that is not the least
void roots_of(vec2 q[N + 1], out vec2 x[N]) {
    vec2 leading = inverse_of(q[4]);
    vec2 a = times(q[3], leading), b = times(q[2], leading);
    vec2 c = times(q[1], leading), d = times(q[0], leading);
    vec2 aa = times(a, a);
    vec2 middle = 2.0 / 3.0 * b; // y = middle + w solves the resolvent
    vec2 e = times(a, c) + times(b, b) - 4.0 * d;
    vec2 f = times(c, c) - times(times(a, b), c) + times(aa, d);
    vec2 size = times(middle, middle) - e / 3.0;
    vec2 cube = times(middle, times(middle, middle));
    vec2 u = cubic_part(size, cube - 0.5 * (times(middle, e) + f));
    vec2 w = u + over(size, u), other = u * -0.5 + 0.8660254 * vec2(-u.y, u.x);
    other = other + over(size, other);
    vec2 y = middle + w, y1 = middle + other;
    y = dot(y, y) > dot(y1, y1) ? y : y1;
    vec2 root = square_root(aa - 4.0 * y), rest = b - y;
    vec2 h = over(times(a, rest) - 2.0 * c, root);
    quadratic_roots(0.5 * (a + root), 0.5 * (rest + h), x[0], x[1]);
    quadratic_roots(0.5 * (a - root), 0.5 * (rest - h), x[2], x[3]);
}
#endif

// Rises with the angle, piece by piece
float parameter(vec2 x) {
    float up = x.x >= 0.0 ? x.y - x.x : 2.0 - x.x - x.y;
    float down = x.x < 0.0 ? 4.0 + x.x - x.y : 6.0 + x.x + x.y;
    return x.y >= 0.0 ? up : down;
}

// (6)
float counted(vec2 x, float own, float last) {
    float here = parameter(x);
    float wrapped = here <= last ? 0.0 : (here - last) / (7.0 - last);
    return here < own ? 1.0 : wrapped;
}

void main() {
    fragment at = this_fragment();
    uint from = gl_GlobalInvocationID.x * (2 * N + 1);
    float b0 = moments[from];
    vec2 b[N + 1];
    b[0] = vec2(1.0, 0.0);
    for (int i = 1; i <= N; ++i)
        b[i] = vec2(moments[from + 2 * i - 1], moments[from + 2 * i]) * ((1.0 - BIAS) / b0);

    // Toeplitz = L D L^H, and q with Toeplitz q = (1, x, x^2, ...)
    vec2 l[N + 1][N + 1], q[N + 1];
    float d[N + 1];
    vec2 x0 = point_of(at.z), power = vec2(1.0, 0.0);
    for (int j = 0; j <= N; ++j) {
        d[j] = 1.0;
        for (int k = 0; k < N; ++k) if (k < j) d[j] -= dot(l[j][k], l[j][k]) * d[k];
        for (int i = 1; i <= N; ++i) {
            if (i <= j) continue;
            vec2 sum = b[i - j];
            for (int k = 0; k < N; ++k)
                if (k < j) sum -= times(l[i][k], conjugate(l[j][k])) * d[k];
            l[i][j] = sum / d[j];
        }
        q[j] = power;
        for (int k = 0; k < N; ++k) if (k < j) q[j] -= times(l[j][k], q[k]);
        power = times(power, x0);
    }
    for (int j = N; j >= 0; --j) {
        q[j] /= d[j];
        for (int k = 1; k <= N; ++k) if (k > j) q[j] -= times(conjugate(l[k][j]), q[k]);
    }
    for (int i = 0; i <= N; ++i) q[i] = conjugate(q[i]);

    vec2 found[N];
    roots_of(q, found);
    float own = parameter(x0), last = parameter(point_of(1.0));
    vec2 x[N + 1], v[N + 1];
    x[0] = x0;
    v[0] = vec2(OVERESTIMATION, 0.0);
    for (int i = 1; i <= N; ++i) {
        x[i] = found[i - 1];
        v[i] = vec2(counted(x[i], own, last), 0.0);
    }

    // The polynomial through (x, v), by divided differences, of the moments
    for (int k = 1; k <= N; ++k)
        for (int i = N; i > 0; --i)
            if (i >= k) v[i] = over(v[i] - v[i - 1], x[i] - x[i - k]);
    vec2 u[N + 1];
    for (int i = 0; i <= N; ++i) u[i] = vec2(0.0);
    u[0] = v[N];
    for (int k = N - 1; k >= 0; --k) {
        for (int i = N; i > 0; --i) if (i <= N - k) u[i] = u[i - 1] - times(x[k], u[i]);
        u[0] = v[k] - times(x[k], u[0]);
    }
    float share = 0.0;
    for (int i = 0; i <= N; ++i) share += times(u[i], b[i]).x;
    give(exp(-b0 * clamp(share, 0.0, 1.0)));
}
#endif
