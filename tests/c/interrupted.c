/* A call asks now and then, from its own thread, whether to stop; and does. */
#include <pthread.h>

#include "expect.h"

typedef struct {
    int asked, patience; /* how often "no" is said */
    pthread_t caller;
} listener;

static bool wants_to_stop(void *context) {
    listener *l = context;
    EXPECT(pthread_equal(pthread_self(), l->caller));
    return ++l->asked > l->patience;
}

/* A curve that takes seconds if nobody stops it: each depth looks at each fragment. One answer
 * takes far less, so that there are many occasions to ask. */
enum { PIXELS = 65536, FRAGMENTS = 60, DEPTHS = 200 };

static void a_call_stops_when_told_to(int threads, int patience) {
    int64_t *counts = room(PIXELS, sizeof *counts);
    for (int p = 0; p < PIXELS; ++p) counts[p] = FRAGMENTS;
    rays r = empty_rays(MOIT_FLOAT32, PIXELS, counts);
    free(counts);
    double depth[DEPTHS];
    for (int k = 0; k < DEPTHS; ++k) depth[k] = k;
    float *curve = room((int64_t)PIXELS * DEPTHS, sizeof *curve);
    moit_technique sorted = simple(MOIT_SORTED);
    listener l = {.patience = patience, .caller = pthread_self()};
    moit_run run = {
        .threads = threads, .isa = moit_isa_best(), .interrupted = wants_to_stop, .context = &l};
    EXPECT(moit_curve(&r.f, &sorted, true, DEPTHS, depth, curve, &run) == MOIT_INTERRUPTED);
    EXPECT(l.asked == patience + 1); /* not again once the answer was yes */
    free(curve);
    free_rays(&r);
}

static void a_call_that_is_left_alone_ends_well(void) {
    rays r = random_rays(MOIT_FLOAT64, (kind_of_rays){5000, 4, 1.0, 2.0, 0.5, 0.0, 9});
    double *total = room(r.f.pixels, sizeof *total);
    moit_technique power4 = power(4, MOIT_FLOAT64);
    listener l = {.patience = 1 << 30, .caller = pthread_self()};
    moit_run run = {.threads = 2, .interrupted = wants_to_stop, .context = &l};
    EXPECT(moit_total_transmittance(&r.f, &power4, true, total, &run) == MOIT_OK);
    free(total);
    free_rays(&r);
}

int main(void) {
    a_call_stops_when_told_to(1, 0);
    a_call_stops_when_told_to(3, 1);
    a_call_that_is_left_alone_ends_well();
    return verdict();
}
