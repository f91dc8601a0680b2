/* Where states are read, and from absorbances to opacities. */
#include "core/adjoints/tiles.h"
#include "core/elementary.h"
#include "core/techniques/table.h"

#include <string.h>

const moit_tile_adjoints *moit_tile_adjoints_of(moit_isa isa) {
    if (!moit_isa_supported(isa)) isa = MOIT_ISA_BASE;
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
    if (isa == MOIT_ISA_AVX2) return &moit_tile_adjoints_avx2;
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
    if (isa == MOIT_ISA_AVX512) return &moit_tile_adjoints_avx512;
#endif
    return &moit_tile_adjoints_base;
}

void moit_adjoint_begin(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    for (int k = 1; k < 3; ++k)
        memset(by->work[k], 0, (size_t)tile->fragments * sizeof *by->work[k]);
    if (job->depths)
        memset(by->curve_z, 0, (size_t)(tile->pixels * job->depths) * sizeof *by->curve_z);
}

moit_readings moit_readings_of(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                               int p, bool excludes) {
    int first = (job->depths ? tile->curve_offsets : tile->offsets)[p];
    int end = (job->depths ? tile->curve_offsets : tile->offsets)[p + 1];
    if (job->depths)
        return (moit_readings){.n = end - first,
                               .z = (const double *)tile->curve_z + first,
                               .by = by->T + first,
                               .by_z = by->curve_z + first};
    return (moit_readings){.n = end - first,
                           .z = (const double *)tile->z + first,
                           .own = excludes ? (const double *)tile->absorbance + first : NULL,
                           .by = by->T + first,
                           .by_z = by->work[1] + first,
                           .by_own = by->work[2] + first};
}

double moit_covered_by(double b0, double total) {
    return b0 < MOIT_LITTLE_COVERED ? -moit_expm1(-b0) : 1.0 - total;
}

double moit_absorbance_slope(const moit_technique *technique, double most, double alpha) {
    if (moit_technique_rows[technique->kind]->scales_alpha) return most / (1.0 - most * alpha);
    return alpha > most ? 0.0 : 1.0 / (1.0 - alpha);
}

void moit_adjoint_of_absorbance(const moit_job *job, const moit_tile *tile,
                                const moit_adjoint *by) {
    moit_tile_adjoints_of(job->run->isa)
        ->pull_absorbance(tile->fragments, moit_technique_rows[job->technique->kind]->scales_alpha,
                          job->max_alpha, tile->alpha, by->work[2], by->alpha);
}
