#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
#define SCALAR double
#define LANES 8
#define VECTOR_BYTES 64
#define RULES
#define FUSED
#define TABLE moit_stages_f64_avx512
#define TARGET "avx512f,avx512dq,avx512vl,avx512bw"
#include "core/stages/body.h"
#endif
