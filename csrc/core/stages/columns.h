/* Lanes over pixels, whose fragments come one after the other. Pixels of about as many fragments
 * go side by side, as lanes that are done wait for the others. Of each pixel LANES fragments are
 * fetched at once, and turned from rows to columns: one by one they cost more than what is done
 * with them. */

enum { COLUMN_PIXELS = 512, COLUMN_COUNTS = 256 };

/* Up to COLUMN_PIXELS pixels from `first` on, those of few fragments first; gives how many. */
FN int pixels_by_count(int first, int pixels, const int32_t *offsets, int *order) {
    int n = pixels - first < COLUMN_PIXELS ? pixels - first : COLUMN_PIXELS;
    int place[COLUMN_COUNTS + 1] = {0};
    uint8_t count[COLUMN_PIXELS];
    for (int i = 0; i < n; ++i) {
        int fragments = offsets[first + i + 1] - offsets[first + i];
        count[i] = (uint8_t)(fragments < COLUMN_COUNTS ? fragments : COLUMN_COUNTS - 1);
        ++place[count[i] + 1];
    }
    for (int k = 1; k < COLUMN_COUNTS; ++k) place[k] += place[k - 1];
    for (int i = 0; i < n; ++i) order[place[count[i]]++] = first + i;
    return n;
}

typedef struct {
    int pixel[LANES], start[LANES], count[LANES]; /* lanes beyond the last pixel have count 0 */
    truth counts;
    int most;
} pixel_columns;

FN pixel_columns columns_from(int n, const int *order, const int32_t *offsets) {
    pixel_columns c = {.most = 0};
    for (int lane = 0; lane < LANES; ++lane) {
        int p = order[lane < n ? lane : 0];
        c.pixel[lane] = p;
        c.start[lane] = offsets[p];
        c.count[lane] = lane < n ? offsets[p + 1] - offsets[p] : 0;
        c.counts[lane] = c.count[lane];
        c.most = c.count[lane] > c.most ? c.count[lane] : c.most;
    }
    return c;
}

#if defined(__GNUC__) && !defined(__clang__)
/* Rows that are `apart` swap the halves of their runs of twice as many. */
#define TURN_STEP(vector, whole, row, apart) \
    if (LANES > apart) { \
        whole lane = {0}; \
        for (int l = 0; l < LANES; ++l) lane[l] = l; \
        whole upper = (lane & apart) != 0; \
        whole low = (upper & (lane - apart + LANES)) | (~upper & lane); \
        whole high = (upper & (lane + LANES)) | (~upper & (lane + apart)); \
        for (int i = 0; i < LANES; ++i) \
            if (!(i & apart)) { \
                vector a = row[i], b = row[i + apart]; \
                row[i] = __builtin_shuffle(a, b, low); \
                row[i + apart] = __builtin_shuffle(a, b, high); \
            } \
    }
#define TURN(vector, whole, row) \
    TURN_STEP(vector, whole, row, 8) \
    TURN_STEP(vector, whole, row, 4) \
    TURN_STEP(vector, whole, row, 2) \
    TURN_STEP(vector, whole, row, 1)
#else
#define TURN(vector, whole, row) \
    for (int i = 0; i < LANES; ++i) \
        for (int k = 0; k < i; ++k) { \
            __typeof__(row[i][k]) held = row[i][k]; \
            row[i][k] = row[k][i]; \
            row[k][i] = held; \
        }
#endif

/* Numbers (padded) of the fragments `from` to from + LANES of each pixel; where one has no such,
 * whatever there is. */
FN void number_columns(const pixel_columns *c, const SCALAR *numbers, int from, real *column) {
    for (int lane = 0; lane < LANES; ++lane)
        column[lane] = from < c->count[lane] ? load(numbers + c->start[lane] + from) : K(0.0);
    TURN(real, truth, column)
}

FN void key_columns(const pixel_columns *c, const uint32_t *keys, int from, uint_lanes *column) {
    for (int lane = 0; lane < LANES; ++lane) {
        column[lane] = U(0u);
        if (from < c->count[lane])
            memcpy(column + lane, keys + c->start[lane] + from, sizeof *column);
    }
    TURN(uint_lanes, int_lanes, column)
}
