// Images on triangles: which texels a point lies between, and how large a pixel is among them.
//
// The rules of the OpenGL 4.5 specification, 8.14: texels are squares whose values lie in their
// middles, and between levels of an image one goes by the logarithm of how many texels a pixel
// spans (Williams, "Pyramidal parametrics", 1983). How coordinates change from pixel to pixel is
// not taken from neighbours but from the triangle's plane, so that it is exact, and the same for
// whoever draws. In double only; TEXEL_NUMBER(from, at, channel) is a number of the at-th texel.
// What is asked beyond an image is held within where it becomes a place in memory, NaN too.

STRUCT(texel) {
    number channel[4]; // red, green, blue, alpha
};

// Of an image: what it has of columns and rows, and its first texel.
STRUCT(texture_level) {
    number columns;
    number rows;
    number first;
};

// The greatest integer that is not above x, for |x| below 2^51.
FN number whole_part(real x) {
    real shifted = x + K(6755399441055744.0); // 1.5 2^52, which leaves no room for a fraction
    real nearest = shifted - K(6755399441055744.0);
    return select(nearest > x, nearest - 1.0, nearest);
}

FN number within_period(real x, real period) {
    real share = x / period;
    real rest = x - period * whole_part(share);
    return rest;
}

// A coordinate where the image is, or next to it: in [0, 1], mirrored ones in [0, 2]. float32 has
// no fractions from far below 2^40 on.
FN number wrapped(int wrap, real u) {
    real near = clamp(u, K(-1099511627776.0), K(1099511627776.0));
    real place = clamp(near, K(0.0), K(1.0));
    if (wrap == WRAP_REPEAT) place = within_period(near, K(1.0));
    if (wrap == WRAP_MIRROR) place = within_period(near, K(2.0));
    return place;
}

// The column, of so many, that stands where the i-th would: i is a whole number in [-1, 2 columns].
FN number texel_place(int wrap, real i, real columns) {
    real place = i, last = columns - 1.0;
    if (wrap == WRAP_REPEAT) {
        place = select(place < 0.0, last, place);
        place = select(place > last, place - columns, place);
    }
    if (wrap == WRAP_MIRROR) {
        place = select(place < 0.0, K(0.0), place);
        place = select(place > last, (2.0 * columns - 1.0) - place, place);
    }
    return select(place > 0.0, min(place, last), K(0.0));
}

FN number between_texels(real a, real b, real share) {
    real mean = a + (b - a) * share; // equal ones stay what they are
    return mean;
}

FN texel nearest_texel(address from, texture_level l, int wrap_u, int wrap_v, real u, real v) {
    texel o;
    real across = wrapped(wrap_u, u) * l.columns, along = wrapped(wrap_v, v) * l.rows;
    real column = texel_place(wrap_u, whole_part(across), l.columns);
    real row = texel_place(wrap_v, whole_part(along), l.rows);
    real at = l.first + (row * l.columns + column);
    for (int k = 0; k < 4; ++k) o.channel[k] = TEXEL_NUMBER(from, at, k);
    return o;
}

FN texel bilinear_texel(address from, texture_level l, int wrap_u, int wrap_v, real u, real v) {
    PRECISE texel o;
    real across = wrapped(wrap_u, u) * l.columns - 0.5;
    real along = wrapped(wrap_v, v) * l.rows - 0.5;
    real column = whole_part(across), row = whole_part(along);
    real share_across = across - column, share_along = along - row;
    real left = texel_place(wrap_u, column, l.columns);
    real right = texel_place(wrap_u, column + 1.0, l.columns);
    real upper = texel_place(wrap_v, row, l.rows) * l.columns + l.first;
    real lower = texel_place(wrap_v, row + 1.0, l.rows) * l.columns + l.first;
    real upper_left = upper + left, upper_right = upper + right;
    real lower_left = lower + left, lower_right = lower + right;
    for (int k = 0; k < 4; ++k) {
        real above = between_texels(TEXEL_NUMBER(from, upper_left, k),
                                    TEXEL_NUMBER(from, upper_right, k), share_across);
        real below = between_texels(TEXEL_NUMBER(from, lower_left, k),
                                    TEXEL_NUMBER(from, lower_right, k), share_across);
        o.channel[k] = between_texels(above, below, share_along);
    }
    return o;
}

