/* Pixels in the order of how many fragments they have. Loops over few fragments end where
 * processors guess they do once pixels of about equal counts follow one another, and these fill
 * lanes. */

/* Pixels that are put in order at a time, and counts that are told apart: all from the last on are
 * one. */
enum { ORDERED_PIXELS = 512, COUNTS = 64 };

typedef struct {
    int first[COUNTS + 1]; /* in the arrays, of the pixels of each count */
    /* of pixels, those of equal counts in their order: which it is, where its fragments begin and
     * how many there are */
    int32_t place[ORDERED_PIXELS + 4], start[ORDERED_PIXELS + 4], count[ORDERED_PIXELS + 4];
} equal_counts;

/* The first pixel of which vectors of four may read beyond the last fragment of all: from a pixel's
 * last one on, or, where it has none, from where it would begin. */
FN int pixels_within(int pixels, const int32_t *offsets) {
    int within = pixels, end = offsets[pixels];
    while (within > 0 && offsets[within] + 4 > end) --within;
    return within;
}

/* Of pixels from `first` to before `end`, at most ORDERED_PIXELS. */
FN void order_by_count(equal_counts *by, int first, int end, const int32_t *offsets) {
    int n = end > first ? offsets[first + 1] - offsets[first] : 0, differ = n >= COUNTS;
    for (int p = first; p < end; ++p) differ |= (offsets[p + 1] - offsets[p]) ^ n;
    int next[COUNTS] = {0}, before = 0;
    if (!differ) {
        for (int c = 0; c <= COUNTS; ++c) by->first[c] = c <= n ? 0 : end - first;
        for (int p = first; p < end; ++p) by->place[p - first] = p;
        for (int p = first; p < end; ++p) by->start[p - first] = offsets[p];
        for (int p = first; p < end; ++p) by->count[p - first] = n;
    } else {
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
            int start = offsets[p], count = offsets[p + 1] - start;
            int at = next[count < COUNTS ? count : COUNTS - 1]++;
            by->place[at] = p;
            by->start[at] = start;
            by->count[at] = count;
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

/* Four pixels that follow one another in that order; of those that are not `there` nothing is
 * written. */
typedef struct {
    int most, there; /* the most fragments of one of them */
    bool equal;      /* all have as many */
    const int32_t *pixel, *start, *count;
} four_pixels;

/* Fours are whole: behind the last pixel but those of many fragments, which have been taken, the
 * last is repeated. */
FN void fill_up(equal_counts *by) {
    int end = by->first[COUNTS - 1];
    for (int k = end; end > 0 && k < end + 3; ++k) {
        by->place[k] = by->place[end - 1];
        by->start[k] = by->start[end - 1];
        by->count[k] = by->count[end - 1];
    }
}

FN four_pixels four_pixels_at(const equal_counts *by, int k) {
    int there = by->first[COUNTS - 1] - k;
    return (four_pixels){by->count[k + 3], there < 4 ? there : 4, by->count[k] == by->count[k + 3],
                         by->place + k,    by->start + k,         by->count + k};
}

/* Rows of the k-th to (k + 3)-th numbers of each pixel; 0 beyond a pixel's last, or where all have
 * as many, anything. */
FN void rows_of_four(const four_pixels *four, const SCALAR *x, int k, four_numbers row[4]) {
    if (four->equal && four->most - k == 1) { /* one row only */
        const SCALAR *y = x + k;
        row[0] = (four_numbers){y[four->start[0]], y[four->start[1]], y[four->start[2]],
                                y[four->start[3]]};
        row[1] = row[2] = row[3] = row[0];
        return;
    }
    if (four->equal) {
        for (int lane = 0; lane < 4; ++lane) row[lane] = load_four(x + four->start[lane] + k);
        transpose_four(row);
        return;
    }
    typedef bits four_bits __attribute__((vector_size(4 * sizeof(SCALAR))));
    const four_bits place = {0, 1, 2, 3};
    for (int lane = 0; lane < 4; ++lane) {
        int left = four->count[lane] - k;
        row[lane] = load_four(x + four->start[lane] + (left > 0 ? k : 0));
        row[lane] = (four_numbers)((four_bits)row[lane] & (place < (bits)left));
    }
    transpose_four(row);
}

/* The other way. */
FN void put_rows(const four_pixels *four, SCALAR *x, int k, four_numbers row[4]) {
    if (!four->equal || four->most - k > 1) transpose_four(row);
    for (int lane = 0; lane < four->there; ++lane) {
        SCALAR *own = x + four->start[lane] + k;
        int left = four->count[lane] - k;
        if (left >= 4) {
            memcpy(own, row + lane, sizeof *row);
        } else if (four->equal && left == 1) {
            own[0] = row[0][lane];
        } else if (left > 0) {
            own[0] = row[lane][0];
            if (left > 1) own[1] = row[lane][1];
            if (left > 2) own[2] = row[lane][2];
        }
    }
}

/* Puts a number of each pixel where it belongs. */
FN void put_of_four(const four_pixels *four, double *x, quad own) {
    for (int lane = 0; lane < four->there; ++lane) x[four->pixel[lane]] = own[lane];
}

/* A number of each. */
FN quad of_four(const four_pixels *four, const double *x) {
    return (quad){x[four->pixel[0]], x[four->pixel[1]], x[four->pixel[2]], x[four->pixel[3]]};
}

/* Does OF_FOUR(four, most, equal) for all pixels, four by four in the order of their counts, and
 * OF_ONE(p) for those of many fragments. Of the least counts the compiler knows how many there are,
 * and that they are equal. */
#define EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE) \
    do { \
        int within = (pixels) < 8 ? 0 : pixels_within(pixels, offsets); \
        for (int begin = 0; begin < within; begin += ORDERED_PIXELS) { \
            equal_counts by; \
            int end = begin + ORDERED_PIXELS < within ? begin + ORDERED_PIXELS : within; \
            order_by_count(&by, begin, end, offsets); \
            for (int k = by.first[COUNTS - 1]; k < by.first[COUNTS]; ++k) OF_ONE(by.place[k]); \
            fill_up(&by); \
            for (int k = 0; k < by.first[COUNTS - 1]; k += 4) { \
                four_pixels four = four_pixels_at(&by, k); \
                if (!four.equal) OF_FOUR(&four, four.most, false); \
                else if (four.most == 1) OF_FOUR(&four, 1, true); \
                else if (four.most == 2) OF_FOUR(&four, 2, true); \
                else if (four.most == 3) OF_FOUR(&four, 3, true); \
                else if (four.most == 4) OF_FOUR(&four, 4, true); \
                else OF_FOUR(&four, four.most, true); \
            } \
        } \
        for (int p = within; p < (pixels); ++p) OF_ONE(p); \
    } while (0)
