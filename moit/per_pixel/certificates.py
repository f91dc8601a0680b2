"""What no exact answer can be: how far off a technique is at most, without sorting."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import PowerMoments, Technique
from moit.fragments.fragments import Fragments
from moit.per_pixel.selection import Selection, fragments_of, worst_of

Array = NDArray[Any]
Places = NDArray[np.int64]


class ColorsBetween:
    """How far off techniques may be, by colours between which the exact ones lie.

    least : (n,) what no technique's error can be proved to be below.
    """

    def __init__(self, seen: Selection, pixels: Places, part: Fragments, bright: float) -> None:
        self.seen, self.pixels, self.bright = seen, pixels, bright
        self.behind = [np.full(3, level) for level in seen.levels(bright)]
        between = transmittance_between(seen, part)
        self.between = [
            _core.color_bounds(part, seen.cull_opaque, seen.threads, behind[None], *between)
            for behind in self.behind
        ]
        self.least = np.max([(high - low).max(axis=1) / 2 for low, high in self.between], axis=0)

    def __call__(self, one: Technique, place: Places) -> NDArray[np.float64]:
        off = []
        for behind, (low, high) in zip(self.behind, self.between, strict=True):
            given = self.seen.colors(self.pixels[place], one, behind).astype(np.float64)
            off.append(np.maximum(high[place] - given, given - low[place]))
        return worst_of(np.stack(off), self.bright, self.seen.f.transmission is not None)


class SumsBetween:
    """The same of transmittance, where there is no colour."""

    def __init__(self, seen: Selection, pixels: Places, part: Fragments) -> None:
        self.seen, self.pixels, self.part = seen, pixels, part
        self.lower, self.upper = seen.ask(part, prover(part), blends=False).bounds(None)
        self.least = np.zeros(len(pixels))

    def __call__(self, one: Technique, place: Places) -> NDArray[np.float64]:
        at = fragments_of(self.part, place)
        part = self.seen.part(self.pixels[place])
        held = self.seen.ask(part, one).transmittance(None)
        off = part.coverage * np.maximum(self.upper[at] - held, held - self.lower[at])
        pixel = np.repeat(np.arange(len(place)), part.counts)
        sums = np.bincount(pixel, off, minlength=len(place)).astype(np.float64)
        return sums


def prover(f: Fragments) -> Technique:
    """Whose bounds are trusted: of those tried, they leave most techniques standing. A range of
    their own is worth most where a pixel spans little of the image's."""
    warp = "log" if f.depth_range[0] > 0 else "linear"
    return PowerMoments(8, warp=warp, depth_range="pixel")


def transmittance_between(seen: Selection, f: Fragments) -> tuple[Array, Array]:
    """Bounds (N,) of what is in front of each fragment, or with transmission (N, 3): each channel
    has its own opacities, and so its own moments."""
    if f.transmission is None:
        return seen.ask(f, prover(f), blends=False).bounds(None)
    bounds = np.empty((2, len(f), 3), f.dtype)
    for c in range(3):
        passed = f.transmission[:, c].astype(np.float64)
        opacity = (f.alpha * (1 - passed)).astype(f.dtype)
        channel = f._with(f.depth, opacity)
        bounds[0, :, c], bounds[1, :, c] = seen.ask(channel, prover(f), blends=False).bounds(None)
    return bounds[0], bounds[1]
