// Slices of optical depth along the ray, as whole numbers that add up.
//
// Ours, from the storage of Drobot, "Adaptive Voxel-Based Order-Independent Transparency", SIGGRAPH
// 2025 (AVBOIT): depth in [0, 1] is cut into cells, and where anything is, a run of cells has
// slices at their borders. A fragment of code c, its optical depth in steps of a quantum, at
// `inside` of its cell adds c (1 - inside) to the slice at the cell's front and the rest to that at
// its back.
//
// What lies in front of a fragment is read in the middle of slices. With C[j] the sum of all slices
// before j, m[j] = (C[j] + C[j + 1]) / 2, and a fragment between the slices j and j + 1 reads
//
//   (1 - inside) m[j] + inside m[j + 1] = (C[j] + C[j + 1] + inside (C[j + 2] - C[j])) / 2
//
// of which its own share is (near + inside code) / 2: without rounding c / 2 wherever it lies.
// Taken out, a fragment does not occlude itself, no shift by slices is needed, coincident ones
// share evenly, and what is two slices away counts exactly. All sums are of whole numbers: the same
// in any order.

// Depth z of [0, 1] as one of so many cells, and how far in it, [0, 1].
STRUCT(slice_place) { number cell, inside; };

FN slice_place slice_place_of(real z, real cells) {
    real x = within(z * cells, cells);
    slice_place place;
    place.cell = min(whole_below(x), cells - 1.0);
    place.inside = x - place.cell;
    return place;
}

// What is to be added before a code's fraction is dropped, in (0, 1): of 8 x 8 pixels each has its
// own (Bayer's order), so that thin layers count right in the mean; cells have others, or what one
// layer loses in a pixel all would. All digits are exact.
FN number slice_threshold(uint row, uint column, real cell) {
    uint turned = row ^ column;
    uint order = ((turned & 1u) << 5) | ((row & 1u) << 4) | ((turned & 2u) << 2) | ((row & 2u) << 1)
                 | ((turned & 4u) >> 1) | ((row & 4u) >> 2);
    real start = share_of(order << 26) + K(0.0078125);
    real turns = start + cell * K(0.62109375); // 159 / 256: near the golden section
    real threshold = turns - whole_below(turns);
    return threshold;
}

// Optical depth in steps, `scale` of them to one; `most` is the largest code.
FN number slice_code(real absorbance, real scale, real most, real threshold) {
    real steps = within(absorbance * scale, most);
    real code = min(whole_below(steps + threshold), most);
    return code;
}

// Cells may be joined: how far in the joined one, which begins so many cells before this.
FN number slice_joined(real inside, real from, real share) {
    real x = (inside + from) * share;
    return min(x, K(1.0));
}

// What the slice at the cell's front gets of a code.
FN number slice_near(real code, real inside) {
    real near = code - code * inside;
    return nearest_integer(near);
}

// Twice what is in front of a place, in steps.
FN number slice_depth(real before, real at, real behind, real inside) {
    real twice = (before + at) + inside * (behind - before);
    return twice;
}

// Twice what a fragment has added to that itself.
FN number slice_own(real near, real code, real inside) {
    real twice = near + inside * code;
    return twice;
}

// The optical depth of others in front of a fragment; half_step: half of one.
FN number slice_absorbance(real twice, real own, real half_step) {
    real others = max(twice - own, K(0.0)) * half_step;
    return others;
}

// The same where slices are of a block of pixels, with the total `low`, and the pixel has a total
// of its own: the block's is scaled to that. A fragment in the block counts among what is in front
// of it by half, wherever it lies.
FN number block_absorbance(real twice, real half_step, real low, real total, real own) {
    real scale = select(low > 0.0, total / low, K(0.0));
    real in_front = twice * half_step * scale - 0.5 * own;
    real most = max(total - own, K(0.0));
    return clamp(in_front, K(0.0), most);
}

// Optical depth in steps of 1 / 65536, in which pixels keep a total of their own.
FN number fine_code(real absorbance) {
    real steps = absorbance * 65536.0;
    return nearest_integer(steps);
}

// As published: optical depth of fragments is added to slices of a smaller picture, each
// fragment's to the two around it, rounded to codes of 8 or 16 bits. Summed up from front to
// back it is the light behind each slice, which fragments read some slices nearer than they are:
// what they have added themselves is not to dim them.

// The code of a share of optical depth, `scale` steps to one.
FN number voxel_code(real absorbance, real scale, real most) {
    real steps = within(absorbance * scale, most);
    return nearest_integer(steps);
}

// Light at a place `inside` between two slices, from steps of 255; all of it where z is below 0.
FN number voxel_light(real z, real first, real second, real inside) {
    real steps = first + (second - first) * inside;
    real light = steps * K(1.0 / 255.0);
    return select(z < 0.0, K(1.0), light);
}

// The same by a cubic B-spline of four slices, the place between the second and the third.
FN number voxel_cubic_light(real z, real before, real first, real second, real behind,
                            real inside) {
    real rest = 1.0 - inside;
    real outer = rest * rest * rest * before + inside * inside * inside * behind;
    real inner = (K(4.0) - inside * inside * (K(6.0) - 3.0 * inside)) * first
                 + (K(4.0) - rest * rest * (K(6.0) - 3.0 * rest)) * second;
    real light = min((outer + inner) * K(1.0 / 1530.0), K(1.0)); // 6 times 255 steps
    return select(z < 0.0, K(1.0), light);
}
