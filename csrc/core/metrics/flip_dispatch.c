/* Which table of FLIP's lines runs. */
#include "core/metrics/flip.h"

extern const flip_lines moit_flip_base, moit_flip_avx2, moit_flip_avx512;

const flip_lines *moit_flip_lines_of(moit_isa isa) {
    static const flip_lines *const tables[MOIT_ISA_COUNT] = {
        [MOIT_ISA_BASE] = &moit_flip_base,
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
        [MOIT_ISA_AVX2] = &moit_flip_avx2,
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
        [MOIT_ISA_AVX512] = &moit_flip_avx512,
#endif
    };
    return tables[isa];
}