// How fast what is 0 at the first corner, and `second` and `third` at the others, changes along a
// line of the screen, where the corners' weights on the screen change by so much from pixel to
// pixel: the derivative of (N / z) / (1 / z), of which both are linear there.
FN number change_on_screen(surface_point p, real inverse_z[3], real second_step, real third_step,
                           real second, real third) {
    real here = second * p.second + third * p.third;
    real by_second = inverse_z[1] * second - (inverse_z[1] - inverse_z[0]) * here;
    real by_third = inverse_z[2] * third - (inverse_z[2] - inverse_z[0]) * here;
    real change = p.z * (second_step * by_second + third_step * by_third);
    return change;
}

// How many of an image's texels the step to the next pixel spans, squared; u, v: of the corners.
FN number square_of_span(surface_point p, real inverse_z[3], real second_step, real third_step,
                         real u[3], real v[3], real columns, real rows) {
    real x =
        columns * change_on_screen(p, inverse_z, second_step, third_step, u[1] - u[0], u[2] - u[0]);
    real y =
        rows * change_on_screen(p, inverse_z, second_step, third_step, v[1] - v[0], v[2] - v[0]);
    real square = x * x + y * y;
    return square;
}

// The level whose texels are as large as a pixel that spans so many of the image's, squared; not
// below 0. log2(4^n 2^k m) / 2 with m in [1, 2), whose logarithm is 2 atanh((m - 1) / (m + 1)).
FN number level_of_span(real square) {
    real rest = max(square, K(1.0)), n = K(0.0);
    for (int k = 1; k < MOST_TEXTURE_LEVELS; ++k) {
        truth more = rest >= 4.0;
        rest = select(more, 0.25 * rest, rest);
        n = select(more, n + 1.0, n);
    }
    truth more = rest >= 2.0;
    rest = select(more, 0.5 * rest, rest);
    n = select(more, n + 0.5, n);
    real s = (rest - 1.0) / (rest + 1.0);
    real square_of_s = s * s, series = K(0.0);
    for (int k = 15; k > 0; --k) series = square_of_s * (K(1.0 / (2 * k + 1)) + series);
    real level = n + K(1.4426950408889634) * (s + s * series);
    return level;
}

// The level-th of an image, or its last, of one texel: each has half the columns and rows of the
// one before, rounded down, and at least one.
FN texture_level texture_level_of(real columns, real rows, real level) {
    texture_level o;
    real c = columns, r = rows, first = K(0.0);
    real own_columns = columns, own_rows = rows, own_first = K(0.0);
    for (int k = 1; k < MOST_TEXTURE_LEVELS; ++k) {
        truth here = BOTH(level >= K(k), max(c, r) > 1.0);
        first = first + c * r;
        c = max(whole_part(0.5 * c), K(1.0));
        r = max(whole_part(0.5 * r), K(1.0));
        own_columns = select(here, c, own_columns);
        own_rows = select(here, r, own_rows);
        own_first = select(here, first, own_first);
    }
    o.columns = own_columns;
    o.rows = own_rows;
    o.first = own_first;
    return o;
}

// What an image is at (u, v), for a pixel that spans so many of its texels, squared.
FN texel texel_at(address from, int filtering, int wrap_u, int wrap_v, real columns, real rows,
                  real u, real v, real square) {
    PRECISE texel o;
    texture_level whole;
    whole.columns = columns;
    whole.rows = rows;
    whole.first = K(0.0);
    if (filtering == FILTER_NEAREST) o = nearest_texel(from, whole, wrap_u, wrap_v, u, v);
    if (filtering == FILTER_BILINEAR) o = bilinear_texel(from, whole, wrap_u, wrap_v, u, v);
    if (filtering == FILTER_MIPMAP) {
        real level = level_of_span(square);
        real below = whole_part(level);
        real share = level - below;
        texture_level larger = texture_level_of(columns, rows, below);
        texture_level smaller = texture_level_of(columns, rows, below + 1.0);
        o = bilinear_texel(from, larger, wrap_u, wrap_v, u, v);
        texel other = bilinear_texel(from, smaller, wrap_u, wrap_v, u, v);
        for (int k = 0; k < 4; ++k)
            o.channel[k] = between_texels(o.channel[k], other.channel[k], share);
    }
    return o;
}
