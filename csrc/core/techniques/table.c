#include "core/techniques/table.h"

#include "core/techniques/moment_transparency.h"

bool moit_absorbs(const moit_technique *technique) {
    (void)technique;
    return true;
}

const moit_technique_row moit_technique_rows[MOIT_KIND_COUNT] = {
    [MOIT_SORTED] = {.name = "sorted",
                     .weigh = moit_sorted_weigh,
                     .curve = moit_sorted_curve,
                     .bounds = moit_sorted_bounds,
                     .by_channel = true,
                     .takes_points = true,
                     .arrival = MOIT_TIES_IN_ORDER,
                     .ties = MOIT_TIES_EARLIER,
                     .exact_up_to = MOIT_EXACT,
                     .geometry_passes = 1},
    [MOIT_ALPHA_BLEND] = {.name = "unsorted",
                          .weigh = moit_alpha_blend_weigh,
                          .by_channel = true,
                          .arrival = MOIT_IN_ORDER,
                          .ties = MOIT_TIES_LATER,
                          .exact_up_to = 1,
                          .geometry_passes = 1},
    [MOIT_WEIGHTED_SUM] = {.name = "weighted-sum",
                           .weigh = moit_weighted_sum_weigh,
                           .adds_targets = true,
                           .exact_up_to = 1,
                           .geometry_passes = 1},
    [MOIT_WEIGHTED_AVERAGE] = {.name = "weighted-average",
                               .weigh = moit_weighted_average_weigh,
                               .adds_targets = true,
                               .exact_up_to = 1,
                               .geometry_passes = 1},
    [MOIT_WEIGHTED_BLENDED] = {.name = "wboit",
                               .weigh = moit_weighted_blended_weigh,
                               .overflows = moit_weighted_blended_overflows,
                               .blend = moit_weighted_blended_blend,
                               .total = moit_weighted_blended_total,
                               .adds_targets = true,
                               .geometry_passes = 1},
    [MOIT_POWER_MOMENTS] = {.name = "power",
                            .usual_counts = (const int[]){4, 6, 8, 0},
                            .least_count = 4,
                            .most_count = 8,
                            .weigh = moit_moments_weigh,
                            .curve = moit_moments_curve,
                            .bounds = moit_power_bounds,
                            .scratch = moit_moments_scratch,
                            .moments = &moit_power_moments,
                            .blocks = &moit_moment_blocks,
                            .unit_range = {-1.0, 1.0},
                            .uses_warp = true,
                            .reconstructs = true,
                            .absorbs = moit_absorbs,
                            .adds_texels = true,
                            .geometry_passes = 2},
    [MOIT_TRIGONOMETRIC_MOMENTS] = {.name = "trig",
                                    .usual_counts = (const int[]){2, 3, 4, 0},
                                    .least_count = 2,
                                    .most_count = 4,
                                    .fits = moit_wrapping_zone_fits,
                                    .weigh = moit_moments_weigh,
                                    .curve = moit_moments_curve,
                                    .scratch = moit_moments_scratch,
                                    .moments = &moit_trigonometric_moments,
                                    .blocks = &moit_moment_blocks,
                                    .unit_range = {-1.0, 1.0},
                                    .uses_warp = true,
                                    .reconstructs = true,
                                    .absorbs = moit_absorbs,
                                    .adds_texels = true,
                                    .geometry_passes = 2},
    [MOIT_FOURIER_OPACITY] = {.name = "fourier",
                              .usual_counts = (const int[]){7, 15, 0},
                              .least_count = 3,
                              .most_count = 31,
                              .weigh = moit_fourier_weigh,
                              .curve = moit_fourier_curve,
                              .blocks = &moit_fourier_blocks,
                              .scratch = moit_series_scratch,
                              .unit_range = {0.0, 1.0},
                              .uses_warp = true,
                              .reconstructs = true,
                              .absorbs = moit_absorbs,
                              .adds_texels = true,
                              .geometry_passes = 2},
    [MOIT_FUNCTION_MAP] = {.name = "transmittance-function-map",
                           .usual_counts = (const int[]){8, 0},
                           .least_count = 1,
                           .most_count = 32,
                           .weigh = moit_function_map_weigh,
                           .curve = moit_function_map_curve,
                           .scratch = moit_series_scratch,
                           .unit_range = {0.0, 1.0},
                           .uses_warp = true,
                           .reconstructs = true,
                           .takes_points = true,
                           .geometry_passes = 2},
    [MOIT_DEEP_SHADOW_MAP] = {.name = "deep-shadow",
                              .weigh = moit_deep_shadow_weigh,
                              .curve = moit_deep_shadow_curve,
                              .scratch = moit_deep_shadow_scratch,
                              .reconstructs = true,
                              .geometry_passes = 2},
    [MOIT_HAAR_WAVELETS] = {.name = "wavelet",
                            .usual_counts = (const int[]){4, 8, 16, 32, 0},
                            .least_count = 4,
                            .most_count = 32,
                            .weigh = moit_haar_weigh,
                            .curve = moit_haar_curve,
                            .blocks = &moit_haar_blocks,
                            .scratch = moit_haar_scratch,
                            .unit_range = {0.0, 1.0},
                            .uses_warp = true,
                            .reconstructs = true,
                            .absorbs = moit_absorbs,
                            .takes_points = true,
                            .geometry_passes = 2},
    [MOIT_STOCHASTIC] = {.name = "stochastic",
                         .usual_counts = (const int[]){8, 0},
                         .least_count = 1,
                         .most_count = MOIT_MOST_SAMPLES,
                         .weigh = moit_stochastic_weigh,
                         .total = moit_total_product,
                         .curve = moit_stochastic_curve,
                         .scratch = moit_stochastic_scratch,
                         .is_random = true,
                         .reconstructs = true,
                         .takes_points = true,
                         .geometry_passes = 3},
    [MOIT_HASHED_ALPHA] = {.name = "hashed-alpha",
                           .weigh = moit_stochastic_weigh,
                           .curve = moit_stochastic_curve,
                           .resolve = moit_hashed_alpha_resolve,
                           .scratch = moit_stochastic_scratch,
                           .is_random = true,
                           .takes_points = true,
                           .arrival = MOIT_TIES_IN_ORDER,
                           .ties = MOIT_TIES_EARLIER,
                           .geometry_passes = 1},
    [MOIT_MOMENT_TRANSPARENCY] = {.name = "moment-transparency",
                                  .usual_counts = (const int[]){4, 0},
                                  .least_count = 4,
                                  .most_count = 4,
                                  .fits = moit_mt_fits,
                                  .weigh = moit_mt_weigh,
                                  .overflows = moit_mt_overflows,
                                  .total = moit_total_product,
                                  .curve = moit_mt_curve,
                                  .bounds = moit_power_bounds,
                                  .blocks = &moit_mt_blocks,
                                  .scratch = moit_mt_scratch,
                                  .moments = &moit_mt_moments,
                                  .unit_range = {0.0, 1.0},
                                  .uses_warp = true,
                                  .scales_alpha = true,
                                  .reconstructs = true,
                                  .absorbs = moit_mt_absorbs,
                                  .takes_points = true,
                                  .geometry_passes = 2},
    [MOIT_DEPTH_PEELING] = {.name = "depth-peeling",
                            .usual_counts = (const int[]){4, 0},
                            .least_count = 1,
                            .most_count = MOIT_MOST_LAYERS,
                            .weigh = moit_peeling_weigh,
                            .curve = moit_peeling_curve,
                            .resolve = moit_peeling_resolve,
                            .by_channel = true,
                            .arrival = MOIT_TIES_IN_ORDER,
                            .ties = MOIT_TIES_EARLIER,
                            .exact_counts = true,
                            .passes_count = true},
    [MOIT_ADAPTIVE] = {.name = "adaptive",
                       .usual_counts = (const int[]){4, 0},
                       .least_count = 2,
                       .most_count = MOIT_MOST_LAYERS,
                       .weigh = moit_adaptive_weigh,
                       .curve = moit_adaptive_curve,
                       .scratch = moit_layers_scratch,
                       .unit_range = {0.0, 1.0},
                       .uses_warp = true,
                       .exceeds = true,
                       .arrival = MOIT_IN_ORDER,
                       .geometry_passes = 2},
    [MOIT_MLAB] = {.name = "mlab",
                   .usual_counts = (const int[]){2, 4, 6, 0},
                   .least_count = 1,
                   .most_count = MOIT_MOST_LAYERS,
                   .weigh = moit_mlab_weigh,
                   .overflows = moit_mlab_overflows,
                   .curve = moit_mlab_curve,
                   .resolve = moit_mlab_resolve,
                   .scratch = moit_layers_scratch,
                   .unit_range = {0.0, 1.0},
                   .uses_warp = true,
                   .arrival = MOIT_IN_ORDER,
                   .ties = MOIT_TIES_LATER,
                   .geometry_passes = 1},
    [MOIT_NEURAL_MOMENTS] = {.name = "neural",
                             .weigh = moit_neural_weigh,
                             .curve = moit_neural_curve,
                             .scratch = moit_neural_scratch,
                             .weights = moit_neural_weights,
                             .columns = moit_neural_columns,
                             .features = moit_neural_features,
                             .unit_range = {-1.0, 1.0},
                             .uses_warp = true,
                             .reconstructs = true,
                             .geometry_passes = 2},
    [MOIT_DEEP_FRAGMENTS] = {.name = "dfa",
                             .weigh = moit_deep_weigh,
                             .overflows = moit_deep_overflows,
                             .resolve = moit_deep_resolve,
                             .scratch = moit_deep_scratch,
                             .weights = moit_deep_weights,
                             .columns = moit_deep_columns,
                             .features = moit_deep_features,
                             .unit_range = {0.0, 1.0},
                             .uses_warp = true,
                             .arrival = MOIT_TIES_IN_ORDER,
                             .ties = MOIT_TIES_EARLIER,
                             .geometry_passes = 2},
    [MOIT_BOUNDED_NEURAL] = {.name = "neural-bounded",
                             .usual_counts = (const int[]){4, 6, 0},
                             .least_count = 4,
                             .most_count = 6,
                             .weigh = moit_bounded_weigh,
                             .curve = moit_bounded_curve,
                             .bounds = moit_bounded_bounds,
                             .scratch = moit_bounded_scratch,
                             .moments = &moit_bounded_moments,
                             .blocks = &moit_moment_blocks,
                             .weights = moit_bounded_weights,
                             .columns = moit_bounded_columns,
                             .features = moit_bounded_features,
                             .unit_range = {-1.0, 1.0},
                             .uses_warp = true,
                             .reconstructs = true,
                             .absorbs = moit_absorbs,
                             .geometry_passes = 2},
    [MOIT_KBUFFER] = {.name = "kbuffer",
                      .usual_counts = (const int[]){4, 0},
                      .least_count = 1,
                      .most_count = MOIT_MOST_LAYERS,
                      .weigh = moit_kbuffer_weigh,
                      .by_channel = true,
                      .arrival = MOIT_IN_ORDER,
                      .ties = MOIT_TIES_EARLIER,
                      .exact_up_to = 1,
                      .exact_counts = true,
                      .geometry_passes = 1},
    [MOIT_HYBRID] = {.name = "hybrid",
                     .usual_counts = (const int[]){4, 0},
                     .least_count = 1,
                     .most_count = MOIT_MOST_LAYERS,
                     .weigh = moit_hybrid_weigh,
                     .by_channel = true,
                     .arrival = MOIT_TIES_IN_ORDER,
                     .ties = MOIT_TIES_EARLIER,
                     .exact_up_to = 1,
                     .exact_counts = true,
                     .geometry_passes = 2},
};

