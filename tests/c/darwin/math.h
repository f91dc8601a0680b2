#pragma once
#define HUGE_VAL __builtin_huge_val()
#define HUGE_VALF __builtin_huge_valf()
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define M_PI 3.14159265358979323846264338327950288
#define isfinite(x) __builtin_isfinite(x)
#define isinf(x) __builtin_isinf(x)
#define isnan(x) __builtin_isnan(x)
#define signbit(x) __builtin_signbit(x)
double ceil(double), cos(double), erf(double), erfc(double), exp(double), exp2(double),
    expm1(double), fabs(double), floor(double), log(double), log10(double), log1p(double),
    log2(double), nearbyint(double), rint(double), round(double), sin(double), sqrt(double),
    tan(double), trunc(double);
double atan2(double, double), copysign(double, double), fmax(double, double), fmin(double, double),
    fmod(double, double), hypot(double, double), nextafter(double, double), pow(double, double);
double fma(double, double, double), frexp(double, int *), ldexp(double, int);
float ceilf(float), cosf(float), erff(float), erfcf(float), expf(float), exp2f(float),
    expm1f(float), fabsf(float), floorf(float), logf(float), log10f(float), log1pf(float),
    log2f(float), nearbyintf(float), rintf(float), roundf(float), sinf(float), sqrtf(float),
    tanf(float), truncf(float);
float atan2f(float, float), copysignf(float, float), fmaxf(float, float), fminf(float, float),
    fmodf(float, float), hypotf(float, float), nextafterf(float, float), powf(float, float);
float fmaf(float, float, float), frexpf(float, int *), ldexpf(float, int);
int ilogb(double), ilogbf(float);
long lrint(double), lrintf(float), lround(double), lroundf(float);
