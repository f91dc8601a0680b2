/* Parts of thick fragments, as fragments. */
#ifndef MOIT_PARTS_H
#define MOIT_PARTS_H

#include "moit.h"

/* Of all channels together (k is 0) or of one of them (1 to 3). */
double moit_opacity_of(const moit_fragments *fragments, int64_t i, int k);

/* Whether nothing of any channel gets through. */
bool moit_is_opaque(const moit_fragments *fragments, int64_t i);

/* Fragment i as piece `at`, bit for bit. */
void moit_copy_fragment(const moit_fragments *fragments, int64_t i, const moit_pieces *out,
                        int64_t at);

/* The same, but for depth and back, of a share of its absorbance. Its colour is what it was, unless
 * channels fade differently. */
void moit_put_part(const moit_fragments *fragments, int64_t i, double share, const moit_pieces *out,
                   int64_t at);

#endif
