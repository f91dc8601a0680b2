/* Fragments from outside: faults are found, orders are orders, volumes are split. */
#include "expect.h"

static moit_fault fault_of(const rays *r) { return moit_check_fragments(&r->f, r->count); }

static void expect_fault(const rays *r, moit_array array, int64_t index) {
    moit_fault fault = fault_of(r);
    EXPECT(fault.array == array);
    if (array != MOIT_NO_ARRAY) EXPECT(fault.index == index);
}

static void faults_are_found(moit_precision precision) {
    rays r = random_rays(precision, (kind_of_rays){5000, 6, 1.0, 9.0, 0.9, 0.1, 1});
    expect_fault(&r, MOIT_NO_ARRAY, 0);
    const struct {
        moit_array array;
        void *numbers;
        int64_t index; /* beyond the first block that is looked at */
        double wrong;
    } cases[] = {
        {MOIT_DEPTH, r.depth, 4321, NOT_A_NUMBER},
        {MOIT_DEPTH, r.depth, 0, INFINITE},
        {MOIT_DEPTH, r.depth, 7777, 0.5},
        {MOIT_DEPTH, r.depth, r.count - 1, 9.5},
        {MOIT_ALPHA, r.alpha, 4321, 1.001},
        {MOIT_ALPHA, r.alpha, r.count - 1, -0.001},
        {MOIT_ALPHA, r.alpha, 1, NOT_A_NUMBER},
        {MOIT_COLOR, r.color, 3 * r.count - 1, NOT_A_NUMBER},
        {MOIT_COLOR, r.color, 2, -INFINITE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        double right = number(precision, cases[i].numbers, cases[i].index);
        set_number(precision, cases[i].numbers, cases[i].index, cases[i].wrong);
        expect_fault(&r, cases[i].array, cases[i].index);
        set_number(precision, cases[i].numbers, cases[i].index, right);
    }

    r.f.transmission = r.color; /* blue reaches 2 */
    EXPECT(fault_of(&r).array == MOIT_TRANSMISSION);
    r.f.transmission = NULL;
    r.f.color = NULL; /* absent, not wrong */
    expect_fault(&r, MOIT_NO_ARRAY, 0);

    r.offsets[0] = 1;
    expect_fault(&r, MOIT_OFFSETS, 0);
    r.offsets[0] = 0;
    int64_t end = r.offsets[4000];
    r.offsets[4000] = r.offsets[3999] - 1;
    expect_fault(&r, MOIT_OFFSETS, 4000);
    r.offsets[4000] = end;
    r.offsets[5000] += (int64_t)1 << 40;
    expect_fault(&r, MOIT_OFFSETS, 5000);
    free_rays(&r);
}

/* Few fragments are ordered another way than many. */
static void depth_order_is_stable(moit_precision precision, int most) {
    rays r = random_rays(precision, (kind_of_rays){300, most, 0.0, 1.0, 1.0, 0.0, 2});
    for (int64_t i = 0; i < r.count; ++i) /* many ties */
        set_number(precision, r.depth, i, floor(8.0 * number(precision, r.depth, i)));
    int64_t *order = room(r.count, sizeof *order);
    bool *seen = room(r.count, sizeof *seen);
    moit_run run = plain_run();
    run.threads = 2;
    EXPECT(moit_depth_order(&r.f, order, &run) == MOIT_OK);
    for (int64_t p = 0; p < r.f.pixels; ++p)
        for (int64_t k = r.offsets[p]; k < r.offsets[p + 1]; ++k) {
            EXPECT(order[k] >= r.offsets[p] && order[k] < r.offsets[p + 1] && !seen[order[k]]);
            seen[order[k]] = true;
            if (k == r.offsets[p]) continue;
            double before = number(precision, r.depth, order[k - 1]);
            double here = number(precision, r.depth, order[k]);
            EXPECT(before < here || (before == here && order[k - 1] < order[k]));
        }
    free(order);
    free(seen);
    free_rays(&r);
}

static void groups_keep_arrival_order(void) {
    const int64_t pixel[] = {2, 0, 2, 3, 0, 2};
    int64_t offsets[5], order[6];
    EXPECT(moit_group_by_pixel(pixel, 6, 4, offsets, order) == 6);
    EXPECT(!memcmp(offsets, (int64_t[]){0, 2, 2, 5, 6}, sizeof offsets));
    EXPECT(!memcmp(order, (int64_t[]){1, 4, 0, 2, 5, 3}, sizeof order));
    EXPECT(moit_group_by_pixel(pixel, 6, 3, offsets, order) == 3); /* pixel 3 is none of 3 */
    EXPECT(moit_group_by_pixel(pixel, 0, 4, offsets, order) == 0);
    EXPECT(!memcmp(offsets, (int64_t[5]){0}, sizeof offsets));
}

/* Two volumes over [0, 2) and [1, 3), each of opacity 3/4, so that half of one hides half; and a
 * pixel of surfaces, which stay as they are unless they are to be tidy. */
static void volumes_are_split_where_they_overlap(void) {
    const int64_t offsets[] = {0, 2, 4};
    const float front[] = {0, 1, 5, 4}, back[] = {2, 3, 5, 4}, alpha[] = {.75f, .75f, .5f, .25f};
    const float color[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
    const moit_fragments f = {.precision = MOIT_FLOAT32,
                              .pixels = 2,
                              .offsets = offsets,
                              .depth = front,
                              .alpha = alpha,
                              .color = color,
                              .back = back,
                              .near = 0,
                              .far = 5};
    moit_run run = plain_run();
    for (int tidy = 0; tidy < 2; ++tidy) {
        const moit_splitting how = {.tidy = tidy};
        int64_t made[3], first[4];
        bool changes;
        EXPECT(moit_piece_offsets(&f, &how, made, &changes, &run) == MOIT_OK && changes);
        EXPECT(!memcmp(made, (int64_t[]){0, 3, 5}, sizeof made));
        float depth_out[5], back_out[5], alpha_out[5], color_out[15];
        const moit_pieces out = {.depth = depth_out,
                                 .back = back_out,
                                 .alpha = alpha_out,
                                 .color = color_out,
                                 .first = first};
        EXPECT(moit_split_volumes(&f, &how, made, &out, &run) == MOIT_OK);
        const double depths[] = {0, 1, 2, 5, 4}, backs[] = {1, 2, 3, 5, 4};
        const double alphas[] = {.5, .75, .5, .5, .25};
        const double colors[] = {1, 0, 0, .5, .5, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
        for (int i = 0; i < 5; ++i) {
            int k = tidy && i > 2 ? 7 - i : i; /* the surfaces change places */
            EXPECT((double)depth_out[i] == depths[k] && (double)back_out[i] == backs[k]);
            EXPECT_NEAR((double)alpha_out[i], alphas[k], 2e-7); /* one rounding, a logarithm's */
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR((double)color_out[3 * i + c], colors[3 * k + c], 2e-7);
        }
        const int64_t firsts[] = {0, 1, tidy ? 4 : 3, tidy ? 3 : 4};
        EXPECT(!memcmp(first, firsts, sizeof first));
    }
}

int main(void) {
    FOR_BOTH_PRECISIONS(precision) {
        faults_are_found(precision);
        depth_order_is_stable(precision, 20);
        depth_order_is_stable(precision, 200);
    }
    groups_keep_arrival_order();
    volumes_are_split_where_they_overlap();
    return verdict();
}
