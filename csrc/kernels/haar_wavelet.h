// Haar wavelets of the absorbance in front of a depth.
//
// Aizenshtein, Smal and McGuire, "Wavelet Transparency", arXiv:2201.00094, 2022. The absorbance in
// front of x, A(x) = sum of s_i [x_i < x] for surfaces of absorbance s_i at x_i in [0, 1), is
// projected on the scaling function 1 and, on each of `levels` levels p, on 2^p wavelets 2^(p/2) (1
// on the first half of interval k of 2^p, -1 on the second). A surface adds s times the integral of
// a function behind it: 1 - x, and for the one wavelet of each level that it lies in a tent. What
// the coefficients hold are the means of A over 2^levels cells, exactly; between them the answer
// runs straight. `levels` is the paper's rank plus one.
//
// Depth z in [0, 1] becomes x = z (1 - 1 / cells): the last cell then lies behind all surfaces but
// those at z = 1, and holds the total.
//
// With `density`, ours: the series is that of A's derivative, impulses of size s at x = z. Its
// integral is exact at the ends of all cells and runs straight between them, where the published
// series, a mean taken over a cell and reached at the end of it, is late by a cell.

#define HAAR_MOST_LEVELS 5
#define HAAR_MOST_CELLS 32

STRUCT(haar_coefficients) {
    number c[HAAR_MOST_CELLS];
}; // scaling, then wavelet k of level p at 2^p + k
STRUCT(haar_cells) { number end[HAAR_MOST_CELLS]; };
STRUCT(haar_place) { number cell, inside; }; // inside: [0, 1], how far in its cell
// What a surface adds to the scaling coefficient, and on each level to wavelet cell / 2^(levels -
// p).
STRUCT(haar_event) { number cell, scaling, wavelet[HAAR_MOST_LEVELS]; };

// 2^(level / 2) of a wavelet of that level.
FN number haar_height(const int level) {
    real height = K(1 << (level / 2));
    if (level % 2 == 1) height = height * K(1.4142135623730951);
    return height;
}

FN haar_place haar_place_of(const int levels, const int density, real z) {
    const int cells = 1 << levels;
    real x = within(z * K(cells - 1 + density), K(cells));
    haar_place place;
    place.cell = min(whole_below(x), K(cells - 1));
    place.inside = x - place.cell;
    return place;
}

// A surface of absorbance s at z in [0, 1].
FN haar_event haar_event_of(const int levels, const int density, real z, real s) {
    haar_place place = haar_place_of(levels, density, z);
    real x = place.cell + place.inside;
    haar_event e;
    e.cell = place.cell;
    real behind = 1.0 - x * K(1.0 / (1 << levels));
    if (density == 1) behind = K(1.0);
    e.scaling = behind * s;
    for (int p = 0; p < levels; ++p) {
        real width = K(1.0 / (1 << (levels - p)));
        real inside = x * width - whole_below(place.cell * width);
        real integral = min(inside, 1.0 - inside) * K(1.0 / (1 << p)); // minus that in front
        if (density == 1) integral = select(inside < 0.5, K(-1.0), K(1.0));
        real addend = integral * haar_height(p);
        e.wavelet[p] = addend * s;
    }
    return e;
}

// The absorbance that answers start from and go to in each cell, `end` its far end; it grows from
// front to back to the last, the total. Rounding of the coefficients is kept from making it do
// otherwise.
FN haar_cells haar_cells_of(const int levels, const int density, haar_coefficients stored) {
    const int count = 1 << levels;
    haar_cells cells;
    cells.end[0] = stored.c[0];
    for (int p = 0; p < levels; ++p) {
        for (int k = (1 << p) - 1; k >= 0; --k) {
            real mean = cells.end[k];
            real apart = haar_height(p) * stored.c[(1 << p) + k];
            cells.end[2 * k] = mean - apart;
            cells.end[2 * k + 1] = mean + apart;
        }
    }
    real total = cells.end[count - 1];
    if (density == 1) total = stored.c[0];
    real least = K(0.0);
    for (int k = 0; k < count; ++k) {
        real end = cells.end[k];
        if (density == 1) end = least + end * K(1.0 / count);
        least = clamp(end, least, total);
        cells.end[k] = least;
    }
    cells.end[count - 1] = total;
    return cells;
}

// The absorbance in front of a place `inside` a cell that ends with the absorbance `end`, the one
// before it with `start` (0 in front of the first). own: absorbance of the surface there that does
// not occlude itself, or 0.
FN number haar_absorbance(const int density, real start, real end, real inside, real own) {
    real absorbed = min(start + (end - start) * inside, end);
    real share = inside * (1.0 - inside); // the rest of its cell is behind it, in the mean
    if (density == 1) share = inside;
    real by_others = max(absorbed - own * share, K(0.0));
    return by_others;
}

// The light that reaches it.
FN number haar_transmittance(const int density, real start, real end, real inside, real own) {
    real by_others = haar_absorbance(density, start, end, inside, own);
    return exponential(-by_others);
}
