// The roots of x^3 + 3 a x^2 + 3 b x + c, all of which are real (Blinn, How to Solve a Cubic
// Equation, part 5, 2007).
vec3 cubic_roots(float a, float b, float c) {
    // Its Hessian, whose discriminant tells of double roots without what a x^3 cancels
    float h0 = b - a * a, h1 = c - a * b, h2 = a * c - b * b;
    float discriminant = 4.0 * h0 * h2 - h1 * h1;
    float depressed = h1 - 2.0 * a * h0; // y^3 + 3 h0 y + depressed, y = x + a
    float angle = atan(sqrt(max(discriminant, 0.0)), -depressed) / 3.0;
    float size = 2.0 * sqrt(max(-h0, 0.0));
    float c0 = cos(angle), s0 = 0.8660254 * sin(angle);
    return size * vec3(c0, -0.5 * c0 - s0, -0.5 * c0 + s0) - a;
}
