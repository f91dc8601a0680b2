/* Aligned pieces of one memory, handed out one after the other. */
#ifndef MOIT_PIECES_H
#define MOIT_PIECES_H

#include <stddef.h>
#include <stdint.h>

#include "core/system.h"

typedef struct {
    char *memory; /* NULL: they are only counted */
    size_t used;
} pieces;

static inline void *piece(pieces *p, int64_t count, size_t size) {
    size_t bytes = moit_aligned_size((size_t)count * size);
    void *start = p->memory ? p->memory + p->used : NULL;
    p->used += bytes;
    return start;
}

#endif
