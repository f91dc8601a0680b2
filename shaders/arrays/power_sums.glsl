// Means of powers of depth of a pixel's first n terms (arrays/terms.glsl).
void gather(uint p, uint n) {
    precise kept_sum sum[NUMBERS + 1][4];
    for (int k = 0; k <= NUMBERS; ++k)
        for (int lane = 0; lane < 4; ++lane) sum[k][lane] = nothing_kept();
    for (uint i = 0u; i < n; i += 4u)
        for (uint lane = 0u; lane < 4u; ++lane) { // as C's lanes add up
            bool there = i + lane < n;
            moment_term t = term_of(p, there ? i + lane : i);
            precise double power = there ? t.absorbed : 0.0lf;
            precise double z = there ? t.z : 0.0lf;
            sum[0][lane] = kept_with(sum[0][lane], power);
            for (int k = 1; k <= NUMBERS; ++k) {
                power = power * z;
                sum[k][lane] = kept_with(sum[k][lane], power);
            }
        }
    precise double total = total_kept(sum[0][0], sum[0][1], sum[0][2], sum[0][3]);
    precise double inverse = inverse_of_sum(total);
    for (int k = 1; k <= NUMBERS; ++k) {
        precise double all = total_kept(sum[k][0], sum[k][1], sum[k][2], sum[k][3]);
        precise double mean = all * inverse;
        mean_gathered[k - 1] = mean;
    }
    total_gathered = total;
}