const char *moit_kind_name(moit_kind kind) { return moit_technique_rows[kind].name; }

const int *moit_usual_counts(moit_kind kind) {
    static const int none[] = {0};
    const int *counts = moit_technique_rows[kind].usual_counts;
    return counts ? counts : none;
}

bool moit_technique_fits(const moit_technique *technique) {
    const moit_technique_row *row = &moit_technique_rows[technique->kind];
    if (row->moments) { /* a loop for each count */
        const int *count = row->usual_counts;
        while (*count && *count != technique->count) ++count;
        if (!*count) return false;
    }
    if (technique->resolution > 1
        && (!row->blocks || technique->range_per_pixel || moit_stores_words(technique)))
        return false;
    if (row->fits && !row->fits(technique)) return false;
    return !row->most_count
           || (technique->count >= row->least_count && technique->count <= row->most_count);
}

int moit_network_weights(const moit_technique *technique) {
    const moit_technique_row *row = &moit_technique_rows[technique->kind];
    return row->weights ? row->weights(technique) : 0;
}

int moit_network_columns(const moit_technique *technique) {
    const moit_technique_row *row = &moit_technique_rows[technique->kind];
    return row->columns ? row->columns(technique) : 0;
}

moit_technique_facts moit_facts_of(moit_kind kind) {
    const moit_technique_row *row = &moit_technique_rows[kind];
    return (moit_technique_facts){
        .has_curve = row->curve != NULL,
        .is_random = row->is_random,
        .takes_transmission = row->by_channel || !row->resolve,
        .knows_channels = row->by_channel,
        .uses_warp = row->uses_warp,
        .stores_moments = row->moments != NULL,
        .has_network = row->weights != NULL,
        .adds_targets = row->adds_targets,
        .adds_texels = row->adds_texels,
        .takes_points = row->takes_points,
        .arrival = row->arrival,
        .ties = row->ties,
        .exact_up_to = row->exact_up_to,
        .exact_counts = row->exact_counts,
        .geometry_passes = row->geometry_passes,
        .passes_count = row->passes_count,
        .unit_range = {row->unit_range[0], row->unit_range[1]},
    };
}

