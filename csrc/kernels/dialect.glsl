// GLSL's reading of the dialect spoken in csrc/kernels/ (README.md there has it on a page).
// A pass may define `real` as double before it includes this file.
#ifndef real
#define real float
#endif
#define FN
#define STRUCT(name) struct name
#define K(x) real(x)
#define BY_PRECISION(single, twice) (single)
#define NAMED(name) name
#define truth bool
#define select(t, a, b) ((t) ? (a) : (b))

float exponent_of(float x) {
    int n;
    float m = frexp(x, n); // m in [1/2, 1)
    return float(m < 0.70710678 ? n - 1 : n);
}
float times_power_of_two(float x, float n) { return ldexp(x, int(n)); }
float nearest_integer(float x) { return roundEven(x); }
