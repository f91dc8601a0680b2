"""Rays to train networks on: generators of Fragments, seeded, of any length.

Depth is uniform in its logarithm: a position u in [0, 1] of the warped range becomes exp(u), in a
depth_range of (1, e). Fragments of a pixel come in random order, their colours are random.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from moit import scenes
from moit.fragments.fragments import Fragments

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


def sheets(pixels: int, rng: Generator) -> Rays:
    """3 to 9 surfaces of much the same alpha, as of glass or leaves, in any part of the range.

    A pixel's alpha is between .1 and .95, that of its surfaces as much or within a fifth of it. In
    half of all pixels surfaces come in pairs, which are the front and the back of something.
    """
    pixel = _pixels(rng.integers(3, 10, pixels))
    u = rng.random(len(pixel))
    first = np.arange(len(pixel)) // 2 * 2  # of the pair
    paired = (rng.random(pixels)[pixel] < 0.5) & (pixel[first] == pixel)
    thickness = rng.exponential(_log_uniform(rng, 0.01, 0.3, pixels)[pixel])
    u = np.where(paired, u[first] + thickness * (first != np.arange(len(pixel))), u)
    alpha = _log_uniform(rng, 0.1, 0.95, pixels)[pixel]
    varied = rng.uniform(0.8, 1.2, len(pixel))
    alpha = np.where(rng.random(pixels)[pixel] < 0.4, alpha, np.clip(alpha * varied, 0.05, 0.97))
    return Rays(pixel, _in_part(rng, pixel, u, pixels), alpha)


def haze(pixels: int, rng: Generator) -> Rays:
    """Up to 5 surfaces of alpha .2 to .95 among 2 to 60 particles of .001 to .12, in puffs."""
    pixel = _pixels(rng.integers(0, 6, pixels))
    solid = Rays(pixel, rng.random(len(pixel)), rng.uniform(0.2, 0.95, len(pixel)))
    pixel = _pixels(_log_uniform(rng, 2, 61, pixels).astype(np.int64))
    puff = 2 * pixel + (rng.random(len(pixel)) < 0.5 * rng.random(pixels)[pixel])
    center, spread = rng.random(2 * pixels), _log_uniform(rng, 0.02, 0.4, 2 * pixels)
    u = center[puff] + spread[puff] * rng.normal(size=len(pixel))
    thick = _log_uniform(rng, 0.01, 0.12, pixels)[pixel]
    dust = Rays(pixel, u, np.maximum(thick * rng.random(len(pixel)), 0.001))
    all_ = _joined(solid, dust)
    return Rays(all_.pixel, _in_part(rng, all_.pixel, all_.u, pixels), all_.alpha)


def veils(pixels: int, rng: Generator) -> Rays:
    """1 to 10 surfaces of alpha .4 to .95 close together, and 2 to 50 particles before and in them.

    The particles have alpha up to .01 to .2, their extent is .1 to .8 of the range.
    """
    pixel = _pixels(rng.integers(1, 11, pixels))
    center, spread = rng.uniform(0.3, 1, pixels), _log_uniform(rng, 0.01, 0.2, pixels)
    u = center[pixel] + spread[pixel] * rng.normal(size=len(pixel))
    dense = Rays(pixel, u, rng.uniform(0.4, 0.95, len(pixel)))
    pixel = _pixels(_log_uniform(rng, 2, 51, pixels).astype(np.int64))
    extent = rng.uniform(0.1, 0.8, pixels)
    start = np.maximum(center - extent * rng.uniform(0.5, 1.2, pixels), 0)
    thick = _log_uniform(rng, 0.01, 0.2, pixels)[pixel]
    alpha = np.maximum(thick * rng.random(len(pixel)), 0.001)
    veil = Rays(pixel, start[pixel] + extent[pixel] * rng.random(len(pixel)), alpha)
    all_ = _joined(dense, veil)
    return Rays(all_.pixel, _in_part(rng, all_.pixel, all_.u, pixels), all_.alpha)


#: Each set by its name, with how many fragments a pixel has on the mean. The first four are those
#: that README and docs/neural.md call A, B, C and D.
SETS: dict[str, tuple[Callable[[int, Generator], Rays], float]] = {
    "layers": (layers, 17.0),
    "surfaces": (surfaces, 2.5),
    "puffs": (puffs, 42.5),
    "tufts": (tufts, 105.0),
    "sheets": (sheets, 6.0),
    "haze": (haze, 19.7),
    "veils": (veils, 20.1),
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
        np.clip(np.exp(rays.u[order]), 1.0, math.e),
        rays.alpha[order],
        rng.random((len(order), 3), np.float32),
        shape=(1, pixels),
        depth_range=(1.0, math.e),
        dtype=np.float32,
    )


def _pixels(counts: Array) -> Array:
    return np.repeat(np.arange(len(counts)), counts)


def _log_uniform(rng: Generator, least: float, most: float, count: int) -> Array:
    return np.exp(rng.uniform(np.log(least), np.log(most), count))


def _in_part(rng: Generator, pixel: Array, u: Array, pixels: int) -> Array:
    """Positions with those beyond [0, 1] folded back: clipped they would be at one depth. Half of
    all pixels take up a part of the range only, down to a thirtieth."""
    folded = 1 - np.abs(1 - np.mod(u, 2))
    part = np.where(rng.random(pixels) < 0.5, 1.0, _log_uniform(rng, 0.03, 1, pixels))
    start = rng.uniform(0, 1 - part)
    return np.asarray(start[pixel] + part[pixel] * folded)


def _joined(*parts: Rays) -> Rays:
    return Rays(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
