/* FLIP at one exposure. Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, "FLIP:
 * A Difference Evaluator for Alternating Images", 2020.
 *
 * Two passes over rows: display, opponent space and all filters along a row; then all filters
 * across rows and the comparison. Every filter separates: the blue-yellow one is a sum of two
 * Gaussians, the features are derivatives of one. */
#include "core/metrics/flip.h"
#include "core/threads.h"

#include <stdlib.h>
#include <string.h>

/* What is kept of a row of one image after filtering along it. */
enum { LUMINANCE, RED_GREEN, BLUE_YELLOW_NARROW, BLUE_YELLOW_WIDE, SMOOTH, EDGE, POINT, PLANES };

static int64_t padded_width(const flip_comparison *flip) {
    return flip->stride + 2 * FLIP_MOST_REACH;
}

/* A worker's scratch: three rows of doubles and three padded ones of floats while filtering along
 * rows, 2 FLIP_ROWS of floats after. A whole number of doubles either way. */
static size_t scratch_bytes(const flip_comparison *flip) {
    const size_t stride = (size_t)flip->stride, padded = (size_t)padded_width(flip);
    size_t along = 3 * (sizeof(double) * stride + sizeof(float) * padded);
    size_t across = 2 * FLIP_ROWS * sizeof(float) * stride;
    return along > across ? along : across;
}

static void end(flip_comparison *flip) {
    free(flip->planes);
    free(flip->scratch);
    free(flip->map);
}

/* false, and nothing to end, where memory is short. The map begins without errors. */
static bool begin(flip_comparison *flip, const moit_image *image, const moit_image *reference,
                  const moit_run *run) {
    *flip = (flip_comparison){
        .images = {image, reference},
        .lines = moit_flip_lines_of(run->isa),
        .stride = (image->width + FLIP_LANES - 1) / FLIP_LANES * FLIP_LANES,
    };
    moit_flip_prepare(flip);
    const size_t height = (size_t)image->height;
    const size_t workers = (size_t)moit_most_workers(run, 2 * image->height);
    flip->planes = malloc(2 * PLANES * height * (size_t)flip->stride * sizeof(float));
    flip->scratch = malloc(workers * scratch_bytes(flip));
    flip->map = calloc(height * (size_t)image->width, sizeof(float));
    if (flip->planes && flip->scratch && flip->map) return true;
    end(flip);
    return false;
}

static float *plane_row(const flip_comparison *flip, int image, int plane, int64_t y) {
    int64_t row = (y * 2 + image) * PLANES + plane;
    return flip->planes + row * flip->stride;
}

static void *scratch_of(const flip_comparison *flip, int thread) {
    return (char *)flip->scratch + scratch_bytes(flip) * (size_t)thread;
}

/* The neighbours of a padded row: itself, shifted. */
static void shifted_lines(const float *row, const float *lines[2 * FLIP_MOST_REACH + 1]) {
    for (int k = -FLIP_MOST_REACH; k <= FLIP_MOST_REACH; ++k) lines[FLIP_MOST_REACH + k] = row + k;
}

/* Row y of an image on its display, in opponent space; the row's ends repeat outside. */
static void opponent_row(const flip_comparison *flip, int image, int64_t y, double *rgb,
                         float *opponent[3]) {
    const int64_t width = flip->images[0]->width, stride = flip->stride;
    for (int channel = 0; channel < 3; ++channel) {
        double *row = rgb + channel * stride;
        moit_image_row(flip->images[image], y, channel, row);
        flip->display.apply(flip->display.exposure, row, width);
    }
    for (int i = 0; i < 3; ++i) {
        const float *m = flip->to_opponent[i];
        const double *r = rgb, *g = r + stride, *b = g + stride;
        float *row = opponent[i];
        for (int64_t x = 0; x < width; ++x)
            row[x] = m[0] * (float)r[x] + m[1] * (float)g[x] + m[2] * (float)b[x];
        for (int64_t x = -FLIP_MOST_REACH; x < 0; ++x) row[x] = row[0];
        for (int64_t x = width; x < stride + FLIP_MOST_REACH; ++x) row[x] = row[width - 1];
    }
}

static moit_status filter_along(void *context, int64_t item, int thread) {
    const flip_comparison *flip = context;
    const int64_t y = item / 2;
    const int image = (int)(item % 2);
    double *rgb = scratch_of(flip, thread);
    float *padded = (float *)(rgb + 3 * flip->stride) + FLIP_MOST_REACH;
    float *opponent[3] = {padded, padded + padded_width(flip), padded + 2 * padded_width(flip)};
    opponent_row(flip, image, y, rgb, opponent);

    const struct {
        const flip_filter *filter;
        int from, to;
    } steps[] = {
        {&flip->luminance, 0, LUMINANCE},
        {&flip->red_green, 1, RED_GREEN},
        {&flip->blue_yellow[0], 2, BLUE_YELLOW_NARROW},
        {&flip->blue_yellow[1], 2, BLUE_YELLOW_WIDE},
        {&flip->smooth, 0, SMOOTH},
        {&flip->edge, 0, EDGE},
        {&flip->point, 0, POINT},
    };
    for (int i = 0; i < PLANES; ++i) {
        const float *lines[2 * FLIP_MOST_REACH + 1];
        shifted_lines(opponent[steps[i].from], lines);
        float *out = plane_row(flip, image, steps[i].to, y);
        memset(out, 0, sizeof(float) * (size_t)flip->stride);
        flip->lines->add_filtered(steps[i].filter, lines, out, flip->stride);
    }
    return MOIT_OK;
}

