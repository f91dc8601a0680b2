/* Prints a digest of every answer, one a line: where two machines or compilers print the same,
 * their answers are the same bits (tests/aarch64.py, tests/test_c_core.py). */
#include "asked.h"

enum { PIXELS = 700 };

/* FNV-1a, by bytes as they lie in memory. */
static uint64_t digest_of(const void *bytes, size_t count) {
    const unsigned char *p = bytes;
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < count; ++i) hash = (hash ^ p[i]) * 0x100000001b3u;
    return hash;
}

int main(int argc, char **argv) {
    static const char *const questions[ANSWERS] = {
        "composite",   "transmittance", "lower", "upper",   "total",       "curve",
        "lower curve", "upper curve",   "b0",    "moments", "read moments"};
    moit_run run = plain_run();
    if (argc == 2 && !strcmp(argv[1], "base")) run.isa = MOIT_ISA_BASE;
    FOR_BOTH_PRECISIONS(precision) {
        rays r = random_rays(precision, (kind_of_rays){PIXELS, 12, 0.5, 9.0, 0.9, 0.02, 7});
        moit_technique list[MOST_TECHNIQUES];
        int n = all_techniques(precision, list);
        for (int k = 0; k < n; ++k) {
            answer found[ANSWERS];
            ask(&r, &list[k], &run, found);
            for (int i = 0; i < ANSWERS; ++i)
                if (found[i].bytes)
                    printf("%d %s %d %s %016llx\n", k, moit_kind_name(list[k].kind),
                           (int)(8 * size_of(precision)), questions[i],
                           (unsigned long long)digest_of(found[i].array, found[i].bytes));
            forget(found);
        }
        free_rays(&r);
    }
    return verdict();
}
