// Splats: ellipsoids whose opacity falls off as a Gaussian does, on the screen or along the ray
// (Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering", 2023; Hahlbohm
// et al., "Efficient Perspective-Correct 3D Gaussian Splatting Using Hybrid Transparency", 2025).

// What has less opacity than 1/255 is not there, and none has more than .99: numbers of the
// reference rasteriser of 3D Gaussian Splatting. So is this: a fragment that would leave less is
// not there either, nor is any behind it.
#define LEAST_SEEN 1e-4

// c[0] x^2 + c[1] x y + c[2] y^2
FN number square_of_splat(real x, real y, real c[3]) {
    real value = (c[0] * x * x + c[2] * y * y) + c[1] * x * y;
    return value;
}

// The opacity at a distance (in deviations, squared) from the middle; 0 for what is not there.
FN number alpha_of_splat(real square, real opacity) {
    real least = max(square, K(0.0));
    real alpha = min(opacity * exponential(K(-0.5) * least), K(0.99));
    return select(BOTH(alpha >= K(1.0 / 255.0), square == square), alpha, K(0.0));
}
