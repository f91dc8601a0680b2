// Where slices stand: only where anything is. Fragments mark cells of depth, and of marks a table
// is made: first threads count slices for each number of cells that may be joined, then threads,
// one a word of marks, write what stands there. Marks and table are of a picture, or of squares.
//
// CELLS      of depth, 1 << SHIFT of them, in MARKS words of 32 bits
// GUARD      1: what is within 3 cells of a mark counts as marked; 0: marks alone
// RUNS       1: a run of joined cells has slices at all its borders; 0: one at each cell's front
// EIGHTHS    1: cells are joined by eighths of an octave; 0: by twos
// TRIALS     how many numbers of cells are tried
// PER_WORD   of the table, words for each of marks
// ROW        words of the table of a square: TRIALS, one, and PER_WORD for each of marks
// SQUARE     a side of squares in pixels that have tables of their own; 0: the picture has one
//
// Slices, at most: as many words of a pixel, or of a block.
#ifndef SLOTS
#define SLOTS 64
#endif
#include "engine/dialect.glsl"
#include "kernels/slices.h"

slice_place place_of(float z) { return slice_place_of(0.5 * z + 0.5, float(CELLS)); }

uint sides_in(uint length, uint side) { return (length + side - 1u) / side; }

// The square of a pixel, and how many there are.
#if SQUARE > 0
uint square_of(uvec2 pixel, uvec2 size) {
    return pixel.y / uint(SQUARE) * sides_in(size.x, uint(SQUARE)) + pixel.x / uint(SQUARE);
}
uint squares_of(uvec2 size) {
    return sides_in(size.x, uint(SQUARE)) * sides_in(size.y, uint(SQUARE));
}
#else
uint square_of(uvec2 pixel, uvec2 size) { return 0u; }
uint squares_of(uvec2 size) { return 1u; }
#endif

uint ones(uint x) { return uint(bitCount(x)); }

// Marks the cell of a fragment.
void mark(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint cell = uint(place_of(z).cell), at = square_of(pixel, size) * uint(MARKS) + (cell >> 5u);
    uint bit = 1u << (cell & 31u);
    if (alpha > 0.0 && (load_marks(at) & bit) == 0u) or_marks(at, bit);
}

#if GUARD
uint marks_of(uint square, uint w) {
    uint at = square * uint(MARKS) + w, here = load_marks(at);
    uint low = w > 0u ? load_marks(at - min(w, 1u)) >> 29u : 0u;
    uint last = uint(MARKS - 1), next = min(at + 1u, at - w + last);
    uint high = w < last ? load_marks(next) << 29u : 0u;
    uint beside = here | (here << 1u) | (here >> 1u) | low >> 2u | high << 2u;
    uint up = (here << 2u) | (here << 3u) | low | low >> 1u;
    return beside | up | (here >> 2u) | (here >> 3u) | high | high << 1u;
}
#else
uint marks_of(uint square, uint w) { return load_marks(square * uint(MARKS) + w); }
#endif

// Of `count` joined cells the one that a cell is in, and the first cell of the k-th.
uint joined_of(uint cell, uint count) { return (cell * count) >> SHIFT; }
uint first_of(uint k, uint count) { return ((k << SHIFT) + count - 1u) / count; }

// How many joined cells the n-th trial has.
#if EIGHTHS
const float EIGHTH[8] = float[8](1.0, 0.91700404, 0.84089642, 0.77110541, 0.70710678, 0.64841978,
                                 0.59460356, 0.54525387);
uint cells_of_trial(uint n) { return uint(float(uint(CELLS) >> (n >> 3u)) * EIGHTH[n & 7u]); }
#else
uint cells_of_trial(uint n) { return uint(CELLS) >> n; }
#endif

// A bit for each cell of a word with which a joined one ends.
#if EIGHTHS
uint ends_of(uint w, uint count) {
    uint ends = 0u, k = joined_of(32u * w, count);
    for (int i = 0; i < 32; ++i) {
        uint next = joined_of(32u * w + uint(i) + 1u, count);
        ends = ends | ((next - k) << i);
        k = next;
    }
    return ends;
}
#else
uint ends_of(uint w, uint count) {
    uint cells = uint(CELLS) / count;
    uint ends = ((32u * w + 32u) & (max(cells, 32u) - 1u)) == 0u ? 1u << 31u : 0u;
    ends = ends | (cells < 32u ? ends >> 16u : 0u);
    ends = ends | (cells < 16u ? ends >> 8u : 0u);
    ends = ends | (cells < 8u ? ends >> 4u : 0u);
    ends = ends | (cells < 4u ? ends >> 2u : 0u);
    return ends | (cells < 2u ? ends >> 1u : 0u);
}
#endif

