/* Elementary functions of one double, of which our answers are the same bits everywhere: a math
 * library's differ by library, by its release, and by whether a processor has fused products.
 * The largest errors found were 0.51 units in the last place of exp, exp2, log and log1p, 0.59 of
 * expm1, 0.53 of sine, cosine and tangent, 1.5 of erf, 3.1 of erfc (docs/accuracy.md), and
 * infinities, zero and NaN give what IEEE 754 says. The core calls no others. */
#ifndef MOIT_ELEMENTARY_H
#define MOIT_ELEMENTARY_H

double moit_exp(double x);
double moit_expm1(double x);
void moit_exps(int n, const double *x, double *out); /* of each; `out` may be x */
double moit_log(double x);
double moit_log1p(double x);
double moit_exp2(double x); /* of whole numbers exact */
double moit_erf(double x);
double moit_erfc(double x);

/* Of an angle in radians, of up to some turns; beyond 2^20 NaN. */
double moit_sin(double x);
double moit_cos(double x);
double moit_tan(double x);

#endif
