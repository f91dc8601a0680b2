// From here to end_double.glsl numbers are double. Literals of what is included in between need the
// suffix lf: `#include "..." // in double` writes it. Functions that passes have of floats too are
// told apart by what they take; NUMBERS_ARE_DOUBLE says whether all others are of doubles anyway.
#if DOUBLE
#define NUMBERS_ARE_DOUBLE 1
#else
#define NUMBERS_ARE_DOUBLE 0
#endif
#undef DOUBLE
#define DOUBLE 1
#undef number
#define number double
#undef BY_PRECISION
#define BY_PRECISION(single, twice) (twice)
