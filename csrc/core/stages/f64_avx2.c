#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
#define SCALAR double
#define LANES 4
#define VECTOR_BYTES 32
#define RULES
#define FUSED
#define TABLE moit_stages_f64_avx2
#define TARGET "avx2,fma"
#include "core/stages/body.h"
#endif
