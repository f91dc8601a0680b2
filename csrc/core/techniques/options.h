/* What options a row says that its kind must have; whatever is not there the kind must not have. */
#ifndef MOIT_OPTIONS_H
#define MOIT_OPTIONS_H

#include <limits.h>
#include <stddef.h>

#include "moit.h"

#define OPTIONS(...) \
    .options = (const moit_option[]) { \
        __VA_ARGS__, { .name = NULL } \
    }

/* Of whole numbers the bounds guard tables that are indexed by these; what makes sense the surface
 * has checked. */
#define WHOLE(name, member, least, most) \
    { name, MOIT_WHOLE, offsetof(moit_technique, member), least, most }
#define NUMBER(name, member) \
    { name, MOIT_NUMBER, offsetof(moit_technique, member), 0, 0 }
#define TRUTH(name, member) \
    { name, MOIT_TRUTH, offsetof(moit_technique, member), 0, 0 }
/* Needed where moit_network_weights says so, which may hang on other options. */
#define NETWORK(member) \
    { "network", MOIT_NETWORK, offsetof(moit_technique, member), 0, 0 }

#define COUNT WHOLE("count", count, 0, INT_MAX)
#define NORMALIZE TRUTH("normalize", normalize)
#define WARP WHOLE("warp", warp, MOIT_WARP_LOG, MOIT_WARP_NONE)
#define MAX_ALPHA NUMBER("max_alpha", max_alpha)
/* Of what works on warped depth, the image's or each pixel's, and scales colours. */
#define WARPED WARP, TRUTH("range_per_pixel", range_per_pixel), MAX_ALPHA, NORMALIZE
/* Of pixels, with states; `most` a side. */
#define RESOLUTION(most) WHOLE("resolution", resolution, 1, most)
#define TOTALS_OF_BLOCKS TRUTH("full_total", full_total), TRUTH("depth_aware", depth_aware)
#define BLOCKS RESOLUTION(INT_MAX), TOTALS_OF_BLOCKS

#define BIAS NUMBER("bias", moments.bias)
#define READ_MOMENTS \
    BIAS, NUMBER("overestimation", moments.overestimation), \
        TRUTH("exclude_self", moments.exclude_self)
/* Of moments: 16 for words. */
#define MOMENT_BITS(least) WHOLE("bits", moments.bits, least, 32)
#define STORED_MOMENTS \
    COUNT, WARPED, BLOCKS, READ_MOMENTS, MOMENT_BITS(16), TRUTH("b0_is_half", moments.b0_is_half)
#define HALVES TRUTH("halves", moments.halves)
#define WRAPPING_ZONE NUMBER("wrapping_zone", moments.wrapping_zone)

#define SLICES \
    COUNT, WARPED, RESOLUTION(1024), WHOLE("bits", slices.bits, 2, 16), \
        WHOLE("cells", slices.cells, 64, 8192)

#define SERIES \
    COUNT, WARPED, BLOCKS, WHOLE("bits", series.bits, 16, 32), \
        TRUTH("exclude_self", series.exclude_self)

#endif
