/* Which table of similarity's lines runs. */
#include "core/metrics/ssim.h"

extern const ssim_lines moit_ssim_base, moit_ssim_avx2, moit_ssim_avx512;

const ssim_lines *moit_ssim_lines_of(moit_isa isa) {
    static const ssim_lines *const tables[MOIT_ISA_COUNT] = {
        [MOIT_ISA_BASE] = &moit_ssim_base,
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
        [MOIT_ISA_AVX2] = &moit_ssim_avx2,
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
        [MOIT_ISA_AVX512] = &moit_ssim_avx512,
#endif
    };
    return tables[isa];
}
