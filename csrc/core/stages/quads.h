/* Four doubles at a time, in all tables alike: what sums over fragments are made of. */

typedef int64_t quad_truth __attribute__((vector_size(32)));

typedef SCALAR four_numbers __attribute__((vector_size(4 * sizeof(SCALAR))));

/* One instruction, which GCC does not find. */
FN quad quad_from(four_numbers x) {
#if defined(VECTOR_BYTES) && VECTOR_BYTES >= 32 && defined(__GNUC__) && !defined(__clang__)
    typedef float four_floats __attribute__((vector_size(16)));
    if (!DOUBLE) {
        four_floats floats;
        memcpy(&floats, &x, sizeof floats);
        return (quad)__builtin_ia32_cvtps2pd256(floats);
    }
#endif
    return __builtin_convertvector(x, quad);
}

FN four_numbers load_four(const SCALAR *p) {
    four_numbers x;
    memcpy(&x, p, sizeof x);
    return x;
}

FN quad load_quad(const SCALAR *p) { return quad_from(load_four(p)); }

FN quad quad_select(quad_truth t, quad a, quad b) {
    return (quad)((t & (quad_truth)a) | (~t & (quad_truth)b));
}

/* Four times a number. */
FN quad quad_of(SCALAR x) { return quad_from((four_numbers){x, x, x, x}); }

/* x but for the last of four, which is that of y. */
FN quad with_last(quad x, quad y) {
#if defined(VECTOR_BYTES) && VECTOR_BYTES >= 32 && defined(__GNUC__) && !defined(__clang__)
    return (quad)__builtin_ia32_blendpd256(x, y, 8);
#else
    const quad_truth last = {0, 0, 0, -1};
    return quad_select(last, y, x);
#endif
}

/* Four times a number, whatever its sign. */
FN quad four_of(double x) { return (quad){x, x, x, x}; }

/* Row k holds the k-th numbers of what four rows were. */
FN void transpose_four(four_numbers row[4]) {
    four_numbers a = __builtin_shufflevector(row[0], row[1], 0, 4, 1, 5),
                 b = __builtin_shufflevector(row[2], row[3], 0, 4, 1, 5),
                 c = __builtin_shufflevector(row[0], row[1], 2, 6, 3, 7),
                 d = __builtin_shufflevector(row[2], row[3], 2, 6, 3, 7);
    row[0] = __builtin_shufflevector(a, b, 0, 1, 4, 5);
    row[1] = __builtin_shufflevector(a, b, 2, 3, 6, 7);
    row[2] = __builtin_shufflevector(c, d, 0, 1, 4, 5);
    row[3] = __builtin_shufflevector(c, d, 2, 3, 6, 7);
}

/* Sums of four numbers of each, (0 + 1) + (2 + 3). */
FN quad sums_of_four(const quad *x) {
    quad front =
        (quad){x[0][0], x[1][0], x[0][2], x[1][2]} + (quad){x[0][1], x[1][1], x[0][3], x[1][3]};
    quad back =
        (quad){x[2][0], x[3][0], x[2][2], x[3][2]} + (quad){x[2][1], x[3][1], x[2][3], x[3][3]};
    return (quad){front[0], front[1], back[0], back[1]}
           + (quad){front[2], front[3], back[2], back[3]};
}
