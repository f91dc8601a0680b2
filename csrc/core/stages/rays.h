/* Lanes over the fragments of several pixels, each with the numbers of its own pixel's ray. */

/* Pixels that have fragments are taken in blocks. Numbers of their rays lie side by side, a row for
 * each number, so that the pixels of a vector of fragments are LANES neighbours in a row at
 * most. */
enum { BLOCK_RAYS = 64, BLOCK_POINTS = 1024, BLOCK_ROW = BLOCK_RAYS + LANES };

typedef struct {
    int rays, first, end;               /* fragments from `first` to before `end` */
    int pixel[BLOCK_RAYS];              /* of each ray */
    bits ray[BLOCK_POINTS + 2 * LANES]; /* of each fragment */
} ray_block;

/* Takes pixels from `p` on; gives the first that it leaves. A pixel of many fragments is alone. */
FN int next_block(ray_block *block, int p, int pixels, const int32_t *offsets) {
    block->rays = 0;
    block->first = block->end = offsets[p];
    for (; p < pixels && block->rays < BLOCK_RAYS; ++p) {
        int end = offsets[p + 1], start = block->end;
        if (start == end) continue;
        bool fits = end - block->first <= BLOCK_POINTS;
        if (!fits && block->rays) break;
        truth ray = (truth){0} + (bits)block->rays;
        for (int i = start; i < (fits ? end : start + 1); i += LANES)
            memcpy(block->ray + (i - block->first), &ray, sizeof ray);
        block->pixel[block->rays++] = p;
        block->end = end;
        if (!fits) return p + 1;
    }
    if (block->rays) { /* a vector may run on beyond the last fragment */
        truth ray = (truth){0} + (bits)(block->rays - 1);
        memcpy(block->ray + (block->end - block->first), &ray, sizeof ray);
    }
    return p;
}

/* The ray of the vector of fragments from `i` on: that of its first, and of each lane from
 * there. */
FN int first_ray(const ray_block *block, int i, truth *lane) {
    const bits *ray = block->ray + (block->rays == 1 ? 0 : i - block->first);
    memcpy(lane, ray, sizeof *lane);
    *lane -= (truth){0} + ray[0];
    return (int)ray[0];
}

/* A number of each lane's ray, from its row at the first lane's. */
FN real lanes_of_row(const SCALAR *row, truth lane) {
#if defined(VECTOR_BYTES) && VECTOR_BYTES >= 32 && defined(__GNUC__) && !defined(__clang__)
    return __builtin_shuffle(load(row), lane);
#else
    if (!lane[LANES - 1]) return K(row[0]); /* all of one ray */
    SCALAR lanes[LANES];
    for (int i = 0; i < LANES; ++i) lanes[i] = row[lane[i]];
    return load(lanes);
#endif
}

/* Numbers of a block's rays, from a row of all pixels'. */
FN void numbers_of_rays(const ray_block *block, const SCALAR *from, SCALAR *row) {
    int first = block->rays ? block->pixel[0] : 0;
    if (block->rays && block->pixel[block->rays - 1] - first == block->rays - 1)
        memcpy(row, from + first, (size_t)block->rays * sizeof(SCALAR));
    else
        for (int r = 0; r < block->rays; ++r) row[r] = from[block->pixel[r]];
}

/* What fragments' rays are: those of a block's pixels, whose numbers are in `row`; or of pixels
 * that have one fragment each, rows that are MOIT_ROW(pixels) long, and their b0. */
typedef struct {
    const ray_block *block; /* NULL: one fragment each */
    SCALAR (*row)[BLOCK_ROW];
    const SCALAR *each, *b0;
    int length;
} rays_of_fragments;

/* exp(-x) of each fragment's number. By itself: its steps wait for one another, and a short loop
 * lets a processor work on several vectors at once. */
FN void decay_of(int first, int end, SCALAR *x) {
    for (int i = first; i < end; i += LANES) store(x + i, exponential(-load(x + i)));
}
