"""Rays with different numbers of samples, which frameworks are asked about."""

import numpy as np

ENDS = (0, 3, 3, 8)
NAMES = ("depth", "alpha", "color", "transmission", "background")
# whose derivatives differences in doubles can see: with more bias than the default
TECHNIQUES = ("sorted", "wboit", "power4(bias=1e-3,exclude_self=True)")
TECHNIQUES += ("power4(resolution=2,total='full',bias=1e-3)",)  # rays are a row of pixels
QUESTIONS = {
    "composite": NAMES,
    "transmittance": NAMES[:4],
    "total_transmittance": NAMES[:4],
}


def numbers(dtype=np.float64):
    rng = np.random.default_rng(1)
    n, rays = ENDS[-1], len(ENDS) - 1
    sizes = ((n,), (n,), (n, 3), (n, 3), (rays, 3))
    drawn = [rng.uniform(0.05, 0.8, size).astype(dtype) for size in sizes]
    drawn[0] = 1 + 6 * drawn[0]
    return dict(zip(NAMES, drawn, strict=True))
