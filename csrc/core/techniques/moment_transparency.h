/* Moment Transparency: what its tiles and its blocks of pixels share. */
#ifndef MOIT_MOMENT_TRANSPARENCY_H
#define MOIT_MOMENT_TRANSPARENCY_H

#include "core/techniques/moments.h"

/* How stored moments are read. */
typedef struct moit_mt_reader {
    const moit_stages *stages, *precise;
    moit_precision precision;
    const moit_technique *technique;
    double bias;
} moit_mt_reader;

/* Totals and moments (pixels, 4), in place what the technique's storage keeps of them; nodes are
 * taken, and rounded, with the rules. */
void moit_mt_hold(const moit_mt_reader *reader, int pixels, void *b0, void *b);
/* The rules of moments (pixels, 4); double_b (pixels, 4). */
void moit_mt_read(const moit_mt_reader *reader, int pixels, const void *b, double *double_b,
                  double *rules);

/* Totals (pixels) and moments (pixels, 4) of one pass as the storage keeps them, once they are
 * read. */
typedef struct moit_mt_kept {
    const void *b0, *b;
} moit_mt_kept;

moit_mt_kept moit_mt_kept_of(const moit_job *job, const moit_tile *tile, int pass);

#endif
