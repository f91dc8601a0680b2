// Complex numbers.

vec2 times(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }
vec2 conjugate(vec2 a) { return vec2(a.x, -a.y); }
vec2 inverse_of(vec2 a) { return conjugate(a) / dot(a, a); }
vec2 over(vec2 a, vec2 b) { return times(a, inverse_of(b)); }
vec2 square_root(vec2 a) {
    float size = length(a);
    vec2 root = sqrt(max(0.5 * vec2(size + a.x, size - a.x), 0.0));
    return vec2(root.x, a.y < 0.0 ? -root.y : root.y);
}
vec2 cube_root(vec2 a) {
    float angle = atan(a.y, a.x) / 3.0;
    return exp2(log2(dot(a, a)) / 6.0) * vec2(cos(angle), sin(angle));
}
// The roots of x^2 + p x + q
void quadratic_roots(vec2 p, vec2 q, out vec2 first, out vec2 second) {
    vec2 size = square_root(0.25 * times(p, p) - q);
    first = -0.5 * p - size;
    second = -0.5 * p + size;
}
// u and q of y^3 - 3 q y - 2 r: its roots are w u + q / (w u) for the three cube roots w of 1
vec2 cubic_part(vec2 q, vec2 r) {
    vec2 size = square_root(times(r, r) - times(q, times(q, q)));
    return cube_root(dot(r, size) < 0.0 ? r - size : r + size); // of two the greater
}
