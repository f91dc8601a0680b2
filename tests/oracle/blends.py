"""What the simple techniques do, one pixel at a time in NumPy float64, from their papers.

Each takes depth (n,), alpha (n,) and color (n, 3) of a pixel in arrival order and returns
(T, total): what each fragment's alpha c is multiplied by, and what the background is multiplied by.
"""

from collections.abc import Callable

import numpy as np

Blend = tuple[np.ndarray, float]


def image(T: np.ndarray, total: float, alpha, color, background) -> np.ndarray:
    """(4,) sum of alpha T c plus what is left of the background, and coverage."""
    rgb = (np.asarray(alpha) * T) @ np.asarray(color).reshape(-1, 3) + total * np.asarray(
        background
    )
    return np.array([*rgb, 1 - total])


def in_order(order, alpha) -> Blend:
    """Over, with the first of `order` in front."""
    T = np.ones(len(alpha))
    left = 1.0
    for i in order:
        T[i] = left
        left *= 1 - alpha[i]
    return T, left


def front_to_back(depth, alpha, color) -> Blend:
    """Sorted by depth, the earlier to arrive in front where depths are equal."""
    return in_order(np.argsort(depth, kind="stable"), alpha)


def in_arrival_order(depth, alpha, color) -> Blend:
    """Each fragment over those that arrived before it."""
    return in_order(range(len(alpha))[::-1], alpha)


def weighted_sum(depth, alpha, color) -> Blend:
    """Meshkin 2007: products of alphas are left out."""
    return np.ones(len(alpha)), 1 - alpha.sum()


def weighted_average(depth, alpha, color) -> Blend:
    """Bavoil and Myers 2008: n layers of the mean alpha in the mean colour, weighted by alpha."""
    n, total_alpha = len(alpha), alpha.sum()
    left = (1 - total_alpha / n) ** n if n else 1.0
    factor = (1 - left) / total_alpha if total_alpha else 1.0
    return np.full(n, factor), left


def weighted_blended(weight: Callable) -> Callable[..., Blend]:
    """McGuire and Bavoil 2013 with weight(depth, alpha, color) -> (n,)."""

    def blend(depth, alpha, color) -> Blend:
        left = np.prod(1 - alpha)
        w = weight(depth, alpha, color)
        weights = (alpha * w).sum()
        return (w * (1 - left) / weights if weights else np.ones(len(alpha))), left

    return blend


def weight(name: str, near: float, far: float, scale: float = 1.0):
    """The weights of WBOIT (eqs 7 to 10), of its author's post and of phenomenological use."""

    def buffered(z):  # what a depth buffer holds
        return np.clip(far * (z - near) / (z * (far - near)), 0, 1) if near < far else 0 * z

    def eq7(z, a, c):
        return a * np.clip(10 / (1e-5 + (z / 5) ** 2 + (z / 200) ** 6), 1e-2, 3e3)

    def eq8(z, a, c):
        return a * np.clip(10 / (1e-5 + (z / 10) ** 3 + (z / 200) ** 6), 1e-2, 3e3)

    def fall(z):
        return np.clip(0.03 / (1e-5 + (z / 200) ** 4), 1e-2, 3e3)

    def eq9(z, a, c):
        return a * fall(z)

    def blog(z, a, c):
        return np.maximum(np.minimum(1, c.max(axis=1) * a), a) * fall(z)

    def eq10(depth, a, c):
        return a * np.maximum(1e-2, 3e3 * (1 - buffered(depth)) ** 3)

    def phenomenological(depth, a, c):
        front = 1 - 0.9 * buffered(depth)
        return np.clip((np.minimum(1, 10 * a) + 0.01) ** 3 * 1e8 * front**3, 1e-2, 3e3)

    scaled = {"eq7": eq7, "eq8": eq8, "eq9": eq9, "blog": blog}
    if name in scaled:
        return lambda depth, alpha, color: scaled[name](depth * scale, alpha, color)
    return {"eq10": eq10, "phenomenological": phenomenological}[name]


def culled(blend, depth, alpha, color, background):
    """(T, total, image) with the nearest opaque fragment taken for the background.

    What lies behind it and other opaque fragments at its depth get T 0; so does the background.
    """
    n = len(alpha)
    opaque = np.flatnonzero(alpha == 1)
    if not len(opaque):
        T, total = blend(depth, alpha, color)
        return T, total, image(T, total, alpha, color, background)
    first = opaque[np.argmin(depth[opaque])]
    front = (depth < depth[first]) | ((depth == depth[first]) & (alpha < 1))
    T = np.zeros(n)
    T[front], total = blend(depth[front], alpha[front], color[front])
    found = image(T[front], total, alpha[front], color[front], color[first])
    found[3] = 1
    T[first] = np.nan  # what a technique says of the surface itself is its own affair
    return T, 0.0, found
