/* Pixels in the order of how many fragments they have. Loops over few fragments end where
 * processors guess they do once pixels of equal counts follow one another, and these fill lanes. */

/* Pixels that are put in order at a time, and counts that are told apart: all from the last on are
 * one. */
enum { ORDERED_PIXELS = 512, COUNTS = 64 };

typedef struct {
    int first[COUNTS + 1];         /* in `place`, of the pixels of each count */
    int32_t place[ORDERED_PIXELS]; /* of pixels, those of equal counts in their order */
} equal_counts;

/* The first pixel of which vectors of four may read beyond the last fragment of all. */
FN int pixels_within(int pixels, const int32_t *offsets) {
    int within = pixels, end = offsets[pixels];
    while (within > 0 && offsets[within] + 3 > end) --within;
    return within;
}

/* Of pixels from `first` to before `end`, at most ORDERED_PIXELS. */
FN void order_by_count(equal_counts *by, int first, int end, const int32_t *offsets) {
    int n = end > first ? offsets[first + 1] - offsets[first] : 0, differ = n >= COUNTS;
    for (int p = first; p < end; ++p) differ |= (offsets[p + 1] - offsets[p]) ^ n;
    if (!differ) {
        for (int c = 0; c <= COUNTS; ++c) by->first[c] = c <= n ? 0 : end - first;
        for (int p = first; p < end; ++p) by->place[p - first] = p;
    } else {
        int next[COUNTS] = {0}, before = 0;
        for (int p = first; p < end; ++p) {
            int count = offsets[p + 1] - offsets[p];
            ++next[count < COUNTS ? count : COUNTS - 1];
        }
        for (int c = 0; c < COUNTS; ++c) {
            int those = next[c];
            next[c] = by->first[c] = before;
            before += those;
        }
        by->first[COUNTS] = before;
        for (int p = first; p < end; ++p) {
            int count = offsets[p + 1] - offsets[p];
            by->place[next[count < COUNTS ? count : COUNTS - 1]++] = p;
        }
    }
}

/* Reads a number of each cache line from `begin` to before `end`: memory gives fastest what is read
 * in its order, and pixels are then taken in another. */
FN void touch(const SCALAR *begin, const SCALAR *end) {
    enum { LINE = 64 / sizeof(SCALAR) };
    bits all = 0;
    for (; begin < end; begin += LINE) {
        bits some;
        memcpy(&some, begin, sizeof some);
        all |= some;
    }
    __asm__ volatile("" : : "r"(all));
}

/* Four pixels of `count` fragments each; of those that are not `there` nothing is written. */
typedef struct {
    int count, there;
    int32_t pixel[4], start[4];
} four_pixels;

FN four_pixels four_pixels_at(const equal_counts *by, int count, int k, const int32_t *offsets) {
    int there = by->first[count + 1] - k;
    four_pixels four = {.count = count, .there = there < 4 ? there : 4};
    for (int lane = 0; lane < 4; ++lane) { /* those that are not there repeat the first */
        four.pixel[lane] = by->place[lane < there ? k + lane : k];
        four.start[lane] = offsets[four.pixel[lane]];
    }
    return four;
}

/* Rows of the k-th to (k + 3)-th numbers of each pixel; those beyond its last are of others. */
FN void rows_of_four(const four_pixels *four, const SCALAR *x, int k, four_numbers row[4]) {
    if (four->count - k == 1) { /* one row only */
        const SCALAR *y = x + k;
        row[0] = (four_numbers){y[four->start[0]], y[four->start[1]], y[four->start[2]],
                                y[four->start[3]]};
        row[1] = row[2] = row[3] = row[0];
        return;
    }
    for (int lane = 0; lane < 4; ++lane) row[lane] = load_four(x + four->start[lane] + k);
    transpose_four(row);
}

/* The other way. */
FN void put_rows(const four_pixels *four, SCALAR *x, int k, four_numbers row[4]) {
    int left = four->count - k;
    if (left > 1) transpose_four(row);
    for (int lane = 0; lane < four->there; ++lane) {
        SCALAR *own = x + four->start[lane] + k;
        if (left >= 4) {
            memcpy(own, row + lane, sizeof *row);
        } else if (left == 1) {
            own[0] = row[0][lane];
        } else {
            own[0] = row[lane][0];
            own[1] = row[lane][1];
            if (left > 2) own[2] = row[lane][2];
        }
    }
}

/* Puts a number of each pixel where it belongs. */
FN void put_of_four(const four_pixels *four, double *x, quad own) {
    for (int lane = 0; lane < four->there; ++lane) x[four->pixel[lane]] = own[lane];
}

/* Does OF_FOUR(four) for all pixels of equal counts, four by four, and OF_ONE(p) for the others. Of
 * the least counts the compiler knows how many there are. */
#define OF_EQUAL_COUNTS(n, offsets, OF_FOUR) \
    for (int k = by.first[n]; k < by.first[(n) + 1]; k += 4) { \
        four_pixels four = four_pixels_at(&by, n, k, offsets); \
        OF_FOUR(&four); \
    }
#define EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE) \
    do { \
        int within = (pixels) < 8 ? 0 : pixels_within(pixels, offsets); \
        for (int begin = 0; begin < within; begin += ORDERED_PIXELS) { \
            equal_counts by; \
            int end = begin + ORDERED_PIXELS < within ? begin + ORDERED_PIXELS : within; \
            order_by_count(&by, begin, end, offsets); \
            OF_EQUAL_COUNTS(0, offsets, OF_FOUR) \
            OF_EQUAL_COUNTS(1, offsets, OF_FOUR) \
            OF_EQUAL_COUNTS(2, offsets, OF_FOUR) \
            OF_EQUAL_COUNTS(3, offsets, OF_FOUR) \
            OF_EQUAL_COUNTS(4, offsets, OF_FOUR) \
            for (int n = 5; n < COUNTS - 1; ++n) OF_EQUAL_COUNTS(n, offsets, OF_FOUR) \
            for (int k = by.first[COUNTS - 1]; k < by.first[COUNTS]; ++k) OF_ONE(by.place[k]); \
        } \
        for (int p = within; p < (pixels); ++p) OF_ONE(p); \
    } while (0)
