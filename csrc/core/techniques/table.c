#include "core/techniques/table.h"

#include "core/techniques/moment_transparency.h"

bool moit_absorbs(const moit_technique *technique) {
    (void)technique;
    return true;
}

const moit_technique_row *const moit_technique_rows[MOIT_KIND_COUNT] = {
#define ROW(KIND, row) [MOIT_##KIND] = &moit_##row##_row,
    MOIT_KINDS(ROW)
#undef ROW
};

const char *moit_kind_name(moit_kind kind) { return moit_technique_rows[kind]->name; }

const moit_option *moit_options_of(moit_kind kind) {
    static const moit_option none[] = {{.name = NULL}};
    const moit_option *options = moit_technique_rows[kind]->options;
    return options ? options : none;
}

const int *moit_usual_counts(moit_kind kind) {
    static const int none[] = {0};
    const int *counts = moit_technique_rows[kind]->usual_counts;
    return counts ? counts : none;
}

bool moit_technique_fits(const moit_technique *technique) {
    const moit_technique_row *row = moit_technique_rows[technique->kind];
    if (row->moments) { /* a loop for each count */
        const int *count = row->usual_counts;
        while (*count && *count != technique->count) ++count;
        if (!*count) return false;
    }
    bool in_blocks = row->blocks || row->prepare; /* of blocks.c, or of the technique's own */
    if (technique->resolution > 1
        && (!in_blocks || technique->range_per_pixel || moit_stores_words(technique)
            || moit_stores_halves(technique)))
        return false;
    if (row->fits && !row->fits(technique)) return false;
    return !row->most_count
           || (technique->count >= row->least_count && technique->count <= row->most_count);
}

int moit_network_weights(const moit_technique *technique) {
    const moit_technique_row *row = moit_technique_rows[technique->kind];
    return row->weights ? row->weights(technique) : 0;
}

int moit_network_columns(const moit_technique *technique) {
    const moit_technique_row *row = moit_technique_rows[technique->kind];
    return row->columns ? row->columns(technique) : 0;
}

moit_technique_facts moit_facts_of(moit_kind kind) {
    const moit_technique_row *row = moit_technique_rows[kind];
    return (moit_technique_facts){
        .proves_bounds = row->bounds != NULL,
        .has_curve = row->curve != NULL,
        .is_random = row->is_random,
        .takes_transmission = row->by_channel || !row->resolve,
        .knows_channels = row->by_channel,
        .uses_warp = row->uses_warp,
        .stores_moments = row->moments != NULL,
        .has_network = row->features != NULL, /* of its own */
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
        .thick = row->thick,
    };
}

const double *moit_unit_range(const moit_technique *technique) {
    static const double symmetric[2] = {-1.0, 1.0};
    return technique->kind == MOIT_MOMENT_TRANSPARENCY && technique->transparency.symmetric
               ? symmetric
               : moit_technique_rows[technique->kind]->unit_range;
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
    job.given = fragments->precision;
    job.scratch = moit_technique_rows[technique->kind]->scratch;
    job.warp = moit_warp_over(technique, fragments->near, fragments->far);
    if (moit_technique_rows[technique->kind]->moments) job.bias = technique->moments.bias;
    job.zone = moit_wrapping_zone_of(technique);
    job.max_alpha = moit_held_max_alpha(fragments->precision, technique->max_alpha);
    if (technique->kind == MOIT_WEIGHTED_BLENDED && technique->weighted.weight == MOIT_WEIGHT_GIVEN)
        job.weights = technique->weighted.weights;
    return job;
}
