/* What kernels/pairs.h has, by single numbers: for texts that ask for pairs where a caller knows
 * that one has digits enough. */

typedef struct {
    real high;
} pair;

FN pair pair_of(real x) { return (pair){x}; }
FN pair exact_sum(real a, real b) { return (pair){a + b}; }
FN pair pair_sum(pair a, pair b) { return (pair){a.high + b.high}; }
FN pair pair_difference(pair a, pair b) { return (pair){a.high - b.high}; }
FN pair pair_product(pair a, pair b) { return (pair){a.high * b.high}; }
FN pair pair_quotient(pair a, pair b) { return (pair){a.high / b.high}; }
FN pair pair_select(truth t, pair a, pair b) { return (pair){select(t, a.high, b.high)}; }
