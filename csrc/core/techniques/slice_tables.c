/* Where slices stand: only where anything is, as an image, a square of pixels or a pixel has it. */
#include "core/techniques/slices.h"

/* What is marked, from the least cell on, as so many joined cells have it. */
typedef struct {
    const uint64_t *words;
    int count, shift; /* of joined cells; cells are 1 << shift */
} marked;

/* The next marked cell from `cell` on, or `cells`. */
static int next_marked(const uint64_t *words, int cells, int cell) {
    while (cell < cells) {
        uint64_t left = words[cell / 64] >> cell % 64;
        if (left) return cell + __builtin_ctzll(left);
        cell = (cell / 64 + 1) * 64;
    }
    return cells;
}

static int log2_of(int cells) {
    int shift = 0;
    while (1 << shift < cells) ++shift;
    return shift;
}

/* Which of `count` joined cells a cell is in, and the first cell that is the k-th's. */
static int joined_of(const marked *m, int cell) {
    return (int)(((int64_t)cell * m->count) >> m->shift);
}

static int first_of(const marked *m, int k) {
    return (int)((((int64_t)k << m->shift) + m->count - 1) / m->count);
}

/* How many slices stand at the borders of joined cells with anything; it need not count beyond
 * `most`. */
static int slices_of(const marked *m, int most) {
    int used = 0, before = -2, cells = 1 << m->shift;
    for (int cell = 0; used <= most;) {
        cell = next_marked(m->words, cells, cell);
        if (cell == cells) break;
        int k = joined_of(m, cell);
        used += k == before + 1 ? 1 : 2;
        before = k;
        cell = first_of(m, k + 1);
    }
    return used;
}

static void fill(const marked *m, moit_slice_entry *table) {
    int cells = 1 << m->shift, slot = 0, done = 0, before = -2;
    for (int cell = 0; cell < cells;) {
        cell = next_marked(m->words, cells, cell);
        int k = cell < cells ? joined_of(m, cell) : m->count, first = first_of(m, k);
        if (before >= 0 && k != before + 1) ++slot; /* past the slice at a run's back */
        for (; done < first; ++done)
            table[done] = (moit_slice_entry){(uint16_t)(2 * slot), 0, 1.0F};
        if (cell == cells) break;
        int end = first_of(m, k + 1);
        for (float share = 1.0F / (float)(end - first); done < end; ++done)
            table[done] =
                (moit_slice_entry){(uint16_t)(2 * slot + 1), (uint16_t)(done - first), share};
        ++slot;
        before = k;
        cell = end;
    }
}

void moit_slice_table(int cells, int slots, const uint64_t *words, moit_slice_entry *table) {
    /* an eighth of an octave a step, but whole cells */
    static const double steps[8] = {1.0,        0.91700404, 0.84089642, 0.77110541,
                                    0.70710678, 0.64841978, 0.59460356, 0.54525387};
    marked m = {words, cells, log2_of(cells)};
    while (m.count > 1 && slices_of(&m, slots) > slots) m.count /= 2;
    int octave = m.count;
    for (int k = 1; k < 8 && octave < cells; ++k) {
        m.count = (int)(2 * octave * steps[k]);
        if (m.count <= octave || slices_of(&m, slots) <= slots) break;
        m.count = octave;
    }
    if (m.count < octave) m.count = octave;
    fill(&m, table);
}

/* Whether there is a marked cell among those first to end. */
static bool any_marked(const uint64_t *words, int cells, int first, int end) {
    return next_marked(words, cells, first > 0 ? first : 0) < (end < cells ? end : cells);
}

int moit_voxel_table(int cells, int slots, const uint64_t *words, moit_slice_entry *table) {
    int length = 1, used = cells, guard = MOIT_VOXEL_GUARD;
    for (;; length *= 2) { /* a joined cell is what any of its cells, or their neighbours, have */
        used = 0;
        for (int cell = 0; cell < cells; cell += length)
            used += any_marked(words, cells, cell - guard, cell + length + guard);
        if (used < slots || length == cells) break;
    }
    int slot = 0;
    for (int cell = 0; cell < cells; cell += length) {
        bool any = any_marked(words, cells, cell - guard, cell + length + guard);
        for (int i = 0; i < length; ++i)
            table[cell + i] =
                (moit_slice_entry){(uint16_t)(2 * slot + any), (uint16_t)i, 1.0F / (float)length};
        slot += any;
    }
    return length;
}

/* ---- Codes ----------------------------------------------------------------------------------- */

/* The least light that a code lets through is a step of as many bits; of 8, as published, a step of
 * 255. */
double moit_slice_depth_of_most(const moit_technique *technique) {
    return technique->slices.bits == 8 ? 5.5412635451584258
                                       : (double)technique->slices.bits * 0.69314718055994531;
}

double moit_slice_most(const moit_technique *technique) {
    return (double)((1 << technique->slices.bits) - 1);
}

double moit_slice_quantum(const moit_technique *technique) {
    return moit_slice_depth_of_most(technique) / moit_slice_most(technique);
}

int64_t moit_slice_region_side(const moit_technique *technique) {
    switch (technique->slices.table) {
    case MOIT_TABLE_IMAGE: return 0;
    case MOIT_TABLE_TILE: return technique->slices.tile;
    default: return technique->resolution < 2 ? 1 : technique->resolution;
    }
}

/* Cells fill whole words, and blocks lie within squares that have a table. */
bool moit_slices_fit(const moit_technique *technique) {
    const moit_slice_options *o = &technique->slices;
    int side = technique->resolution < 2 ? 1 : technique->resolution;
    return o->bits >= 2 && o->bits <= 16 && (o->cells & (o->cells - 1)) == 0 && o->cells >= 64
           && o->cells <= MOIT_MOST_SLICE_CELLS
           && (o->table != MOIT_TABLE_TILE || (o->tile > 0 && o->tile % side == 0))
           && (side == 1 || !technique->range_per_pixel);
}
