/* Moments in half floats, to which blending adds what each fragment brings, of the image's range of
 * depth or of each pixel's own extent. */
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

bool moit_stores_halves(const moit_technique *technique) {
    const moit_moment_family *family = moit_family_of(technique);
    return family && !family->state && technique->moments.halves;
}

bool moit_extents_are_words(const moit_technique *technique) {
    return technique->range_per_pixel && technique->warp != MOIT_WARP_NONE
           && moit_stores_halves(technique);
}

void moit_moments_gather_halves(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    job->stages->half_moments(technique->count, technique->range_per_pixel, tile->pixels,
                              tile->offsets, tile->absorbance, tile->z, tile->b0, tile->b);
}

/* Extents are kept where sums of colours come when what they are for is done. */
const double *moit_extents(const moit_technique *technique, const moit_tile *tile) {
    return moit_extents_are_words(technique) ? tile->sums : NULL;
}
