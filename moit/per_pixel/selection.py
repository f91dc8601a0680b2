"""Some pixels of fragments, wherever they are, and how far off what is made of them is."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import Technique
from moit.core.engine import Engine, Question
from moit.core.questions import CORE
from moit.fragments.fragments import Fragments

Array = NDArray[Any]
Places = NDArray[np.int64]


def pixels_of(f: Fragments, pixels: Places, threads: int) -> Fragments:
    """The fragments of pixels (K,) in one row, with this depth_range; of all pixels, `f` itself."""
    if len(pixels) == len(f.counts):
        return f
    offsets, depth, alpha, color, transmission = _core.take_pixels(f, pixels, threads)
    arrays = (depth, alpha, color, transmission, None, None, None)
    return Fragments._of_checked(offsets, arrays, (1, len(pixels)), f.depth_range, (0, 0))


def fragments_of(f: Fragments, pixels: Places) -> Places:
    """Where the fragments of pixels are, in the pixels' order."""
    begins, counts = f.offsets[pixels], f.counts[pixels]
    ends = np.cumsum(counts)
    return np.repeat(begins - (ends - counts), counts) + np.arange(counts.sum())


@dataclasses.dataclass(frozen=True)
class Selection:
    """Fragments of an image that are asked about some pixels at a time."""

    f: Fragments
    cull_opaque: bool
    threads: int

    def part(self, pixels: Places) -> Fragments:
        """The fragments of some pixels, in one row."""
        return pixels_of(self.f, pixels, self.threads)

    def ask(
        self, part: Fragments, one: Technique, engine: Engine = CORE, blends: bool = True
    ) -> Question:
        return engine.question(
            part, one, cull_opaque=self.cull_opaque, threads=self.threads, blends=blends
        )

    def colors(
        self, pixels: Places, one: Technique, background: Array, engine: Engine = CORE
    ) -> Array:
        """(n, 4) of some pixels, over a background (3,) or (height, width, 3)."""
        part = self.part(pixels)
        behind = np.asarray(background, np.float64)
        if behind.ndim > 1:
            behind = behind.reshape(-1, 3)[pixels].reshape(*part.shape, 3)
        return self.ask(part, one, engine).composite(behind).reshape(-1, 4)

    def levels(self, bright: float) -> tuple[float, ...]:
        """Backgrounds before which all there is of an error shows (see `worst_of`)."""
        return (0.0,) if self.f.transmission is None else (-bright, bright)


def brightness(background: Array) -> float:
    """At least 1, so that dark backgrounds all get the same choice."""
    return max(1.0, float(np.abs(background).max(initial=0)))


def worst_of(off: Array, bright: float, coloured: bool) -> NDArray[np.float64]:
    """(n,) how far off a pixel is before the worst background up to `bright`.

    off : (levels, n, 4) before `Selection.levels`: light behind a pixel changes its error by what
        the total is off. With transmission each channel has its own, which shows at both ends; else
        it is the fourth channel.
    """
    worst = off.max(axis=0)
    behind = 0.0 if coloured else bright * worst[:, 3]
    most: NDArray[np.float64] = np.maximum(worst[:, :3].max(axis=1) + behind, worst[:, 3])
    return most
