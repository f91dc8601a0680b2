#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
#define SCALAR double
#define LANES 4
#define VECTOR_BYTES 32
#define TABLE moit_ssim_avx2
#define TARGET "avx2"
#include "core/metrics/ssim_lines.h"
#endif
