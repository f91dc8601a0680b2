// The dialect of the kernels (csrc/kernels/README.md) in floats alone: those that need no digits
// beyond floats are read as they stand.
#define number float
#define real float
#define truth bool
#define FN
#define STRUCT(name) struct name
#define K(x) float(x)
#define U(x) uint(x)
#define BY_PRECISION(single, twice) single
#define BOTH(s, t) (s && t)
#define select(t, a, b) (t ? a : b)

#define nearest_integer(x) floor(x + 0.5)
#define exponential(x) exp2(1.44269504 * (x))
#define within(x, most) clamp(x, 0.0, most)
