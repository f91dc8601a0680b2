// What a pixel keeps of four moments and of absorbance is added up as it is.
sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    sums o;
    o.target0 = powers_of(z) * a;
    o.target1 = a;
    return o;
}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
#endif
