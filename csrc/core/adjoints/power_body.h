/* Compiled once per table of power.h, as core/stages/body.h is. */
#include "core/adjoints/power.h"

#include "core/stages/lanes.h"

#define NAMED(name) JOIN(name, NODES)
#define TEXT "core/adjoints/power_of_count.h"
#include "core/stages/each_power_count.h"

static double sum_pulled(int count, int n, const double *rule, double b0, const double *z,
                         const double *own, double beta, const double *by, double *S, double *by_z,
                         double *by_own) {
    memset(S, 0, MOIT_MOST_TERMS * sizeof *S);
    switch (count) {
    case 2: return sum_pulled1(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    case 4: return sum_pulled2(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    case 6: return sum_pulled3(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    default: return sum_pulled4(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    }
}

static void read_polynomial(int count, int n, const double *rule, const double *S, const double *z,
                            double *value, double *slope) {
    switch (count) {
    case 2: read_polynomial1(n, rule, S, z, value, slope); break;
    case 4: read_polynomial2(n, rule, S, z, value, slope); break;
    case 6: read_polynomial3(n, rule, S, z, value, slope); break;
    default: read_polynomial4(n, rule, S, z, value, slope);
    }
}

const moit_power_adjoints TABLE = {.sum_pulled = sum_pulled, .read_polynomial = read_polynomial};

#include "core/stages/lanes_end.h"
