"""Rays on which reconstructions go wrong, by kind, each from a seed.

Depths are float32 in [-1, 1] and alphas float32, so both precisions see the same numbers.
Arrival order is random.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

Rng = np.random.Generator
MAX_ALPHA = 1 - 0.5 / 256


class HardRay(NamedTuple):
    kind: str
    depth: np.ndarray
    alpha: np.ndarray


def _random(rng: Rng):
    n = rng.integers(2, 60)
    return rng.uniform(-1, 1, n), rng.uniform(0.02, 0.97, n)


def _low_alpha(rng: Rng):
    n = rng.integers(2, 64)
    return rng.uniform(-1, 1, n), rng.uniform(1e-4, 0.02, n)


def _clusters(rng: Rng):
    centre = rng.uniform(-0.9, 0.9, rng.integers(1, 5))
    n = rng.integers(4, 64)
    spread = 10 ** rng.uniform(-4, -1)
    return rng.choice(centre, n) + spread * rng.normal(size=n), rng.uniform(0.05, 0.9, n)


def _near_pair(rng: Rng):
    z = rng.uniform(-0.9, 0.9)
    gap = 10 ** rng.uniform(-6, -2)
    others = rng.uniform(-1, 1, rng.integers(0, 4))
    depth = np.concatenate([[z, z + gap], others])
    return depth, rng.uniform(0.1, 0.95, depth.size)


def _single(rng: Rng):
    return rng.uniform(-1, 1, 1), rng.uniform(0.001, MAX_ALPHA, 1)


def _same_depth(rng: Rng):
    n = rng.integers(2, 60)
    return np.full(n, rng.uniform(-1, 1)), rng.uniform(0.01, 0.9, n)


def _many_layers(rng: Rng):
    n = rng.integers(500, 1001)
    return rng.uniform(-1, 1, n), rng.uniform(0.001, rng.choice([0.02, 0.5]), n)


def _max_alpha(rng: Rng):
    n = rng.integers(1, 20)
    return rng.uniform(-1, 1, n), np.where(rng.random(n) < 0.7, MAX_ALPHA, rng.random(n) * 0.9)


def _alpha_1e_3(rng: Rng):
    n = rng.integers(1, 64)
    return rng.uniform(-1, 1, n), np.full(n, 1e-3)


def _few_surfaces(rng: Rng):
    n = rng.integers(2, 6)
    slot = rng.choice(16, n, replace=False)  # at least .05 of the range apart
    return (slot + rng.uniform(0.1, 0.5, n)) / 8 - 1, rng.uniform(0.1, 0.95, n)


def _end_points(rng: Rng):
    inside = rng.uniform(-1, 1, rng.integers(0, 10))
    ends = rng.choice([-1.0, 1.0], rng.integers(1, 5))
    depth = np.concatenate([ends, inside])
    return depth, rng.uniform(0.05, 0.95, depth.size)


def _symmetric(rng: Rng):
    half = rng.uniform(0.01, 1, rng.integers(1, 5))
    alpha = rng.uniform(0.05, 0.95, half.size)
    middle = rng.integers(0, 2)
    depth = np.concatenate([half, -half, np.zeros(middle)])
    return depth, np.concatenate([alpha, alpha, rng.uniform(0.05, 0.9, middle)])


def _smoke_and_surfaces(rng: Rng):
    smoke = rng.integers(15, 60)
    surfaces = rng.integers(1, 6)
    depth = [rng.normal(rng.uniform(-0.5, 0.5), 0.2, smoke), rng.uniform(-1, 1, surfaces)]
    alpha = [rng.uniform(0.01, 0.08, smoke), rng.uniform(0.2, 0.95, surfaces)]
    return np.concatenate(depth), np.concatenate(alpha)


def _two_far_clusters(rng: Rng):
    near, far = rng.integers(1, 20, 2)
    spread = 10 ** rng.uniform(-5, -2)
    centre = np.concatenate([np.full(near, -0.97), np.full(far, 0.97)])
    return centre + spread * rng.uniform(-1, 1, centre.size), rng.uniform(0.05, 0.9, centre.size)


def _equally_spaced(rng: Rng):
    n = rng.integers(2, 33)
    return np.linspace(-1, 1, n), np.full(n, rng.uniform(0.05, 0.9))


KINDS: dict[str, Callable[[Rng], tuple[np.ndarray, np.ndarray]]] = {
    "random": _random,
    "low alpha": _low_alpha,
    "clusters": _clusters,
    "near pair": _near_pair,
    "single": _single,
    "same depth": _same_depth,
    "500 to 1000 layers": _many_layers,
    "alpha at its maximum": _max_alpha,
    "alpha 1e-3": _alpha_1e_3,
    "few surfaces": _few_surfaces,
    "end points": _end_points,
    "symmetric about 0": _symmetric,
    "smoke and surfaces": _smoke_and_surfaces,
    "two far clusters": _two_far_clusters,
    "equally spaced": _equally_spaced,
}


def hard_rays(seed: int, of_each_kind: int, kinds: Iterable[str] = tuple(KINDS)) -> list[HardRay]:
    """`of_each_kind` rays of every kind; the same for the same seed."""
    rays = []
    for kind in kinds:
        for number in range(of_each_kind):
            rng = np.random.default_rng([seed, list(KINDS).index(kind), number])
            depth, alpha = KINDS[kind](rng)
            order = rng.permutation(len(depth))
            depth = np.clip(depth, -1, 1).astype(np.float32)[order]
            rays.append(HardRay(kind, depth, alpha.astype(np.float32)[order]))
    return rays


def depths_to_ask(ray: HardRay, seed: int, count: int) -> np.ndarray:
    """Depths where curves are steep: at fragments, just beside them, at ends, and anywhere."""
    rng = np.random.default_rng([seed, len(ray.depth)])
    at = rng.choice(ray.depth, count)
    beside = rng.choice([-1, 1], count) * 10 ** rng.uniform(-6, -1, count)
    choice = rng.choice(5, count, p=[0.4, 0.3, 0.2, 0.05, 0.05])
    asked = np.select(
        [choice == 0, choice == 1, choice == 2, choice == 3],
        [at, at + beside, rng.uniform(-1, 1, count), rng.choice([-1.0, 1.0], count)],
        0.0,
    )
    return np.clip(asked, -1, 1).astype(np.float32)


def flat(rays: Iterable[HardRay]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """offsets, depth and alpha of rays as the pixels of one image."""
    rays = list(rays)
    offsets = np.cumsum([0, *(len(ray.depth) for ray in rays)])
    depth = np.concatenate([ray.depth for ray in rays])
    return offsets, depth, np.concatenate([ray.alpha for ray in rays])
