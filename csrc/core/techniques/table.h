/* The techniques as a table: what each does with a tile. */
#ifndef MOIT_TECHNIQUES_H
#define MOIT_TECHNIQUES_H

#include "core/adjoints/adjoints.h"
#include "core/techniques/blocks.h"
#include "core/techniques/moments.h"
#include "core/tile.h"
#include "core/totals.h"

typedef struct moit_technique_row {
    const char *name;            /* as its dataclass spells `kind` */
    const moit_option *options;  /* techniques/options.h; NULL: there are none */
    const int *usual_counts;     /* ended by 0; NULL: there is no count */
    int least_count, most_count; /* what loops and scratch are made for */
    /* Whether it can do with other fields than the count; NULL: always. */
    bool (*fits)(const moit_technique *technique);
    /* Fills tile->T and tile->total. */
    void (*weigh)(const moit_job *job, moit_tile *tile);
    /* Fills tile->total alone; NULL: weigh does it. */
    void (*total)(const moit_job *job, moit_tile *tile);
    /* Fills tile->curve and tile->total; NULL: the technique has no curve. */
    void (*curve)(const moit_job *job, moit_tile *tile);
    /* Fills lower and upper, (fragments) or, where the job has depths, (pixels, depths), and
     * tile->total; NULL: all it proves is that the transmittance lies between the total and 1. */
    void (*bounds)(const moit_job *job, moit_tile *tile, double *lower, double *upper);
    /* After weigh, fills tile->sums with (r, g, b, w), the sum of T (emission color, alpha), where
     * it is held otherwise than in double; NULL: in double. */
    void (*blend)(const moit_job *job, moit_tile *tile);
    /* The same as weigh and blend (and tile->total), but that nobody asks for T; NULL: both are
     * called. */
    void (*weigh_and_blend)(const moit_job *job, moit_tile *tile);
    /* Fills tile->sums with (r, g, b, w), what the pixel's fragments add to the image and what they
     * cover, and tile->total; NULL: sums of alpha T (color, 1). */
    void (*resolve)(const moit_job *job, moit_tile *tile);
    /* Before the first tile, once a question: makes job->prepared of the whole image; after the
     * last, lets it go. NULL: there is nothing to prepare. */
    moit_status (*prepare)(moit_job *job);
    void (*release)(moit_job *job);
    /* How many bytes tile->own has, for tiles of up to so many fragments and pixels. */
    size_t (*scratch)(const moit_job *job, int fragments, int pixels);
    const moit_moment_family *moments; /* NULL: it stores none */
    int alone_in_few;                  /* of few moments: see alone.c; 0: as of many */
    const moit_block_family *blocks;   /* NULL: it knows no `resolution` */
    /* Of techniques with a network: how many weights it has, and how many numbers tell of a
     * fragment what it sees; these, `stride` apart, number by number. NULL: there is no network. */
    int (*weights)(const moit_technique *technique);
    int (*columns)(const moit_technique *technique);
    void (*features)(const moit_job *job, moit_tile *tile, int64_t stride, void *features);
    /* As moit_technique_facts has them; its others follow from what a row has. */
    double unit_range[2];
    moit_thick thick; /* zero: points */
    bool uses_warp, is_random, adds_targets, adds_texels, takes_points;
    moit_arrival arrival;
    moit_ties ties;
    int exact_up_to, geometry_passes;
    bool exact_counts, passes_count;
    bool scales_alpha; /* by max_alpha, which else bounds it */
    /* Whether what pixel p keeps is more than its half floats hold, once it is composited; NULL:
     * there are none that may. */
    bool (*overflows)(const moit_job *job, const moit_tile *tile, int p);
    /* Whether weights need not sum to what is covered, so that `normalize` applies. */
    bool reconstructs;
    /* Whether T is exp(-x) and `weigh` can give x; NULL: it cannot. */
    bool (*absorbs)(const moit_technique *technique);
    /* The same, where the totals of channels are its own. */
    bool renormalizes;
    /* Whether weights may sum to more than is covered, where fragments of one depth are all seen
     * through what lies in front of them: colours are scaled by as much then. */
    bool exceeds;
    /* Whether with transmission each channel is an image of its own, with its opacities for alpha;
     * else fragments are seen through the curve of the net coverage, and only what is behind them
     * through its channel's own total. With `resolve` it must be so, or transmission is refused:
     * color counts `emission` times then, not alpha times. */
    bool by_channel;
    /* Derivatives backwards, after `weigh`; NULL: it has none. And why a technique has none with
     * these options; NULL: it always has. */
    moit_pull_back *pull_back;
    /* As weigh of a tile in double, and keeps for pull_back what took a search; NULL: `weigh`. */
    void (*weigh_again)(const moit_job *job, moit_tile *tile, const struct moit_adjoint *by);
    const char *(*refusal)(const moit_technique *technique);
    /* With derivatives, where an image sees fragments otherwise than by the T that `weigh` gives:
     * makes what it sees them by of T (fragments), and backwards, adding to by->alpha and total, of
     * by->T. NULL: it sees them by T. */
    void (*see)(const moit_job *job, const moit_tile *tile, double *T);
    void (*unsee)(const moit_job *job, const moit_tile *tile, const struct moit_adjoint *by);
} moit_technique_row;

/* The largest half float. */
#define MOIT_MOST_HALF 65504.0

bool moit_absorbs(const moit_technique *technique); /* it always does */

/* What depth is warped to. */
const double *moit_unit_range(const moit_technique *technique);

/* How depth in [near, far] is warped. */
moit_warp_map moit_warp_over(const moit_technique *technique, double near, double far);