const double *moit_unit_range(const moit_technique *technique) {
    static const double symmetric[2] = {-1.0, 1.0};
    return technique->kind == MOIT_MOMENT_TRANSPARENCY && technique->transparency.symmetric
               ? symmetric
               : moit_technique_rows[technique->kind].unit_range;
}

moit_warp_map moit_warp_over(const moit_technique *technique, double near, double far) {
    const double *to = moit_unit_range(technique);
    return (moit_warp_map){
        .warp = technique->warp, .near = near, .far = far, .low = to[0], .high = to[1]};
}

moit_job moit_job_of(const moit_fragments *fragments, const moit_technique *technique,
                     bool cull_opaque, const moit_run *run) {
    moit_job job = moit_plain_job(fragments, cull_opaque, run);
    job.technique = technique;
    job.scratch = moit_technique_rows[technique->kind].scratch;
    job.warp = moit_warp_over(technique, fragments->near, fragments->far);
    if (moit_technique_rows[technique->kind].moments) job.bias = technique->moments.bias;
    job.max_alpha = moit_held_max_alpha(fragments->precision, technique->max_alpha);
    if (technique->kind == MOIT_WEIGHTED_BLENDED && technique->weighted.weight == MOIT_WEIGHT_GIVEN)
        job.weights = technique->weighted.weights;
    return job;
}
