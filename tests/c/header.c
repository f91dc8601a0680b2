/* The public headers alone are C11 without extensions: compiled with -std=c11 -pedantic-errors. */
#include "moit.h"
#include "moit_deep.h"
#include "moit_errors.h"
#include "moit_geometry.h"
#include "moit_gl.h"
#include "moit_gradients.h"

moit_status header_is_enough(const moit_fragments *fragments, double *total);

moit_status header_is_enough(const moit_fragments *fragments, double *total) {
    moit_technique technique = {.kind = MOIT_SORTED};
    moit_run run = {.threads = 1, .isa = moit_isa_best()};
    return moit_total_transmittance(fragments, &technique, true, total, &run);
}