// Bits carried up to the ends of their joined cells.
uint carried(uint bits, uint ends) {
    uint x = bits, run = ~(ends << 1u); // from the cell before
    x = x | (run & (x << 1u));
    run = run & (run << 1u);
    x = x | (run & (x << 2u));
    run = run & (run << 2u);
    x = x | (run & (x << 4u));
    run = run & (run << 4u);
    x = x | (run & (x << 8u));
    run = run & (run << 8u);
    return x | (run & (x << 16u));
}

// A word's joined cells by bits where each ends: which have anything, and which of these begin a
// run. Of the one that ends later: what it has so far, and whether that before it has anything.
#if RUNS
struct joins { uint any; uint open; uint begins; uint before; };
#else
struct joins { uint any; uint open; };
#endif

joins no_word() {
    joins o;
    o.any = 0u;
    o.open = 0u;
#if RUNS
    o.begins = 0u;
    o.before = 0u;
#endif
    return o;
}

joins next_word(joins last, uint marks, uint ends) {
    uint all = carried(marks | last.open, ends), whole = ends >> 31u;
    joins o;
    o.any = all & ends;
    o.open = whole == 1u ? 0u : all >> 31u;
#if RUNS
    uint before = carried((o.any << 1u) | last.before, ends);
    o.begins = o.any & ~before;
    o.before = whole == 1u ? o.any >> 31u : before >> 31u;
#endif
    return o;
}

#if RUNS
uint slices_of(joins j) { return ones(j.any) + ones(j.begins); }
#else
uint slices_of(joins j) { return ones(j.any); }
#endif

// For each trial of each square: how many slices stand where as many cells are joined.
void count_slices(uint index, uvec2 size) {
    uint square = index / uint(TRIALS), n = index % uint(TRIALS);
    if (square < squares_of(size)) {
        uint count = cells_of_trial(n), used = 0u;
        joins j = no_word();
        for (int w = 0; w < MARKS; ++w) {
            j = next_word(j, marks_of(square, uint(w)), ends_of(uint(w), count));
            used = used + slices_of(j);
        }
        store_places(square * uint(ROW) + n, used);
    }
}

// The most joined cells whose slices there is room for.
uint cells_that_fit(uint row) {
#if EIGHTHS
    uint octave = uint(SHIFT);
    for (int s = SHIFT - 1; s >= 0; --s) {
        octave = load_places(row + 8u * uint(s)) <= uint(SLOTS) ? uint(s) : octave;
    }
    uint least = uint(CELLS) >> octave, count = least;
    bool found = octave == 0u;
    for (int k = 1; k < 8; ++k) {
        uint n = 8u * max(octave, 1u) - 8u + uint(k), cells = cells_of_trial(n);
        bool fits = cells <= least || load_places(row + n) <= uint(SLOTS);
        count = !found && fits ? max(cells, least) : count;
        found = found || fits;
    }
    return count;
#else
    uint n = uint(SHIFT);
    for (int s = SHIFT - 1; s >= 0; --s) {
        n = load_places(row + uint(s)) < uint(SLOTS) ? uint(s) : n;
    }
    return cells_of_trial(n);
#endif
}

// For each word of marks of each square.
void place_slices(uint index, uvec2 size) {
    uint square = index / uint(MARKS), w = index % uint(MARKS), row = square * uint(ROW);
    if (square < squares_of(size)) {
        uint count = cells_that_fit(row), before = 0u;
        joins j = no_word();
        for (int i = 0; i < MARKS; ++i) {
            if (uint(i) <= w) {
                before = before + slices_of(j);
                j = next_word(j, marks_of(square, uint(i)), ends_of(uint(i), count));
            }
        }
        uint at = row + uint(TRIALS + 1) + uint(PER_WORD) * w;
        store_places(at, before);
        store_places(at + 1u, j.any);
#if RUNS
        store_places(at + 2u, j.begins);
#endif
        if (w == 0u) store_places(row + uint(TRIALS), count);
    }
}

// Around a place: the slice at the front, whether its cell has slices, and how far in it that is.
struct stand { uint slot; bool any; float inside; };

stand stand_at(uint square, slice_place p) {
    uint row = square * uint(ROW), count = load_places(row + uint(TRIALS)), cell = uint(p.cell);
    uint k = joined_of(cell, count), first = first_of(k, count), end = first_of(k + 1u, count);
    uint bit = (end - 1u) & 31u, below = (1u << bit) - 1u;
    uint at = row + uint(TRIALS + 1) + uint(PER_WORD) * ((end - 1u) >> 5u);
    uint any = load_places(at + 1u), here = (any >> bit) & 1u;
    stand o;
    o.slot = load_places(at) + ones(any & below);
#if RUNS
    o.slot = o.slot + ones(load_places(at + 2u) & (below + below + 1u)) - here;
#endif
    o.any = here == 1u;
    o.inside = slice_joined(p.inside, float(cell - first), 1.0 / float(end - first));
    return o;
}
