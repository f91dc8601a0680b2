"""What no exact answer can be: how far off a technique is at most, without sorting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core, questions
from moit.catalog import PowerMoments, Technique
from moit.fragments.fragments import Fragments
from moit.per_pixel.selection import fragments_of

if TYPE_CHECKING:
    from moit.per_pixel.plan import Question

Array = NDArray[Any]
Places = NDArray[np.int64]


class ColorsBetween:
    """How far off techniques may be, by colours between which the exact ones lie.

    least : (n,) what no technique's error can be proved to be below.
    """

    def __init__(self, q: Question, pixels: Places, part: Fragments, bright: float) -> None:
        self.q, self.pixels, self.bright = q, pixels, bright
        self.behind = [np.full(3, level) for level in q.levels(bright)]
        seen = transmittance_between(part, q.cull_opaque, q.threads)
        self.between = [
            _core.color_bounds(part, q.cull_opaque, q.threads, behind[None], *seen)
            for behind in self.behind
        ]
        self.least = np.max([(high - low).max(axis=1) / 2 for low, high in self.between], axis=0)

    def __call__(self, one: Technique, place: Places) -> NDArray[np.float64]:
        from moit.per_pixel.plan import worst_of

        off = []
        for behind, (low, high) in zip(self.behind, self.between, strict=True):
            given = self.q.colors(self.pixels[place], one, behind).astype(np.float64)
            off.append(np.maximum(high[place] - given, given - low[place]))
        return worst_of(np.stack(off), self.bright, self.q.f.transmission is not None)


class SumsBetween:
    """The same of transmittance, where there is no colour."""

    def __init__(self, q: Question, pixels: Places, part: Fragments) -> None:
        self.q, self.pixels, self.part = q, pixels, part
        self.lower, self.upper = questions.bounds(part, prover(part), **q.how)
        self.least = np.zeros(len(pixels))

    def __call__(self, one: Technique, place: Places) -> NDArray[np.float64]:
        at = fragments_of(self.part, place)
        part = self.q.part(self.pixels[place])
        held = questions.transmittance(part, one, **self.q.how)
        off = part.coverage * np.maximum(self.upper[at] - held, held - self.lower[at])
        pixel = np.repeat(np.arange(len(place)), part.counts)
        sums = np.bincount(pixel, off, minlength=len(place)).astype(np.float64)
        return sums


def prover(f: Fragments) -> Technique:
    """Whose bounds are trusted: of those tried, they leave most techniques standing. A range of
    their own is worth most where a pixel spans little of the image's."""
    warp = "log" if f.depth_range[0] > 0 else "linear"
    return PowerMoments(8, warp=warp, depth_range="pixel")


def transmittance_between(f: Fragments, cull_opaque: bool, threads: int) -> tuple[Array, Array]:
    """Bounds (N,) of what is in front of each fragment, or with transmission (N, 3): each channel
    has its own opacities, and so its own moments."""
    how: dict[str, Any] = {"cull_opaque": cull_opaque, "threads": threads}
    if f.transmission is None:
        return questions.bounds(f, prover(f), **how)
    bounds = np.empty((2, len(f), 3), f.dtype)
    for c in range(3):
        passed = f.transmission[:, c].astype(np.float64)
        opacity = (f.alpha * (1 - passed)).astype(f.dtype)
        channel = Fragments._of_checked(
            f.offsets, (f.depth, opacity, None, None), f.shape, f.depth_range, f.origin
        )
        bounds[0, :, c], bounds[1, :, c] = questions.bounds(channel, prover(f), **how)
    return bounds[0], bounds[1]
