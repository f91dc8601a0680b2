// A triangle's pixels: where on it each lies, how far it is, and how light falls on it.
//
// Perspective-correct interpolation as in Blinn, "Hyperbolic Interpolation", 1992: what is linear
// on the surface, divided by z, is linear on the screen, and so is 1/z. Light follows Lambert's
// law, on both sides of a surface; it comes from the upper left behind the eye, and some from
// everywhere.

// A point of a triangle: the weights of its second and third corner, and z.
STRUCT(surface_point) {
    number second;
    number third;
    number z;
};

// From the point's weights on the screen, of which the first is 1 - second - third, and 1/z of the
// three corners.
FN surface_point point_of_surface(real second, real third, real inverse_z[3]) {
    PRECISE surface_point o;
    real first = (1.0 - second) - third;
    real near = first * inverse_z[0] + second * inverse_z[1] + third * inverse_z[2];
    o.z = 1.0 / near;
    o.second = second * inverse_z[1] * o.z;
    o.third = third * inverse_z[2] * o.z;
    return o;
}

// What has the value a at the first corner, b and c at the others. Equal values stay what they are.
FN number interpolated(surface_point p, real a, real b, real c) {
    real between = a + ((b - a) * p.second + (c - a) * p.third);
    return between;
}

// The cosine of the angle under which light that travels along `light`, of length 1, meets a
// surface whose normal (not of unit length) is n, seen along (right, up, 1); x to the right, y up,
// z away from the eye. 0 from behind what is seen.
FN number facing_light(real n[3], real right, real up, real light[3]) {
    real facing = n[0] * right + n[1] * up + n[2]; // positive: seen from behind
    real size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    real along =
        light[0] * n[0] + light[1] * n[1] + light[2] * n[2]; // minus the cosine, times size
    real cosine = select(facing > 0.0, along, -along) / max(size, K(1e-30));
    real share = clamp(cosine, K(0.0), K(1.0));
    return share;
}

// The share of light that a surface throws back of which so much comes from shadowing.
FN number thrown_back(real share) {
    real light = K(0.25) + K(0.75) * share;
    return light;
}

// The same in the light from the upper left. In [.25, 1].
FN number lambert(real n[3], real right, real up) {
    real light[3];
    light[0] = K(0.48);
    light[1] = K(-0.64);
    light[2] = K(0.6);
    return thrown_back(facing_light(n, right, up, light));
}