static void filter_across(const flip_comparison *flip, int image, int64_t y, float *out) {
    const int64_t stride = flip->stride, height = flip->images[0]->height;
    const struct {
        const flip_filter *filter;
        int from, to;
    } steps[] = {
        {&flip->luminance, LUMINANCE, FLIP_Y},
        {&flip->red_green, RED_GREEN, FLIP_RED_GREEN},
        {&flip->blue_yellow[0], BLUE_YELLOW_NARROW, FLIP_BLUE_YELLOW},
        {&flip->blue_yellow[1], BLUE_YELLOW_WIDE, FLIP_BLUE_YELLOW},
        {&flip->smooth, EDGE, FLIP_EDGE_X},
        {&flip->edge, SMOOTH, FLIP_EDGE_Y},
        {&flip->smooth, POINT, FLIP_POINT_X},
        {&flip->point, SMOOTH, FLIP_POINT_Y},
    };
    memset(out, 0, FLIP_ROWS * sizeof(float) * (size_t)stride);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; ++i) {
        const float *lines[2 * FLIP_MOST_REACH + 1];
        for (int64_t k = -FLIP_MOST_REACH; k <= FLIP_MOST_REACH; ++k) {
            int64_t inside = y + k < 0 ? 0 : y + k >= height ? height - 1 : y + k;
            lines[FLIP_MOST_REACH + k] = plane_row(flip, image, steps[i].from, inside);
        }
        flip->lines->add_filtered(steps[i].filter, lines, out + steps[i].to * stride, stride);
    }
}

static moit_status compare_across(void *context, int64_t y, int thread) {
    const flip_comparison *flip = context;
    const int64_t stride = flip->stride, width = flip->images[0]->width;
    float *filtered[2] = {scratch_of(flip, thread)};
    filtered[1] = filtered[0] + FLIP_ROWS * stride;
    for (int image = 0; image < 2; ++image) filter_across(flip, image, y, filtered[image]);
    /* The errors may take the place of what they are made of. */
    float *errors = filtered[0], *map = flip->map + y * width;
    flip->lines->errors(flip->from_opponent, filtered[0], filtered[1], errors, stride);
    for (int64_t x = 0; x < width; ++x) map[x] = errors[x] > map[x] ? errors[x] : map[x];
    return MOIT_OK;
}

moit_status moit_flip_see(flip_comparison *flip, flip_display display, const moit_run *run) {
    flip->display = display;
    moit_status status = moit_parallel_for(run, 2 * flip->images[0]->height, filter_along, flip);
    if (status != MOIT_OK) return status;
    return moit_parallel_for(run, flip->images[0]->height, compare_across, flip);
}

static double store_and_average(const flip_comparison *flip, void *map) {
    const moit_image *image = flip->images[0];
    double total = 0.0, *row = (double *)flip->scratch;
    for (int64_t y = 0; y < image->height; ++y) {
        double sum = 0.0;
        for (int64_t x = 0; x < image->width; ++x) {
            row[x] = (double)flip->map[y * image->width + x];
            sum += row[x];
        }
        moit_store_map_row(map, image, y, row);
        total += sum;
    }
    return total / (double)(image->height * image->width);
}

moit_status moit_flip_pool(const moit_image *image, const moit_image *reference, void *map,
                           double *error,
                           moit_status (*see)(flip_comparison *flip, const moit_run *run),
                           const moit_run *run) {
    moit_assert_comparable(image, reference);
    flip_comparison flip;
    if (!begin(&flip, image, reference, run)) return MOIT_NO_MEMORY;
    moit_status status = see(&flip, run);
    if (status == MOIT_OK) *error = store_and_average(&flip, map);
    end(&flip);
    return status;
}

/* The display's sRGB encoding, and the decoding that FLIP starts with, undo each other. */
static void clip(double exposure, double *row, int64_t width) {
    (void)exposure;
    for (int64_t x = 0; x < width; ++x) {
        double bright = row[x] > 0.0 ? row[x] : 0.0;
        row[x] = bright < 1.0 ? bright : 1.0;
    }
}

static moit_status see_once(flip_comparison *flip, const moit_run *run) {
    return moit_flip_see(flip, (flip_display){.apply = clip}, run);
}

moit_status moit_flip(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    return moit_flip_pool(image, reference, map, error, see_once, run);
}
