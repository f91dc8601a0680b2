// What a pixel shows of colours, and of what is let through, which shading has multiplied up.
vec4 resolve(vec4 shaded_sum, float let_through) {
    float coverage = 1.0 - let_through;
#if NORMALIZE
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
#else
    return vec4(shaded_sum.rgb, coverage);
#endif
}
