/* Families of moments: what is stored, its constants, and what reads a stored state. */
#ifndef MOIT_MOMENTS_H
#define MOIT_MOMENTS_H

#include "core/tile.h"

typedef struct moit_moment_constants {
    double published_bias;          /* for storage of these bits */
    double default_bias[2];         /* by precision of the storage: measured: docs/exactness.md */
    double covering_bias[2];        /* what outweighs rounding of the storage by itself */
    double safe[MOIT_MOST_NUMBERS]; /* moments of the distribution that bias mixes in */
} moit_moment_constants;

/* The most pixels that a family's own `transmittance` is asked of at a time. */
enum { MOIT_MOST_RAYS_ASKED = 256 };

typedef struct moit_moment_family {
    int stages; /* its place in moit_stages.moments */
    int (*numbers)(int count);
    int (*rule_size)(int count);
    const moit_moment_constants *(*constants)(const moit_technique *technique);
    /* What gathers and reads back a state that is more than b0 and one set of moments; NULL: none.
     */
    void (*state)(const moit_job *job, moit_tile *tile); /* tile->b0 and b */
    void (*transmittance)(const moit_stages *stages, const moit_stages *precise,
                          moit_precision precision, const moit_technique *technique, double bias,
                          int pixels, const int32_t *offsets, const void *b0, const void *b,
                          const void *z, double *double_b, double *rules, void *T);
} moit_moment_family;

extern const moit_moment_family moit_power_moments, moit_mt_moments, moit_trigonometric_moments,
    moit_bounded_moments;

const moit_moment_family *moit_family_of(const moit_technique *technique);

/* That of a technique, or of the tail that front has; zeros where moments have none. */
moit_wrapping_zone moit_wrapping_zone_of(const moit_technique *technique);
bool moit_wrapping_zone_fits(const moit_technique *technique);

bool moit_power_fits(const moit_technique *technique);

/* Fills tile->absorbance, z, b0 and b, and words where moments have 16 bits. */
void moit_moments_gather(const moit_job *job, moit_tile *tile);

/* moment_halves.c: whether a technique's moments are sums in half floats, and what gathers them:
 * tile->b0 and b from absorbance and z. Whether a pixel's own extent is held in words, and its z
 * are within that; and these extents (pixels, 2) of a tile that has gathered, or NULL. */
bool moit_stores_halves(const moit_technique *technique);
void moit_moments_gather_halves(const moit_job *job, moit_tile *tile);
bool moit_extents_are_words(const moit_technique *technique);
const double *moit_extents(const moit_technique *technique, const moit_tile *tile);

/* moment_words.c: storage in 16 bits, and whether that is how a technique stores moments. Gathering
 * fills the words, tile->b0 and b from absorbance and z; the words are (pixels, numbers), within
 * tile->own. */
bool moit_stores_words(const moit_technique *technique);
void moit_moments_gather_words(const moit_job *job, moit_tile *tile);
uint16_t *moit_moment_words(const moit_tile *tile);
size_t moit_moments_scratch(const moit_job *job, int fragments, int pixels);
/* moit_moments_bounds of words and of half floats. */
void moit_moment_words_bounds(const moit_technique *technique, moit_precision precision,
                              int64_t pixels, int64_t depths, const void *b0, const void *alpha,
                              void *lower, void *upper);

/* The stored moments of `pixels` in double, and the rules that reconstruction works with. zone: the
 * technique's; NULL: it has none. */
void moit_moments_read(const moit_stages *precise, moit_precision precision,
                       const moit_technique *technique, const moit_wrapping_zone *zone, double bias,
                       int pixels, const void *b, double *double_b, double *rules);

/* Rays of moments as they are stored, and where they are asked: offsets NULL: at one z each. b and
 * what has a number for each pixel: not padded. */
typedef struct moit_rays_asked {
    int pixels;
    const int32_t *offsets;
    const void *b0, *b, *z, *own; /* own: NULL for none */
} moit_rays_asked;

/* T of power moments that are floats, without rules in memory in between but as rows: as
 * moit_moments_read and `transmittance` have it, bit for bit, which others take (then false). rows:
 * room for MOIT_RULE_ROWS of MOIT_ROW(pixels). */
bool moit_moments_by_rows(const moit_stages *stages, const moit_stages *precise,
                          moit_precision precision, const moit_technique *technique, double bias,
                          bool absorbed, const moit_rays_asked *asked, float *rows, void *T);

/* The same of a tile that has gathered, with its totals: tile->rules, double_b, double_b0,
 * total. */
void moit_moments_read_tile(const moit_job *job, moit_tile *tile);

/* What both take: below which a pivot is rounding alone, and tile->double_b0 and total. */
double moit_least_pivot(const moit_technique *technique, moit_precision precision, double bias);
void moit_moments_find_totals(const moit_job *job, moit_tile *tile);

/* z of the tile's fragments, into tile->z; within extents in words as the image's. */
void moit_warp_tile(const moit_job *job, moit_tile *tile);

/* z of the job's depths in each pixel, into tile->curve_z. */
void moit_moments_warp_curve(const moit_job *job, moit_tile *tile);
/* The same of a tile that has gathered, within extents where these are words. */
void moit_moments_place_curve(const moit_job *job, moit_tile *tile);

#endif
