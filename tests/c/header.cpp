// The public headers alone are C++ as well, with C's names for the linker.
#include "moit.h"
#include "moit_deep.h"
#include "moit_errors.h"
#include "moit_geometry.h"
#include "moit_gl.h"
#include "moit_gradients.h"

moit_status header_is_enough(const moit_fragments &fragments, double *total);

moit_status header_is_enough(const moit_fragments &fragments, double *total) {
    moit_technique technique = {};
    technique.kind = MOIT_SORTED;
    moit_run run = {};
    run.threads = 1;
    run.isa = moit_isa_best();
    return moit_total_transmittance(&fragments, &technique, true, total, &run);
}
