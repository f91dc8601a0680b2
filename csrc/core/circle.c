/* Sine, cosine and tangent by pairs. */
#include "core/elementary.h"

#include <math.h>

#define SCALAR double
#define LANES 2 /* of which the first is used: what pairs are made of is a vector */
#include "kernels/dialect.h"
#include "kernels/pairs.h"

typedef struct {
    pair sine, cosine;
} circle_pairs;

/* They are asked for constants only: the whole series is of pairs. */
static circle_pairs circle_of(double x) {
    enum { TERMS = 12 };
    const double most = 0x1p20; /* beyond, little is left of what is within a turn */
    pair none = pair_of(K((double)NAN));
    if (!(fabs(x) < most)) return (circle_pairs){none, none};
    const double high = 1.57079632673412561417, low = 6.07710050650619224932e-11;
    double quarters = rint(x * 0.63661977236758134308);
    pair r = pair_difference(pair_of(K(x - quarters * high)), exact_product(K(quarters), K(low)));
    pair square = pair_product(r, r), one = pair_of(K(1.0)), sine = one, cosine = one;
    for (int k = TERMS; k > 0; --k) {
        pair of_sine = pair_quotient(square, pair_of(K(2.0 * k * (2 * k + 1))));
        pair of_cosine = pair_quotient(square, pair_of(K(2.0 * k * (2 * k - 1))));
        sine = pair_difference(one, pair_product(sine, of_sine));
        cosine = pair_difference(one, pair_product(cosine, of_cosine));
    }
    sine = pair_product(sine, r);
    pair zero = pair_of(K(0.0)), minus_sine = pair_difference(zero, sine),
         minus_cosine = pair_difference(zero, cosine);
    switch ((int)quarters & 3) {
    case 0: return (circle_pairs){sine, cosine};
    case 1: return (circle_pairs){cosine, minus_sine};
    case 2: return (circle_pairs){minus_sine, minus_cosine};
    default: return (circle_pairs){minus_cosine, sine};
    }
}

double moit_sin(double x) { return circle_of(x).sine.high[0]; }

double moit_cos(double x) { return circle_of(x).cosine.high[0]; }

double moit_tan(double x) {
    circle_pairs p = circle_of(x);
    return pair_quotient(p.sine, p.cosine).high[0];
}
