// What a pixel keeps of six moments and of absorbance is added up as it is.
sums accumulate(float z, float alpha) {
    float a = absorbance(alpha), z2 = z * z, z4 = z2 * z2;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z4) * a;
    o.target1 = vec2(z4 * z, z4 * z2) * a;
    o.target2 = a;
    return o;
}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
#endif
