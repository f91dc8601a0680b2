"""Moments of hard rays with the exact answers that belong to them."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from . import power, rays, trigonometric
from .hard_rays import HardRay, depths_to_ask, hard_rays


class Problems(NamedTuple):
    """float32 moments of P rays, K depths for each, and what is exact for just these moments."""

    rays: list[HardRay]
    b0: np.ndarray  # (P,) float32
    b: np.ndarray  # (P, m) float32, or complex64
    z: np.ndarray  # (P, K) float32
    lower: np.ndarray  # (P, K) share of b0 in front of z, with the published bias
    weight: np.ndarray  # (P, K) share of b0 at z
    refused: int  # rays left out because no measure has their rounded moments

    def transmittance(self, overestimation: float) -> np.ndarray:
        share = self.lower + overestimation * self.weight
        return np.exp(-self.b0[:, None].astype(float) * share)

    def error(self, T: np.ndarray, overestimation: float) -> np.ndarray:
        return np.abs(T - self.transmittance(overestimation))


@cache
def power_problems(m: int, seed: int, of_each_kind: int, depths: int) -> Problems:
    """Problems for m moments; about 3, 6 and 15 ms an evaluation for 4, 6 and 8 moments."""
    used, b0, b, z, lower, weight = [], [], [], [], [], []
    refused = 0
    for number, hard in enumerate(hard_rays(seed, of_each_kind)):
        exact0, exact = rays.moments(hard.depth, hard.alpha, m)
        stored = np.array(exact, float).astype(np.float32)
        ray = power.biased(stored.tolist(), power.PUBLISHED_BIAS[m])
        asked = depths_to_ask(hard, seed + number, depths)
        try:
            found = [ray.at(float(one)) for one in asked]
        except ValueError:
            refused += 1
            continue
        used.append(hard)
        b0.append(np.float32(float(exact0)))
        b.append(stored)
        z.append(asked)
        lower.append([float(one.lower) for one in found])
        weight.append([float(one.weight) for one in found])
    arrays = map(np.array, (b0, b, z, lower, weight))
    return Problems(used, *arrays, refused)


@cache
def trigonometric_problems(
    m: int, seed: int, of_each_kind: int, depths: int, theta: float = math.pi / 10
) -> Problems:
    """The same for m trigonometric moments; about 15 ms an evaluation."""
    used, b0, b, z, lower, weight = [], [], [], [], [], []
    for number, hard in enumerate(hard_rays(seed, of_each_kind)):
        exact0, exact = trigonometric.moments(hard.depth, hard.alpha, m, theta)
        stored = np.array(exact, complex).astype(np.complex64)
        ray = trigonometric.biased(stored, trigonometric.PUBLISHED_BIAS[m], theta)
        asked = depths_to_ask(hard, seed + number, depths)
        found = [ray.in_front(one) for one in asked]
        used.append(hard)
        b0.append(np.float32(float(exact0)))
        b.append(stored)
        z.append(asked)
        lower.append([float(one) for one, _ in found])
        weight.append([float(one) for _, one in found])
    arrays = map(np.array, (b0, b, z, lower, weight))
    return Problems(used, *arrays, 0)
