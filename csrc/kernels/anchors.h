// Anchors: a few fragments that matter most occlude exactly, wherever they lie; all others are
// counted in cells between them. Ours.
//
// A pixel keeps the greatest keys of its fragments: 6 bits of importance alpha exp(-gamma u), u
// being warped depth in [0, 1], then 16 of how near they are and 10 of how little they let through.
// Keys of 64 bits have 24 of how near: a word of depth is then one of 16 bits with eight binary
// digits behind the point.
// The absorbance of all others is summed in cells, cut by the depths that are kept and by a grid of
// equal steps over the pixel's own extent. Both are whole numbers, and greatest keys and sums of
// whole numbers do not hang on any order. Depths are words of 16 bits, 0 to 65535. Of a cell there
// are 7131 values, so that five are digits of one number of 64 bits.

#include "kernels/anchor_numbers.h"

#ifndef KEPT_ROOM // a shader knows how many there are
#define KEPT_ROOM MOST_KEPT
#define CELL_ROOM (MOST_KEPT + MOST_CELLS)
#endif

// What a pixel keeps: its extent; of each that is kept the word of depth and the absorbance; what
// cells have, in steps.
STRUCT(anchors) {
    number nearest, farthest;
    number word[KEPT_ROOM];
    number absorbed[KEPT_ROOM];
    number cell[CELL_ROOM];
};

// Depth in [0, 1] as a word of so many binary digits, of which floats hold all.
FN number fine_word(real u) {
    real wide = within(u, K(1.0)) * 65536.0;
    real whole = min(whole_below(wide), K(65535.0));
    real digits = min(whole_below((wide - whole) * 256.0), K(255.0));
    return whole + digits * 0.00390625;
}

// A key in two: its upper 22 bits, and the lower 10. A fragment that lets through as much as makes
// no difference to the latter is none to keep: all are 0.
STRUCT(anchor_key) { number upper, lower; };

FN anchor_key anchor_key_of(real alpha, real u, real word, real gamma) {
    const real slope = K(ANCHOR_IMPORTANCE / (ANCHOR_OCTAVES * 0.69314718055994530942));
    real root = nearest_integer(K(ANCHOR_ROOTS) * sqrt(1.0 - alpha));
    real lower = within(ANCHOR_ROOTS - root, K(ANCHOR_ROOTS));
    real least = max(alpha, K(1e-30));
    real decayed = logarithm(least) - gamma * u;
    real importance = within(K(ANCHOR_IMPORTANCE) + slope * decayed, K(ANCHOR_IMPORTANCE));
    importance = whole_below(importance);
    anchor_key key;
    real whole = whole_below(word);
    real upper = importance * 65536.0 + (65535.0 - whole);
    key.upper = select(lower > 0.0, upper, K(0.0));
    key.lower = lower;
    return key;
}

// Where keys have more bits, 8 between these: how near within a word.
FN number anchor_fine(anchor_key key, real word) {
    real fine = 255.0 - (word - whole_below(word)) * 256.0;
    return select(key.lower > 0.0, fine, K(0.0));
}

// The absorbance that a key's lower bits stand for, at most that of max_alpha = 1 - shrink.
FN number anchor_absorbance(real lower, real shrink) {
    real root = (ANCHOR_ROOTS - lower) / K(ANCHOR_ROOTS);
    real through = max(root * root, shrink);
    real absorbed = -logarithm(through);
    return absorbed;
}

// What a fragment adds to its cell. From which fraction of a step on it is rounded up hangs on its
// depth, by a turn of about the golden ratio, so that these spread evenly: were all rounded alike,
// many layers thinner than half a step would all be lost. It hangs on its whole steps, too: of
// layers of one depth, as billboards are, a picture would show the common error. Turns are exact in
// floats: multiples of 1/256 below 2^16.
FN number anchor_steps(real absorbed, real word) {
    real steps = within(absorbed, K(ANCHOR_FULL / ANCHOR_STEPS)) * K(ANCHOR_STEPS);
    real whole = whole_below(steps);
    real turns = whole_below(word) * 0.62109375 + whole * 0.75390625;
    real threshold = (turns - whole_below(turns)) + 0.001953125;
    real raised = (steps - whole) + threshold;
    return whole + whole_below(raised);
}

// Which cell a word is in, from the nearest: as many as there are of those that are kept, and of
// the grid's lines, in front of it or at it. So what lies at the depth of one that is kept has all
// that is in front of that in front. Products of whole numbers below 2^22 are exact; the grid's
// lines are at such, whatever digits words have.
FN number anchor_cell(const int kept, const int cells, anchors a, real word) {
    real place = K(0.0);
    for (int k = 0; k < kept; ++k) place += select(a.word[k] <= word, K(1.0), K(0.0));
    real inside = (whole_below(word) - a.nearest) * K(cells);
    real width = a.farthest - a.nearest + 1.0;
    for (int j = 1; j < cells; ++j) place += select(inside >= K(j) * width, K(1.0), K(0.0));
    return place;
}

// How far in its cell a word is, from 0 where that begins to below 1.
FN number anchor_share(const int kept, const int cells, anchors a, real word) {
    real start = a.nearest;
    real end = a.farthest + 1.0;
    for (int k = 0; k < kept; ++k) {
        truth passed = a.word[k] <= word;
        start = select(passed, max(start, a.word[k]), start);
        end = select(passed, end, min(end, a.word[k]));
    }
    real inside = (whole_below(word) - a.nearest) * K(cells);
    real width = a.farthest - a.nearest + 1.0;
    for (int j = 1; j < cells; ++j) {
        truth passed = inside >= K(j) * width;
        real line = a.nearest + K(j) * width * K(1.0 / cells);
        start = select(passed, max(start, line), start);
        end = select(passed, end, min(end, line));
    }
    real share = clamp((word - start) / max(end - start, K(0.5)), K(0.0), K(1.0));
    return share;
}

// What is absorbed in front of a fragment. own: its absorbance, which its cell has, or 0 of a depth
// where there is none; below 0: it is kept, and its cell begins with it. The rest of its cell is
// taken for many fragments like itself, anywhere in the cell: such let through more on the mean
// than an even medium that absorbs as much.
FN number anchor_absorbed(const int kept, const int cells, anchors a, real word, real own) {
    real absorbed = K(0.0);
    real steps = K(0.0);
    real at = K(0.0);
    real cell = anchor_cell(kept, cells, a, word);
    for (int k = 0; k < kept; ++k) absorbed += select(a.word[k] < word, a.absorbed[k], K(0.0));
    for (int c = 0; c < kept + cells; ++c) {
        steps += select(K(c) < cell, a.cell[c], K(0.0));
        at = select(K(c) == cell, a.cell[c], at);
    }
    real share = select(own < 0.0, K(0.0), anchor_share(kept, cells, a, word));
    real itself = max(own, K(0.0));
    real others = max(at - anchor_steps(itself, word), K(0.0)) * K(1.0 / ANCHOR_STEPS);
    real alike = 1.0 + K(ANCHOR_LUMPS) * min(itself, others) * (1.0 - share);
    real in_cells = steps * K(1.0 / ANCHOR_STEPS) + share * others / alike;
    return absorbed + in_cells;
}
