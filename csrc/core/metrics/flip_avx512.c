#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
#define SCALAR float
#define LANES 16
#define VECTOR_BYTES 64
#define TABLE moit_flip_avx512
#define TARGET "avx512f,avx512dq,avx512vl,avx512bw"
#include "core/metrics/flip_lines.h"
#endif
