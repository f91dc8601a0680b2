"""Moments of hard rays with the exact answers that belong to them."""

from functools import cache
from typing import NamedTuple

import numpy as np

from . import power, rays
from .hard_rays import HardRay, depths_to_ask, hard_rays


class PowerProblems(NamedTuple):
    """float32 moments of P rays, K depths for each, and what is exact for just these moments."""

    rays: list[HardRay]
    b0: np.ndarray  # (P,) float32
    b: np.ndarray  # (P, m) float32
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
def power_problems(m: int, seed: int, of_each_kind: int, depths: int) -> PowerProblems:
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
    return PowerProblems(used, *arrays, refused)
