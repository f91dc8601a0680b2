// From here to end_double.glsl numbers are double. Literals of what is included in between need the
// suffix lf: `#include "..." // in double` writes it.
#undef number
#define number double
