// Haar wavelets of the absorbance in front of a depth.
//
// Aizenshtein, Smal and McGuire, "Wavelet Transparency", arXiv:2201.00094, 2022. The absorbance in
// front of x, A(x) = sum of s_i [x_i < x] for surfaces of absorbance s_i at x_i in [0, 1), is
// projected on the scaling function 1 and, on each of `levels` levels p, on 2^p wavelets
// 2^(p/2) (1 on the first half of interval k of 2^p, -1 on the second). A surface adds s times the
// integral of a function behind it: 1 - x, and for the one wavelet of each level that it lies in a
// tent. What the coefficients hold are the means of A over 2^levels cells, exactly; between them the
// answer runs straight. `levels` is the paper's rank plus one.
//
// Depth z in [0, 1] becomes x = z (1 - 1 / cells): the last cell then lies behind all surfaces but
// those at z = 1, and holds the total.

#define HAAR_MOST_LEVELS 5
#define HAAR_MOST_CELLS 32

STRUCT(haar_coefficients) {
    number c[HAAR_MOST_CELLS];
}; // scaling, then wavelet k of level p at 2^p + k
STRUCT(haar_cells) { number mean[HAAR_MOST_CELLS]; };
STRUCT(haar_place) { number cell, inside; }; // inside: [0, 1), how far in its cell
// What a surface adds to the scaling coefficient, and on each level to wavelet cell / 2^(levels - p).
STRUCT(haar_event) { number cell, scaling, wavelet[HAAR_MOST_LEVELS]; };

// The greatest integer that x in [0, 2^22) is not below.
FN number whole_below(real x) {
    real near = nearest_integer(x);
    return select(near > x, near - 1.0, near);
}

// 2^(level / 2) of a wavelet of that level.
FN number haar_height(const int level) {
    real height = K(1 << (level / 2));
    if (level % 2 == 1) height = height * K(1.4142135623730951);
    return height;
}

FN haar_place haar_place_of(const int levels, real z) {
    real x = z * K((1 << levels) - 1);
    haar_place place;
    place.cell = whole_below(x);
    place.inside = x - place.cell;
    return place;
}

// A surface of absorbance s at z in [0, 1].
FN haar_event haar_event_of(const int levels, real z, real s) {
    real x = z * K((1 << levels) - 1);
    haar_event e;
    e.cell = whole_below(x);
    real behind = 1.0 - x * K(1.0 / (1 << levels));
    e.scaling = behind * s;
    for (int p = 0; p < levels; ++p) {
        real y = x * K(1.0 / (1 << (levels - p)));
        real inside = y - whole_below(y);
        real tent = min(inside, 1.0 - inside) * haar_height(p) * K(1.0 / (1 << p));
        e.wavelet[p] = tent * s;
    }
    return e;
}

// The mean absorbance of each cell, from front to back. It grows from 0 to the last, the total;
// rounding of the coefficients is kept from making it do otherwise.
FN haar_cells haar_cells_of(const int levels, haar_coefficients stored) {
    haar_cells cells;
    cells.mean[0] = stored.c[0];
    for (int p = 0; p < levels; ++p) {
        for (int k = (1 << p) - 1; k >= 0; --k) {
            real mean = cells.mean[k];
            real apart = haar_height(p) * stored.c[(1 << p) + k];
            cells.mean[2 * k] = mean - apart;
            cells.mean[2 * k + 1] = mean + apart;
        }
    }
    real total = cells.mean[(1 << levels) - 1];
    real least = K(0.0);
    for (int k = 0; k < 1 << levels; ++k) {
        least = clamp(cells.mean[k], least, total);
        cells.mean[k] = least;
    }
    return cells;
}

// The light that reaches a place `inside` a cell of mean `own_cell`, the one before it having
// mean `before` (0 for the first). own: absorbance of the surface there that does not occlude
// itself, or 0; of it, 1 - inside lies in its cell's mean.
FN number haar_transmittance(real before, real own_cell, real inside, real own) {
    real absorbed = min(before + (own_cell - before) * inside, own_cell);
    real by_itself = own * (1.0 - inside) * inside;
    real by_others = max(absorbed - by_itself, K(0.0));
    return exponential(-by_others);
}
