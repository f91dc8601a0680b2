/* Compiled once per table of stages.h. A unit defines SCALAR, LANES, TABLE and, beyond the
 * baseline, TARGET; then it includes this file and is done. Everything but the table is static, or
 * the linker might choose one target's copy of a function for all. */
#include "core/stages/stages.h"

#include "core/stages/lanes.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/moment_transparency.h"
#include "kernels/weights.h"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"

#include "core/stages/quads.h"
#include "core/stages/equal_counts.h"
#include "core/stages/flat.h"
#include "core/stages/checks.h"
#include "core/stages/rays.h"
#include "core/stages/power.h"
#include "core/stages/trigonometric.h"
#include "core/stages/neural.h"
#include "core/stages/haar.h"
#include "core/stages/slices.h"
#include "core/stages/words.h"
#include "core/stages/columns.h"
#include "core/stages/half_moments.h"
#include "core/stages/slice_network.h"
#include "core/stages/moment_transparency.h"
#include "core/stages/targets.h"
#include "core/stages/order.h"
#include "core/stages/layers.h"
#include "core/stages/blend.h"
#include "core/stages/series.h"
#include "core/stages/upsampling.h"
#include "core/stages/raster.h"
#include "core/stages/splats.h"
#include "core/stages/strokes.h"
#include "core/stages/stochastic.h"
#include "core/stages/neural_moments.h"
#include "core/stages/deep_fragments.h"
#include "core/stages/anchors.h"

const moit_stages TABLE = {
    .name = STRING(TABLE),
    .all_within = all_within_stage,
    .depths_within = depths_within_stage,
    .none_nearer = none_nearer_stage,
    .opacities = opacities_stage,
    .absorbance = absorbance_stage,
    .warp = warp_stage,
    .decay = decay_stage,
    .moments = {[MOIT_POWER] = {.sums = power_sums_stage,
                                .words = power_words_stage,
                                .decoded = POWER_DECODED_STAGE,
                                .rules = POWER_RULES_STAGE,
                                .pivots = POWER_PIVOTS_STAGE,
                                .transmittance = power_transmittance_stage,
                                .rule_rows = POWER_RULE_ROWS_STAGE,
                                .transmittance_by_rows = POWER_TRANSMITTANCE_BY_ROWS_STAGE},
                [MOIT_TRIGONOMETRIC] = {.sums = circle_sums_stage,
                                        .words = circle_words_stage,
                                        .decoded = CIRCLE_DECODED_STAGE,
                                        .rules = CIRCLE_RULES_STAGE,
                                        .pivots = CIRCLE_PIVOTS_STAGE,
                                        .transmittance = circle_transmittance_stage}},
    .plain_power_sums = POWER_PLAIN_SUMS_STAGE,
    .power_bounds = POWER_BOUNDS_STAGE,
    .half_moments = half_moments_stage,
    .own_extents = own_extents_stage,
    .within_extent = within_extent_stage,
    .bounded_outlines = BOUNDED_OUTLINES_STAGE,
    .bounded_transmittance = bounded_transmittance_stage,
    .bounded_features = bounded_features_stage,
    .bounded_rows = BOUNDED_ROWS_STAGE,
    .bounded_by_rows = BOUNDED_BY_ROWS_STAGE,
    .neural_extents = neural_extents_stage,
    .neural_transmittance = neural_transmittance_stage,
    .neural_features = neural_features_stage,
    .deep_capture = deep_capture_stage,
    .deep_resolve = deep_resolve_stage,
    .deep_transmittance = deep_transmittance_stage,
    .deep_features = deep_features_stage,
    .haar_sums = haar_sums_stage,
    .haar_cells = haar_cells_stage,
    .haar_transmittance = haar_transmittance_stage,
    .slice_codes = slice_codes_stage,
    .slice_shares = slice_shares_stage,
    .slice_depths = slice_depths_stage,
    .slice_absorbance = slice_absorbance_stage,
    .block_absorbance = block_absorbance_stage,
    .slice_blend = slice_blend_stage,
    .fine_codes = fine_codes_stage,
    .voxel_codes = voxel_codes_stage,
    .voxel_places = voxel_places_stage,
    .voxel_light = voxel_light_stage,
    .voxel_cubic_light = voxel_cubic_light_stage,
    .slice_join = slice_join_stage,
    .slice_marks = slice_marks_stage,
    .slice_fetch = slice_fetch_stage,
    .slice_sums = slice_sums_stage,
    .own_codes = own_codes_stage,
    .covered_extents = covered_extents_stage,
    .own_places = own_places_stage,
    .sums_around = sums_around_stage,
    .learnt_absorbance = learnt_absorbance_stage,
    .slice_features = slice_features_stage,
    .scaled_absorbance = scaled_absorbance_stage,
    .half_absorbance = half_absorbance_stage,
    .occluded = occluded_stage,
    .dimmest = dimmest_stage,
    .second_pass = second_pass_stage,
    .unorm16_moments = UNORM16_MOMENTS_STAGE,
    .nonlinear_moments = NONLINEAR_MOMENTS_STAGE,
    .blend_weights = blend_weights_stage,
    .depth_ranks = depth_ranks_stage,
    .ranked_transmittance = ranked_transmittance_stage,
    .arrival_transmittance = arrival_transmittance_stage,
    .covered_blend = covered_blend_stage,
    .arrival_blend = arrival_blend_stage,
    .ranked_blend = ranked_blend_stage,
    .products = products_stage,
    .weight_sums = weight_sums_stage,
    .products_and_sums = products_and_sums_stage,
    .averaged_coverage = AVERAGED_COVERAGE_STAGE,
    .spread = spread_stage,
    .spread_blend = spread_blend_stage,
    .revealage = revealage_stage,
    .accumulation = accumulation_stage,
    .fourier_sums = fourier_sums_stage,
    .fourier_transmittance = fourier_transmittance_stage,
    .function_sums = function_sums_stage,
    .function_transmittance = function_transmittance_stage,
    .fragment_keys = fragment_keys_stage,
    .coverage = coverage_stage,
    .nearest_covering = nearest_covering_stage,
    .shares_seen = shares_seen_stage,
    .anchor_keys = anchor_keys_stage,
    .anchors = anchors_stage,
    .anchor_transmittance = anchor_transmittance_stage,
    .anchors_in_front = anchors_in_front_stage,
    .words = words_stage,
    .fine_words = fine_words_stage,
    .mlab = mlab_stage,
    .adaptive = adaptive_stage,
    .steps = steps_stage,
    .kbuffer_ranks = kbuffer_ranks_stage,
    .foremost = foremost_stage,
    .tail = tail_stage,
    .blend = blend_stage,
    .upsampling = upsampling_stage,
    .over = over_stage,
    .cover = COVER_STAGE,
    .shade = SHADE_STAGE,
    .sample = SAMPLE_STAGE,
    .splat = SPLAT_STAGE,
    .stroke_points = STROKE_POINTS_STAGE,
    .stroke_met = STROKE_MET_STAGE,
    .stroke_away = STROKE_AWAY_STAGE,
};

#include "core/stages/lanes_end.h"
