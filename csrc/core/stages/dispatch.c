/* Which table of stages runs. */
#include "core/stages/stages.h"

extern const moit_stages moit_stages_f32_base, moit_stages_f64_base;
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
extern const moit_stages moit_stages_f32_avx2, moit_stages_f64_avx2;
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
extern const moit_stages moit_stages_f32_avx512, moit_stages_f64_avx512;
#endif

static const moit_stages *const tables[2][MOIT_ISA_COUNT] = {
    [MOIT_FLOAT32][MOIT_ISA_BASE] = &moit_stages_f32_base,
    [MOIT_FLOAT64][MOIT_ISA_BASE] = &moit_stages_f64_base,
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
    [MOIT_FLOAT32][MOIT_ISA_AVX2] = &moit_stages_f32_avx2,
    [MOIT_FLOAT64][MOIT_ISA_AVX2] = &moit_stages_f64_avx2,
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
    [MOIT_FLOAT32][MOIT_ISA_AVX512] = &moit_stages_f32_avx512,
    [MOIT_FLOAT64][MOIT_ISA_AVX512] = &moit_stages_f64_avx512,
#endif
};

bool moit_isa_supported(moit_isa isa) {
#if defined(__x86_64__)
    __builtin_cpu_init(); /* not every compiler's run-time library has asked before we are */
#endif
    switch (isa) {
    case MOIT_ISA_BASE: return true;
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
    case MOIT_ISA_AVX2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
    case MOIT_ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
               && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
#endif
    default: return false;
    }
}

moit_isa moit_isa_best(void) {
    for (int isa = MOIT_ISA_COUNT - 1; isa > 0; --isa)
        if (moit_isa_supported((moit_isa)isa)) return (moit_isa)isa;
    return MOIT_ISA_BASE;
}

const char *moit_isa_name(moit_isa isa) {
    static const char *const names[] = {"base", "avx2", "avx512"};
    return names[isa];
}

const moit_stages *moit_stages_of(moit_precision precision, moit_isa isa) {
    return tables[precision][moit_isa_supported(isa) ? isa : MOIT_ISA_BASE];
}
