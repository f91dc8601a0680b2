"""Rays to train networks on: generators of Fragments, seeded, of any length.

Depth is uniform in its logarithm: a position u in [0, 1] of the warped range becomes exp(u), in a
depth_range of (1, e). Fragments of a pixel come in random order, their colours are random.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from moit import scenes
from moit.fragments import Fragments

if TYPE_CHECKING:
    from numpy.random import Generator  # NumPy loads it on first use, since that takes long

Array = NDArray[Any]


class Rays(NamedTuple):
    """Fragments of pixels, those of one pixel anywhere among the others."""

    pixel: Array  # (N,) from 0
    u: Array  # (N,) positions in the warped range; what leaves [0, 1] is clipped
    alpha: Array  # (N,)


def layers(pixels: int, rng: Generator) -> Rays:
    """2 to 32 fragments of alpha .1 to .5 in an interval of .3 to 1 of the range (NMT, 3.2)."""
    pixel = _pixels(rng.integers(2, 33, pixels))
    length = rng.uniform(0.3, 1.0, pixels)
    start = rng.uniform(0.0, 1.0 - length)
    u = start[pixel] + length[pixel] * rng.random(len(pixel))
    return Rays(pixel, u, rng.uniform(0.1, 0.5, len(pixel)))


def surfaces(pixels: int, rng: Generator) -> Rays:
    """1 to 4 surfaces of alpha .2 to .95, anywhere."""
    pixel = _pixels(rng.integers(1, 5, pixels))
    return Rays(pixel, rng.random(len(pixel)), rng.uniform(0.2, 0.95, len(pixel)))


def puffs(pixels: int, rng: Generator) -> Rays:
    """A cloud of 20 to 60 particles of alpha .01 to .08, and 1 to 4 surfaces of .2 to .9."""
    pixel = _pixels(rng.integers(20, 61, pixels))
    center, spread = rng.uniform(0.2, 0.8, pixels), rng.uniform(0.02, 0.2, pixels)
    cloud = Rays(
        pixel,
        center[pixel] + spread[pixel] * rng.normal(size=len(pixel)),
        rng.uniform(0.01, 0.08, len(pixel)),
    )
    pixel = _pixels(rng.integers(1, 5, pixels))
    others = Rays(pixel, rng.random(len(pixel)), rng.uniform(0.2, 0.9, len(pixel)))
    return _joined(cloud, others)


def tufts(pixels: int, rng: Generator) -> Rays:
    """40 to 170 strands of alpha .2 in 1 to 3 clusters of deviation .03, as of hair."""
    pixel = _pixels(rng.integers(40, 171, pixels))
    clusters = rng.integers(1, 4, pixels)
    center = rng.random((pixels, 3))[pixel, rng.integers(0, clusters[pixel])]
    u = center + 0.03 * rng.normal(size=len(pixel))
    return Rays(pixel, u, np.full(len(pixel), 0.2))


def solids(pixels: int, rng: Generator) -> Rays:
    """1 to 5 things of glass, most of them solid: with a front and a back of one alpha.

    Alpha is between .03 and .95; in half of all pixels all things have the same.
    """
    counts = rng.integers(1, 6, pixels)
    pixel = _pixels(counts)
    front, thickness = rng.random(len(pixel)), rng.exponential(0.15, len(pixel))
    which = np.where(rng.random(pixels)[pixel] < 0.5, pixel, pixels + np.arange(len(pixel)))
    alpha = rng.uniform(0.03, 0.95, pixels + len(pixel))[which]
    solid = rng.random(len(pixel)) < 0.7
    u = np.concatenate([front, (front + thickness)[solid]])
    u = 1 - np.abs(1 - np.mod(u, 2))
    return Rays(np.concatenate([pixel, pixel[solid]]), u, np.concatenate([alpha, alpha[solid]]))


def mixtures(pixels: int, rng: Generator) -> Rays:
    """1 to 4 groups of any count, place, width and alpha, in any part of the range.

    A group has 1 to 60 fragments, few more often than many, of much the same alpha between .01 and
    .95. Half of all pixels take up a part of the range only, down to a hundredth.
    """
    groups = _pixels(rng.integers(1, 5, pixels))
    count = np.exp(rng.uniform(0, np.log(61), len(groups))).astype(np.int64)
    group = _pixels(count)
    pixel = groups[group]
    spread = np.exp(rng.uniform(np.log(0.002), np.log(0.4), len(groups)))[group]
    shape = np.where(
        rng.random(len(groups))[group] < 0.5,
        rng.normal(size=len(group)),
        rng.uniform(-1.7, 1.7, len(group)),
    )
    u = rng.random(len(groups))[group] + spread * shape
    u = 1 - np.abs(
        1 - np.mod(u, 2)
    )  # what leaves the range comes back: clipped it would be one depth
    alpha = np.exp(rng.uniform(np.log(0.01), np.log(0.95), len(groups)))[group]
    alpha = np.clip(alpha * rng.uniform(0.6, 1.4, len(group)), 0.002, 0.98)
    part = np.where(rng.random(pixels) < 0.5, 1.0, np.exp(rng.uniform(np.log(0.01), 0, pixels)))
    start = rng.uniform(0, 1 - part)
    return Rays(pixel, start[pixel] + part[pixel] * u, alpha)


#: Each set by its name, with how many fragments a pixel has on the mean. The first four are those
#: that README and docs/neural.md call A, B, C and D.
SETS: dict[str, tuple[Callable[[int, Generator], Rays], float]] = {
    "layers": (layers, 17.0),
    "surfaces": (surfaces, 2.5),
    "puffs": (puffs, 42.5),
    "tufts": (tufts, 105.0),
    "solids": (solids, 5.1),
    "mixtures": (mixtures, 37.0),
}


#: The names of what `drawn` draws: those and the scene of NMT's training data.
NAMES = (*SETS, "neural-training")


def drawn(name: str, fragments: int, seed: int) -> Fragments:
    """About so many fragments of what NAMES has: float32, with colours; equal for equal seeds."""
    if name == "neural-training":
        return scenes.load(name, (max(round(fragments / 17), 1), 1), seed)
    generate, mean = SETS[name]
    pixels = max(round(fragments / mean), 1)
    rng = np.random.default_rng((seed, list(SETS).index(name)))
    rays = generate(pixels, rng)
    order = rng.permutation(len(rays.pixel))
    return Fragments.from_pixels(
        rays.pixel[order],
        np.clip(np.exp(rays.u[order]), 1.0, np.e),
        rays.alpha[order],
        rng.random((len(order), 3), np.float32),
        shape=(1, pixels),
        depth_range=(1.0, np.e),
        dtype=np.float32,
    )


def _pixels(counts: Array) -> Array:
    return np.repeat(np.arange(len(counts)), counts)


def _joined(*parts: Rays) -> Rays:
    return Rays(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
