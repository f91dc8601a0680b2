// What a pixel shows of colours and of what is let through, which shading has added up.
vec4 resolve_color(sums s) {
    float coverage = 1.0 - s.target1;
#if NORMALIZE
    return vec4(s.target0.rgb * (coverage / max(s.target0.a, 1e-30)), coverage);
#else
    return vec4(s.target0.rgb, coverage);
#endif
}
