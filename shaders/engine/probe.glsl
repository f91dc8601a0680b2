// What fma loses of x x: 0 for x = 1 + 2^-12, read from a buffer or an attribute so that no
// compiler knows it, where fma rounds twice. Then a program defines NOT_FUSED as 1.
float lost_by_fma(float x) {
    precise float square = x * x, lost = fma(x, x, -square);
    return lost;
}
