#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
#define SCALAR float
#define LANES 16
#define VECTOR_BYTES 64
#define TABLE moit_single_adjoints_avx512
#define TARGET "avx512f,avx512dq,avx512vl,avx512bw"
#include "core/adjoints/single_body.h"
#endif
