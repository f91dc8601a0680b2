#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
#define SCALAR double
#define LANES 4
#define VECTOR_BYTES 32
#define FUSED
#define TABLE moit_moment_adjoints_avx2
#define TILE_TABLE moit_tile_adjoints_avx2
#define TARGET "avx2,fma"
#include "core/adjoints/moments_body.h"
#endif
