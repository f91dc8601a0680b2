/* Stages of pictures whose draws have resolutions of their own. Lanes are pixels. */

#include "kernels/upsampling.h"

static void upsampling_stage(bool depth_aware, int n, const void *across_, const void *along_,
                             const void *depth_, const void *const corner[4],
                             void *const share[4]) {
    const SCALAR *across = across_, *along = along_, *depth = depth_;
    for (int i = 0; i < n; i += LANES) {
        four_shares s = bilinear_shares(load(across + i), load(along + i));
        if (depth_aware) {
            real other[4];
            for (int k = 0; k < 4; ++k) other[k] = load((const SCALAR *)corner[k] + i);
            s = depth_aware_shares(s, load(depth + i), other[0], other[1], other[2], other[3]);
        }
        store((SCALAR *)share[0] + i, s.upper_left);
        store((SCALAR *)share[1] + i, s.upper_right);
        store((SCALAR *)share[2] + i, s.lower_left);
        store((SCALAR *)share[3] + i, s.lower_right);
    }
}
