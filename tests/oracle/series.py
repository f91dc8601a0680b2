"""Fourier opacity maps and transmittance function maps by their definitions, in float64.

Jansen and Bavoil 2010; Delalandre et al. 2011. One pixel: depths d in [0, 1], any order.
"""

import numpy as np


def fourier(absorbance, d, coefficients):
    """The paper's a_0, then a_k and b_k in turn."""
    k = np.arange(1, (coefficients - 1) // 2 + 1)[:, None]
    a = 2 * (absorbance * np.cos(2 * np.pi * k * d)).sum(axis=1)
    b = 2 * (absorbance * np.sin(2 * np.pi * k * d)).sum(axis=1)
    return np.concatenate([[2 * absorbance.sum()], np.stack([a, b], axis=1).ravel()])


def fourier_absorbance(series, d):
    """The integral of the density from 0 to each d, as it is: it may be negative."""
    k = np.arange(1, len(series) // 2 + 1)
    angle = 2 * np.pi * np.multiply.outer(d, k)
    waves = series[1::2] * np.sin(angle) + series[2::2] * (1 - np.cos(angle))
    return series[0] / 2 * d + (waves / (2 * np.pi * k)).sum(axis=-1)


def fourier_transmittance(series, d, own=0.0):
    """own : absorbance of the surface at d, which does not occlude itself; () or as d."""
    d, own = np.broadcast_arrays(np.asarray(d, float), own)
    surfaces = zip(own.ravel(), d.ravel(), strict=True)
    alone = [fourier_absorbance(fourier(o, x, len(series)), x) for o, x in surfaces]
    in_front = fourier_absorbance(series, d) - np.reshape(alone, d.shape)
    return np.exp(-np.clip(in_front, 0, np.maximum(series[0] / 2 - own, 0)))


def steps(alpha, d):
    """Exact transmittance in front of each surface, and the total."""
    T = np.array([np.prod(1 - alpha[d < x]) for x in d])
    return T, np.prod(1 - alpha)


def basis(n, d):
    """(n, *d.shape) orthonormal cosines."""
    k = np.arange(n).reshape(-1, *[1] * np.ndim(d))
    return np.where(k == 0, 1.0, np.sqrt(2)) * np.cos(np.pi * k * d)


def projection(alpha, d, n):
    """The inner products of the step function with the basis: integrals piece by piece."""
    order = np.argsort(d)
    ends = np.concatenate([[0], d[order], [1]])
    levels = np.concatenate([[1], np.cumprod(1 - alpha[order])])
    c = np.empty(n)
    for k in range(n):
        antiderivative = np.sqrt(2) * np.sin(np.pi * k * ends) / (np.pi * k) if k else ends
        c[k] = (levels * np.diff(antiderivative)).sum()
    return c


def function(c, d):
    """The sum of cosines, as it is: it may leave [0, 1]."""
    return np.tensordot(c, basis(len(c), d), 1)
