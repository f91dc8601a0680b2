// A transmittance function that falls in steps: what is nearer than a depth dims it.

// What reaches depth z after a step at `depth`, behind which `through` is left of the light;
// `before` reaches z by the steps in front of that. Steps are taken from the nearest to the
// farthest. A step at z itself does not count.
FN number behind_step(real z, real depth, real through, real before) {
    return select(depth < z, through, before);
}
