#include "core/parts.h"
#include "core/elementary.h"
#include "core/tile.h"

#include <float.h>
#include <math.h>
#include <string.h>

double moit_opacity_of(const moit_fragments *f, int64_t i, int k) {
    double alpha = moit_number(f->precision, f->alpha, i);
    if (k == 0 || !f->transmission) return alpha;
    return alpha * (1.0 - moit_number(f->precision, f->transmission, 3 * i + k - 1));
}

bool moit_is_opaque(const moit_fragments *f, int64_t i) {
    bool opaque = moit_number(f->precision, f->alpha, i) == 1.0;
    for (int c = 0; f->transmission && c < 3; ++c)
        opaque &= moit_number(f->precision, f->transmission, 3 * i + c) == 0.0;
    return opaque;
}

static void copy(const moit_fragments *f, void *to, int64_t at, const void *from, int64_t i,
                 int width) {
    size_t bytes = (size_t)width * moit_scalar_size(f->precision);
    if (to) memcpy((char *)to + (size_t)at * bytes, (const char *)from + (size_t)i * bytes, bytes);
}

void moit_copy_fragment(const moit_fragments *f, int64_t i, const moit_pieces *out, int64_t at) {
    copy(f, out->depth, at, f->depth, i, 1);
    copy(f, out->back, at, f->back ? f->back : f->depth, i, 1);
    copy(f, out->alpha, at, f->alpha, i, 1);
    copy(f, out->color, at, f->color, i, 3);
    copy(f, out->transmission, at, f->transmission, i, 3);
    copy(f, out->emission, at, f->emission, i, 3);
}

/* What a share of a medium hides. */
static double part_of(double alpha, double share) {
    return alpha == 1.0 ? 1.0 : -moit_expm1(share * moit_log1p(-alpha));
}

/* How much of its light a part has that hides so much, that of an alpha of 0 too. */
static double light_of_part(double alpha, double part, double share) {
    return alpha > 0.0 ? part / alpha : share;
}

void moit_put_part(const moit_fragments *f, int64_t i, double share, const moit_pieces *out,
                   int64_t at) {
    moit_precision precision = f->precision;
    double alpha = moit_number(precision, f->alpha, i), part = part_of(alpha, share);
    moit_copy_fragment(f, i, out, at);
    moit_put_number(precision, out->alpha, at, part);
    for (int c = 0; c < 3 && (out->emission || f->transmission); ++c) {
        double own = moit_opacity_of(f, i, c + 1);
        double own_part = f->transmission ? part_of(own, share) : part;
        double light = light_of_part(own, own_part, share);
        if (out->emission)
            moit_put_number(precision, out->emission, 3 * at + c,
                            moit_number(precision, f->emission, 3 * i + c) * light);
        if (!f->transmission || part == 0.0) continue;
        moit_put_number(precision, out->transmission, 3 * at + c, fmax(0.0, 1.0 - own_part / part));
        if (out->color)
            moit_put_number(precision, out->color, 3 * at + c,
                            moit_number(precision, f->color, 3 * i + c) * (alpha * light / part));
    }
}
