#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
#define SCALAR double
#define LANES 8
#define VECTOR_BYTES 64
#define TABLE moit_ssim_avx512
#define TARGET "avx512f,avx512dq,avx512vl,avx512bw"
#include "core/metrics/ssim_lines.h"
#endif
