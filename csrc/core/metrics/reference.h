/* What is kept of a reference between the images that are held against it. */
#ifndef MOIT_METRICS_REFERENCE_H
#define MOIT_METRICS_REFERENCE_H

#include "core/metrics/flip.h"
#include "core/metrics/ssim.h"

/* How FLIP sees a reference at one exposure: a pointer for each block, NULL where nobody asked. */
typedef flip_seen **flip_view;

struct moit_reference {
    moit_image image;
    _Atomic int64_t bytes_left; /* that may still be kept */
    ssim_seen **ssim;           /* of each block; NULL: nothing is kept */
    flip_view flip;
    flip_range range; /* of HDR-FLIP's exposures, once it is known */
    bool has_range;
    flip_view hdr; /* (exposures, blocks) */
};

/* Zeros to keep, or NULL: the caller then works in a place of its own. */
void *moit_kept(moit_reference *reference, int64_t count, size_t size);

#endif
