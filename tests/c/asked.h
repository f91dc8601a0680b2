/* All questions about rays by one technique, for programs that compare answers by their bits. */
#ifndef ASKED_H
#define ASKED_H

#include "expect.h"

enum { DEPTHS = 5, ANSWERS = 11 };
static const double depth[DEPTHS] = {0.5, 1.0, 2.0, 4.0, 9.0};

typedef struct {
    void *array;
    size_t bytes;
} answer;

HELPER void *answer_room(answer *a, int64_t count, moit_precision precision) {
    *a = (answer){room(count, size_of(precision)), (size_t)count * size_of(precision)};
    return a->array;
}

/* All questions about `r` by one technique; unasked ones stay empty. */
HELPER void ask(const rays *r, const moit_technique *t, const moit_run *run, answer a[ANSWERS]) {
    moit_precision precision = r->f.precision;
    int64_t pixels = r->f.pixels;
    const double background[3] = {0.1, 0.2, 0.3};
    bool all_ok = true;
    memset(a, 0, ANSWERS * sizeof *a);
#define ROOM(i, count) answer_room(&a[i], count, precision)
#define ASK(question) all_ok &= (question) == MOIT_OK
    ASK(moit_composite(&r->f, t, true, background, false, ROOM(0, 4 * pixels), run));
    ASK(moit_transmittance(&r->f, t, true, ROOM(1, r->count), run));
    ASK(moit_bounds(&r->f, t, true, ROOM(2, r->count), ROOM(3, r->count), run));
    ASK(moit_total_transmittance(&r->f, t, true, ROOM(4, pixels), run));
    if (moit_facts_of(t->kind).has_curve) {
        int64_t points = pixels * DEPTHS;
        ASK(moit_curve(&r->f, t, true, DEPTHS, depth, ROOM(5, points), run));
        ASK(moit_curve_bounds(&r->f, t, true, DEPTHS, depth, ROOM(6, points), ROOM(7, points),
                              run));
    }
    if (t->kind == MOIT_POWER_MOMENTS) {
        int64_t rows = pixels / 5; /* of five depths, as the curve before */
        const void *b0 = ROOM(8, pixels), *b = ROOM(9, (int64_t)pixels * t->count);
        ASK(moit_gather(&r->f, t, true, a[8].array, a[9].array, run));
        ASK(moit_moments_transmittance(t, precision, rows, DEPTHS, b0, b, a[5].array,
                                       ROOM(10, rows * DEPTHS), run));
    }
#undef ROOM
#undef ASK
    EXPECT(all_ok);
}

HELPER void forget(answer a[ANSWERS]) {
    for (int i = 0; i < ANSWERS; ++i) free(a[i].array);
}

HELPER bool same(const answer a[ANSWERS], const answer b[ANSWERS]) {
    for (int i = 0; i < ANSWERS; ++i)
        if (a[i].bytes != b[i].bytes || (a[i].bytes && memcmp(a[i].array, b[i].array, a[i].bytes)))
            return false;
    return true;
}

#endif
