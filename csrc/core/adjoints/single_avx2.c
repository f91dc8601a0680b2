#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
#define SCALAR float
#define LANES 8
#define VECTOR_BYTES 32
#define TABLE moit_single_adjoints_avx2
#define TARGET "avx2"
#include "core/adjoints/single_body.h"
#endif
