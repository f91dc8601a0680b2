#if !NUMBERS_ARE_DOUBLE
#undef DOUBLE
#define DOUBLE 0
#undef number
#define number float
#undef BY_PRECISION
#define BY_PRECISION(single, twice) (single)
#endif
#undef NUMBERS_ARE_DOUBLE
