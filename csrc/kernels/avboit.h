// Adaptive voxel-based transparency.
//
// Drobot, "Adaptive Voxel-Based Order-Independent Transparency", SIGGRAPH 2025 course Advances in
// Real-Time Rendering in Games. Optical depth of fragments is added to slices of a smaller picture,
// each fragment's to the two around it, rounded to codes of 8 or 16 bits. Summed up from front to
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
