#undef number
#if DOUBLE
#define number double
#else
#define number float
#endif