/* What is known of a pixel's curve whatever the technique: 1 at depths below `near`, 0 behind the
 * opaque surface (infinity: there is none), else the total beyond `far`. */
typedef struct moit_known_range {
    double near, far, opaque;
} moit_known_range;

/* questions.c */
moit_known_range moit_known_range_of(const moit_job *job, const moit_tile *tile, int p);

/* A question about fragments that a technique answers. */
moit_job moit_job_of(const moit_fragments *fragments, const moit_technique *technique,
                     bool cull_opaque, const moit_run *run);

/* Each kind's row stands where its `weigh` does. */
#define ROW(KIND, row) extern const moit_technique_row moit_##row##_row;
MOIT_KINDS(ROW)
#undef ROW
extern const moit_technique_row *const moit_technique_rows[MOIT_KIND_COUNT];

/* moments.c: of any family */
void moit_moments_weigh(const moit_job *job, moit_tile *tile);
extern const moit_block_family moit_moment_blocks, moit_mt_blocks, moit_fourier_blocks,
    moit_function_map_blocks, moit_haar_blocks;

/* moment_transparency.c */
void moit_mt_state(const moit_job *job, moit_tile *tile);
void moit_mt_transmittance(const moit_stages *stages, const moit_stages *precise,
                           moit_precision precision, const moit_technique *technique, double bias,
                           int pixels, const int32_t *offsets, const void *b0, const void *b,
                           const void *z, double *double_b, double *rules, void *T);

/* bounded_neural.c */
int moit_bounded_weights(const moit_technique *technique);
int moit_bounded_columns(const moit_technique *technique);
/* Outlines of a tile whose rules and totals are known. */
double *moit_bounded_read(const moit_job *job, moit_tile *tile);
/* Those that it has left behind the rules. */
const double *moit_bounded_outlines(const moit_job *job, const moit_tile *tile);
void moit_bounded_weigh(const moit_job *job, moit_tile *tile);
void moit_bounded_transmittance(const moit_stages *stages, const moit_stages *precise,
                                moit_precision precision, const moit_technique *technique,
                                double bias, int pixels, const int32_t *offsets, const void *b0,
                                const void *b, const void *z, double *double_b, double *rules,
                                void *T);

/* front.c */
/* The technique that reads the tail: the options of both begin alike. */
moit_technique moit_front_tail(const moit_technique *technique);
void moit_front_see(const moit_job *job, const moit_tile *tile, double *T);
void moit_front_unsee(const moit_job *job, const moit_tile *tile, const struct moit_adjoint *by);
/* What it has left: what a pixel's nearest let through, and T of its tail by itself. */
const double *moit_front_through(const moit_job *job, const moit_tile *tile);
const double *moit_front_tails(const moit_tile *tile);
/* A tail's bias, and how fast it grows with the absorbance of all and of the tail. */
typedef struct moit_tail_bias {
    double bias, by_all, by_rest;
} moit_tail_bias;
moit_tail_bias moit_front_bias(const moit_job *job, int p, const moit_tile *tile);
void moit_front_round_depth(moit_precision precision, int n, const void *z, void *out);

/* neural_moments.c */
/* Rays (pixels, MOIT_NEURAL_RAY) that it has left: nearest and farthest z, count and total. */
const char *moit_neural_rays(const moit_job *job, const moit_tile *tile);

/* deep_fragments.c */
/* Rays (pixels, MOIT_DEEP_RAY) that it has left. */
const char *moit_deep_rays(const moit_job *job, const moit_tile *tile);

/* power_bounds.c */
double moit_bias_of_bounds(moit_precision precision, int count);
void moit_power_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);

/* Between which shares of b0 lies what is in front of places z, of the moments tile->b as they
 * are: no rounding is allowed for. moit_power_bounds leaves its places and shares in tile->points.
 */
void moit_power_shares(const moit_job *job, moit_tile *tile, const double *z, double *at_least,
                       double *at_most);

/* series.c */
/* Numbers of blocks as half floats, where the technique's are; as moit_block_family.hold. */
void moit_hold_halves(const moit_job *job, int blocks, const moit_state *state);
void moit_fourier_gather(const moit_job *job, moit_tile *tile); /* coefficients into tile->own */

/* layers.c */
void moit_peeling_see(const moit_job *job, const moit_tile *tile, double *T);
void moit_peeling_unsee(const moit_job *job, const moit_tile *tile, const struct moit_adjoint *by);

/* slices.c */
bool moit_slices_fit(const moit_technique *technique);
size_t moit_slices_scratch(const moit_job *job, int fragments, int pixels);
void moit_slices_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);

/* slice_volumes.c */
moit_status moit_slices_prepare(moit_job *job);
void moit_slices_release(moit_job *job);

/* anchors.c */
size_t moit_bytes_of_keys(bool large, int fragments);
void moit_words_of_keys(const moit_job *job, bool large, int n, void *z);

/* sorted.c */
void moit_sorted_weigh(const moit_job *job, moit_tile *tile);

/* weighted.c */
double moit_averaged_coverage(double sum, double n); /* of n fragments with this sum of alpha */
/* Whether what pictures let through multiplies up where they are joined. */
bool moit_multiplies_totals(const moit_technique *technique);
/* What targets hold of a tile's pixels: tile->sums, of weight (emission color, alpha), and
 * tile->total, what they let through where that multiplies, or else how many fragments they have.
 * And from these two what a weight of 1 counts, and *total, what the pixel lets through. */
void moit_weighted_targets(const moit_job *job, moit_tile *tile);
double moit_target_share(const moit_technique *technique, double weight, double second,
                         double *total);

#endif
