/* Loops of moments backwards, as one table per instruction set, of the same bits. */
#ifndef MOIT_ADJOINTS_MOMENTS_H
#define MOIT_ADJOINTS_MOMENTS_H

#include "core/adjoints/adjoints.h"
#include "core/adjoints/rays.h"

/* Numbers of the polynomial of one pixel, at most (dual_of_count.h). */
enum { MOIT_MOST_TERMS = 15 };

/* A pixel whose total moves by by_b0, and of whose means the share `keeps` is its own. */
typedef struct moit_spread {
    const double *a; /* padded */
    double b0, by_b0, keeps;
} moit_spread;

/* Rows of floats that moit_bound_of_rows is asked of. slopes, by_z: or NULL. */
typedef struct moit_rows {
    int64_t rays; /* of a row */
    const float *rows, *z;
    float *bound, *slopes, *by_z;
    double bias, least, beta;
    const double *safe;
} moit_rows;

/* The least bias, and the most moments, that bound_rows is of: pivots then are known to 1e-9. */
#define MOIT_ROWS_BIAS 1e-6
enum { MOIT_ROWS_COUNT = 4 };

/* Rays of fragments whose rules are sought with twice the digits: where there are such, they are
 * written over `rules`. low: (pixels, nodes + 1) the rest of nodes, and 1; else 0. */
typedef struct moit_exact_rays {
    int pixels;
    const int32_t *offsets;
    const double *a, *z, *b0; /* (fragments), padded; (pixels) */
    double bias;
    const double *safe;
    double *rules, *low;
} moit_exact_rays;

/* With less bias rules are sought so, of rays of at least that much absorbance. */
#define MOIT_LITTLE_BIAS 1e-9
#define LEAST_EXACT_MASS 1e-100

/* Of a family of moments, as moit_stages.moments has them. Arrays of places are padded. */
typedef struct moit_moment_adjoints {
    /* Of one pixel's places; adds to by_z and by_own, fills S and gives what b0 changes by. */
    double (*sum_pulled)(int count, const moit_wrapping_zone *zone, const moit_readings *at,
                         const double *rule, double b0, double beta, double *S);
    /* The polynomial of S and its slope at each z. */
    void (*read_polynomial)(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                            const double *S, const double *z, double *value, double *slope);
    /* From a polynomial's value and slope at each of n surfaces: adds to by_z and by_a. */
    void (*spread)(int n, const moit_spread *from, const double *value, const double *slope,
                   double *by_z, double *by_a);
    /* Of n rays with a place each: by_b0, by_z and by_own are filled, and by_b (n, numbers). NULL:
     * there is no such. */
    void (*pull_each)(int count, int n, const double *rules, const double *b0, const double *z,
                      const double *own, double beta, const double *by, double *by_b0, double *by_b,
                      double *by_z, double *by_own);
    /* All nodes but z of the distribution through each of n z, as bounds take them: y and whether
     * they lie in front (nodes, stride), 1 or 0; stride: at least n, padded. NULL: none are proved.
     */
    void (*nodes_through)(int count, int n, const double *rule, const double *z, int stride,
                          double *y, double *ahead);
    /* What `n` rays from `first` on bound, and slopes, by one loop. NULL: there is no such. */
    void (*bound_rows)(int count, const moit_rows *rows, int64_t first, int n);
    /* Whether all rays that absorb have such a rule; NULL: none has. */
    bool (*exact_rules)(int count, const moit_exact_rays *rays);
    /* Of many pixels at once; NULL: there are no such. */
    moit_ray_adjoints rays;
} moit_moment_adjoints;

extern const moit_moment_adjoints moit_moment_adjoints_base[2], moit_moment_adjoints_avx2[2],
    moit_moment_adjoints_avx512[2];

/* With less bias than that, rays of no more fragments than the rule has nodes are exact wherever
 * these lie, as far as their moments tell. Steps of the curve and moments that move with them take
 * each other away then, and what is left of both is rounding. */
#define MOIT_NO_BIAS 1e-12

/* Of a pixel: the rule of its moments, of the total b0, and its n fragments, of which `surfaces`
 * count. by_bias: is filled with what the bias changes by, from `safe` and `biased`; or NULL. */
typedef struct moit_moment_state {
    const moit_moment_adjoints *adjoints;
    moit_wrapping_zone zone;
    int count, n, nodes, rule_size;
    const double *rule, *a, *z;
    double b0, bias, beta;
    bool holds; /* fewer bits than moments have: fragments move these as exact sums do */
    int surfaces;
    int family;                  /* its place in moit_stages.moments */
    const double *safe, *biased; /* moments that bias mixes in, and those with it */
    double *by_bias;
} moit_moment_state;

/* What all pixels have in common; and fills in what is pixel p's. */
moit_moment_state moit_any_state(const moit_job *job);
void moit_move_state(const moit_tile *tile, int p, moit_moment_state *s);

/* A polynomial of power moments: the sum of factor[k] (z - middle)^k, k = 1 to 6. */
typedef struct moit_shape {
    double middle, factor[7];
    double mean; /* over the distribution that it is of, bias mixed in */
} moit_shape;

/* Adds it to the coefficients of (z - around)^k, k = 0 to 6 at most. */
void moit_add_shape(const moit_shape *shape, double around, double *coefficients);

/* After all that was read of a state is in at->by_z: 0, where moments say all of the pixel's
 * fragments. */
void moit_leave_depths(const moit_moment_state *s, const moit_readings *at);

/* By a state's moments, the polynomials of S and, unless NULL, `shape`, and by b0: adds to by_z and
 * by_a. value, slope: (n) to work with, padded.
 */
void moit_give_state(const moit_moment_state *s, const double *S, const moit_shape *shape,
                     double by_b0, double *value, double *slope, double *by_z, double *by_a);

/* The constant of u' S u, and what moit_moments_of_terms has in full. */
double moit_moments_constant(int nodes, const double *rule, const double *S);

/* By what was read of a state, and by b0. value, slope: as above. */
void moit_pull_state(const moit_moment_state *s, double by_b0, const moit_readings *at,
                     double *value, double *slope, double *by_z, double *by_a);

/* From the polynomial of S to derivatives by moments: adds to by_b. */
void moit_moments_of_terms(const moit_moment_adjoints *adjoints, int family,
                           const moit_wrapping_zone *zone, int nodes, const double *rule,
                           const double *S, double *by_b);

/* What was read of pixel p's state: fills S (MOIT_MOST_TERMS) and shape, and gives what b0 changes
 * by. */
typedef double moit_read_pixel(const moit_job *job, const moit_tile *tile,
                               const moit_moment_state *s, int p, const moit_adjoint *by, double *S,
                               moit_shape *shape);

/* Of a pixel of bounded neural transmittance. */
void moit_bounded_pull_pixel(const moit_job *job, const moit_tile *tile, const moit_moment_state *s,
                             int p, const moit_adjoint *by);

/* Those of a technique that stores moments. */
const moit_moment_adjoints *moit_moment_adjoints_of(const moit_technique *technique, moit_isa isa);

#endif
