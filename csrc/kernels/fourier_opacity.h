// Fourier opacity maps: the absorbance in front of a depth as the integral of a Fourier series.
//
// Jansen and Bavoil, "Fourier Opacity Mapping", I3D 2010. Surfaces at depths d in [0, 1] with
// absorbances A are a density of absorbance along the ray; its series is cut off after n harmonics:
//     a_k = 2 sum of A cos(2 pi k d),   b_k = 2 sum of A sin(2 pi k d)
//     -ln T(d) = a_0 d / 2 + sum over k = 1 .. n of
//                a_k / (2 pi k) sin(2 pi k d) + b_k / (2 pi k) (1 - cos(2 pi k d)).
// Kept here are the halves of a_k and b_k: sums alone, which half floats round as they would those.

#ifndef MOIT_FOURIER_OPACITY_H
#define MOIT_FOURIER_OPACITY_H

#define MOST_HARMONICS 15

// Half of a_0, a_1 .., and b_1 ..; what one surface adds to them, or all.
STRUCT(fourier_series) {
    number mean;
    number cosine[MOST_HARMONICS];
    number sine[MOST_HARMONICS];
};

// What a surface of absorbance `weight` at d adds.
FN fourier_series series_of_surface(int harmonics, real weight, real d) {
    PRECISE fourier_series s;
    circle_point once = sine_cosine(d);
    circle_point p = once;
    s.mean = weight;
    for (int k = 0; k < harmonics; ++k) {
        s.cosine[k] = weight * p.cosine;
        s.sine[k] = weight * p.sine;
        p = turned(p, once);
    }
    return s;
}

// The factors of sin(2 pi k d) and 1 - cos(2 pi k d) in the integral of the density.
FN fourier_series integrated(int harmonics, fourier_series density) {
    PRECISE fourier_series s;
    s.mean = density.mean;
    for (int k = 0; k < harmonics; ++k) {
        s.cosine[k] = density.cosine[k] * (K(0.31830988618379067154) / K(k + 1));
        s.sine[k] = density.sine[k] * (K(0.31830988618379067154) / K(k + 1));
    }
    return s;
}

// The absorbance in front of d from an integrated series, within [0, total]: a series cut off
// overshoots at steps. `own` is the absorbance of the surface that asks, of which the series has
// about half in front of d: that much exactly is taken out again; 0 as published. An empty ray
// gives 0.
FN number series_absorbance(int harmonics, fourier_series integral, real d, real own) {
    circle_point once = sine_cosine(d);
    circle_point p = once;
    real in_front = integral.mean * d;
    real own_share = d;
    for (int k = 0; k < harmonics; ++k) {
        in_front = in_front + (integral.cosine[k] * p.sine + integral.sine[k] * (1.0 - p.cosine));
        own_share = own_share + p.sine * (K(0.31830988618379067154) / K(k + 1));
        p = turned(p, once);
    }
    in_front = clamp(in_front - own * own_share, K(0.0), max(integral.mean - own, K(0.0)));
    return select(integral.mean > 0.0, in_front, K(0.0));
}

// The transmittance there.
FN number series_transmittance(int harmonics, fourier_series integral, real d, real own) {
    real in_front = series_absorbance(harmonics, integral, d, own);
    return exponential(-in_front);
}

#endif
