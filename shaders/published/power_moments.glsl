#version 450
// What the published pass over power moments costs: algorithm 1 of Moment-Based Order-Independent
// Transparency (Muenstermann, Krumpen, Klein, Peters 2018), written plainly from the paper, each
// fragment with its own factorisation. A yardstick: moit draws nothing with it.
//
// Loops have counts that depend on no other loop, so that compilers unroll them.
//
// MOMENTS : 4, 6 or 8. BIAS, EVEN : the bias, and b_2, b_4, ... of what is mixed in.

#include "published/fragments.glsl"
#include "published/cubic.glsl"

#define N (MOMENTS / 2)

layout(std430, binding = 1) buffer a_moments { float moments[]; };

#if PASS == 1
void main() {
    fragment at = this_fragment();
    float absorbance = -log(1.0 - at.alpha);
    uint to = gl_GlobalInvocationID.x * (MOMENTS + 1);
    float power = absorbance;
    for (int i = 0; i <= MOMENTS; ++i) {
        moments[to + i] = power;
        power *= at.z;
    }
}
#else

#if N == 2
void roots_of(float q[N + 1], out float x[N]) {
    float p = 0.5 * q[1] / q[2];
    float size = sqrt(max(p * p - q[0] / q[2], 0.0));
    x[0] = -p - size;
    x[1] = -p + size;
}
#elif N == 3
void roots_of(float q[N + 1], out float x[N]) {
    vec3 found = cubic_roots(q[2] / (3.0 * q[3]), q[1] / (3.0 * q[3]), q[0] / q[3]);
    x[0] = found.x;
    x[1] = found.y;
    x[2] = found.z;
}
#else
// Neumark's two quadratics by the resolvent's root of least size; their constants in that of two
// ways which cancels less (Herbison-Evans).
void roots_of(float q[N + 1], out float x[N]) {
    float a = q[3] / q[4], b = q[2] / q[4], c = q[1] / q[4], d = q[0] / q[4];
    vec3 three = cubic_roots(
        -2.0 * b / 3.0, (a * c + b * b - 4.0 * d) / 3.0, c * c - a * b * c + a * a * d);
    float y = abs(three.x) < abs(three.y) ? three.x : three.y;
    y = abs(three.z) < abs(y) ? three.z : y;
    float first = a * a - 4.0 * y, second = (b - y) * (b - y) - 4.0 * d;
    float sure_g = sqrt(max(first, 0.0)), sure_h = sqrt(max(second, 0.0));
    float mixed = 0.5 * a * (b - y) - c; // sure_g sure_h / 2, with its sign
    float g = first > second ? sure_g : 2.0 * mixed / sure_h;
    float h = first > second ? 2.0 * mixed / sure_g : sure_h;
    vec2 p = 0.5 * vec2(a + g, a - g), e = 0.5 * vec2(b - y + h, b - y - h);
    vec2 size = sqrt(max(0.25 * p * p - e, 0.0));
    x[0] = -0.5 * p.x - size.x;
    x[1] = -0.5 * p.x + size.x;
    x[2] = -0.5 * p.y - size.y;
    x[3] = -0.5 * p.y + size.y;
}
#endif

void main() {
    fragment at = this_fragment();
    uint from = gl_GlobalInvocationID.x * (MOMENTS + 1);
    float b0 = moments[from];
    const float even[N] = float[N](EVEN);
    float b[MOMENTS + 1];
    b[0] = 1.0;
    for (int i = 1; i <= MOMENTS; ++i)
        b[i] = mix(moments[from + i] / b0, i % 2 == 0 ? even[max(i / 2 - 1, 0)] : 0.0, BIAS);

    // Hankel = L D L^T, and q with Hankel q = (1, z, z^2, ...)
    float l[N + 1][N + 1], d[N + 1], q[N + 1];
    float power = 1.0;
    for (int j = 0; j <= N; ++j) {
        d[j] = b[2 * j];
        for (int k = 0; k < N; ++k) if (k < j) d[j] -= l[j][k] * l[j][k] * d[k];
        for (int i = 1; i <= N; ++i) {
            if (i <= j) continue;
            float sum = b[i + j];
            for (int k = 0; k < N; ++k) if (k < j) sum -= l[i][k] * l[j][k] * d[k];
            l[i][j] = sum / d[j];
        }
        q[j] = power;
        for (int k = 0; k < N; ++k) if (k < j) q[j] -= l[j][k] * q[k];
        power *= at.z;
    }
    for (int j = N; j >= 0; --j) {
        q[j] /= d[j];
        for (int k = 1; k <= N; ++k) if (k > j) q[j] -= l[k][j] * q[k];
    }

    float found[N];
    roots_of(q, found);
    float x[N + 1], v[N + 1];
    x[0] = at.z;
    v[0] = OVERESTIMATION;
    for (int i = 1; i <= N; ++i) {
        x[i] = found[i - 1];
        v[i] = x[i] < at.z ? 1.0 : 0.0;
    }

    // The polynomial through (x, v), by divided differences, of the moments
    for (int k = 1; k <= N; ++k)
        for (int i = N; i > 0; --i)
            if (i >= k) v[i] = (v[i] - v[i - 1]) / (x[i] - x[i - k]);
    float u[N + 1];
    for (int i = 0; i <= N; ++i) u[i] = 0.0;
    u[0] = v[N];
    for (int k = N - 1; k >= 0; --k) {
        for (int i = N; i > 0; --i) if (i <= N - k) u[i] = u[i - 1] - x[k] * u[i];
        u[0] = v[k] - x[k] * u[0];
    }
    float share = 0.0;
    for (int i = 0; i <= N; ++i) share += u[i] * b[i];
    give(exp(-b0 * clamp(share, 0.0, 1.0)));
}
#endif
