"""Questions about thick fragments and emission, put to engines that know surfaces alone.

What a technique makes of volumes and Gaussians is a fact of it (`Technique.thick`): points of
Gauss' rule, or pieces. Volumes are cut where others of their pixel begin or end, and at the depths
that are asked, so that each piece is in front of a depth or is not; what coincides is mixed.
Emission adds up once a technique has said what reaches it, whatever that technique does with
colours.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog.options import WARPS
from moit.catalog.technique import Technique
from moit.core import intervals
from moit.core.engine import Array, Depths, Engine, Question
from moit.fragments.fragments import Fragments
from moit.fragments.held import taken
from moit.fragments.ranges import opaque_fragments
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.catalog.weighted import WeightedBlended


def put(
    engine: Engine,
    f: Fragments,
    technique: Technique,
    *,
    cull_opaque: bool,
    threads: int,
    blends: bool = True,
) -> Question:
    """A question about any fragments, put to an engine; see `Engine.question`."""
    how: dict[str, Any] = {"cull_opaque": cull_opaque, "threads": threads}
    if f.back is None and f.emission is None and f.deviation is None:
        return engine.question(f, technique, blends=blends, **how)
    return _InPieces(engine, f, technique, blends, how)


def surfaces(
    f: Fragments, technique: Technique | None = None, threads: int | None = None
) -> tuple[Fragments, NDArray[np.int64] | None]:
    """The pieces of `f`, or what a technique is given, as surfaces that emit nothing; and which of
    them each fragment begins with (None: its own)."""
    given, point = (f, None) if technique is None else thinned(f, technique, thread_count(threads))
    pieces, first = given._split()
    return _unlit(pieces, pieces.color), _of_those(point, first)


def thinned(
    f: Fragments, technique: Technique, threads: int
) -> tuple[Fragments, NDArray[np.int64] | None]:
    """What a technique is given of `f`, perhaps with volumes; and which of its fragments is at the
    depth of each of `f` (None: its own)."""
    thick = technique.thick
    volumes = f.back is not None and thick in ("moments", "waves", "cells")
    if thick == "pieces" or (f.deviation is None and not volumes):
        return f, None
    made = None
    order: NDArray[np.int64] | None = None
    if thick != "middle":
        seen = f
        if technique.ties_in_order:
            # Gaussians may have points at one depth: of these that of the nearer Gaussian is first
            order = _core.depth_order(f.offsets, f.depth, threads)
            seen = f._with(*taken(f._arrays(), order))
        made = _core.thin(seen, volumes, *_rule_of(technique, f), threads)
    if made is not None:
        return f._with(*made[1:7], offsets=made[0]), _unordered(made[7], order)
    depth, alpha, color, transmission, back, emission, _ = f._arrays()
    return f._with(depth, alpha, color, transmission, None if volumes else back, emission), None


def _unordered(point: NDArray[np.int64], order: NDArray[np.int64] | None) -> NDArray[np.int64]:
    """Points of the fragments that `order` names, as one for each fragment as it came."""
    if order is None:
        return point
    own = np.empty_like(point)
    own[order] = point
    return own


def _rule_of(technique: Technique, f: Fragments) -> tuple[int, float, int, bool, int, float]:
    """(points, frequency, warp, range_per_pixel, cells, step) as the core takes them."""
    warp, frequency = technique.depth_warp or "none", technique.thick_frequency
    if technique.unit_range and warp == "none" and not technique.range_per_pixel:
        low, high = technique.unit_range  # the range that waves are of, not the fragments'
        frequency *= (f.depth_range[1] - f.depth_range[0]) / (high - low)
    rule = technique.thick_points, frequency, WARPS.index(warp), technique.range_per_pixel
    return *rule, *technique.thick_cells


def _of_those(
    point: NDArray[np.int64] | None, first: NDArray[np.int64] | None
) -> NDArray[np.int64] | None:
    """Where fragments are that are found by two steps, each perhaps none."""
    if point is None or first is None:
        return first if point is None else point
    return first[point]


class _InPieces:
    """A `Question`."""

    def __init__(
        self, engine: Engine, f: Fragments, technique: Technique, blends: bool, how: dict[str, Any]
    ) -> None:
        self.engine, self.f, self.technique = engine, f, technique
        self.how, self.blends = how, blends
        self.given, point = thinned(f, technique, how["threads"])
        self.pieces, first = self.given._split()
        self.first = _of_those(point, first)
        self.emission, color = _apart(self.pieces)
        self.question = self._about(_unlit(self.pieces, color))

    def _about(self, f: Fragments, **other: Any) -> Question:
        how = {"blends": self.blends, **self.how, **other}
        return self.engine.question(f, self.technique, **how)

    @property
    def overflows(self) -> int:
        return self.question.overflows

    def composite(self, background: NDArray[np.float64]) -> Array:
        image = self._image(background)
        if self.emission is None:
            return image
        at = np.flatnonzero(self.emission.any(axis=1))
        pixel = np.searchsorted(self.pieces.offsets, at, "right") - 1
        # Weights may be above 1, and nothing makes light brighter than it is.
        light = np.clip(self._reaching[at], 0, 1).astype(np.float64) * self.emission[at]
        pixels = len(self.pieces.counts)
        sums = np.stack([np.bincount(pixel, one, minlength=pixels) for one in light.T], axis=-1)
        with np.errstate(over="ignore"):
            image[..., :3] = image[..., :3] + sums.reshape(*self.f.shape, 3)
        return image

    def _image(self, background: NDArray[np.float64]) -> Array:
        f, technique = self.f, self.technique
        from moit.catalog.moments import CountedMoments  # late: `import moit` stays quick

        if self.given is f or not isinstance(technique, CountedMoments) or not technique.intervals:
            return self.question.composite(background)
        probes = intervals.probes_of(f, technique.intervals)
        both, at = intervals.among(self.pieces, probes.f)
        through = self._about(both, blends=False).transmittance(None)[at]
        _, color = _apart(f)
        seen = f._with(f.depth, f.alpha, color, f.transmission)
        weight = intervals.weights(f, probes, through, technique.max_alpha)
        return intervals.image_of(seen, weight, background, technique.normalize, self.how)

    def transmittance(self, depths: Depths) -> Array:
        if depths is None:
            reaching = self.question.transmittance(None)
            return reaching if self.first is None else reaching[self.first]
        return self._cut_at(depths, self.given).transmittance(depths)

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        if depths is not None:
            return self._cut_at(depths, self.f).bounds(depths)
        if self.given is self.f:
            first, question = self.first, self.question
        else:  # what is proved of points is not of what they stand for
            pieces, first = self.f._split()
            question = self._about(_unlit(pieces, pieces.color))
        lower, upper = question.bounds(None)
        return (lower, upper) if first is None else (lower[first], upper[first])

    def total_transmittance(self) -> Array:
        return self.question.total_transmittance()

    def _cut_at(self, depths: NDArray[np.float64], f: Fragments) -> Question:
        pieces, first = f._split(cuts=np.unique(depths))
        if first is None and f is self.given:
            return self.question
        return self._about(_unlit(pieces, pieces.color))

    @functools.cached_property
    def _reaching(self) -> Array:
        """(N, 1) the transmittance in front of each piece; (N, 3) of each channel, where the
        technique knows these, and 0 of what is opaque, whose light is a part of its colour."""
        from moit.catalog.weighted import WeightedBlended  # late: `import moit` stays quick

        f = self.pieces
        if isinstance(self.technique, WeightedBlended):
            return _weighted(f, self.technique, **self.how)[:, None]
        if f.transmission is None or not self.technique.row["knows_channels"]:
            return self.question.transmittance(None)[:, None]
        # Each channel by itself, with the fragments that are there for all of them.
        kept, _, opacity, _ = _core.surviving(f, self.how["cull_opaque"], self.how["threads"])
        assert opacity is not None  # there is transmission
        offsets = np.concatenate([[0], np.cumsum(kept)])[f.offsets]
        reaching = np.zeros((len(f), 3), f.dtype)
        for c in range(3):
            alpha = np.ascontiguousarray(opacity[kept, c])
            channel = f._with(f.depth[kept], alpha, offsets=offsets)
            question = self._about(channel, cull_opaque=False, blends=False)
            reaching[kept, c] = question.transmittance(None)
        return reaching


def _weighted(
    f: Fragments, technique: WeightedBlended, cull_opaque: bool, threads: int
) -> NDArray[np.float64]:
    """(N,) what reaches fragments in weighted blending: what the pixel covers, split by the weights
    that opaque surfaces of their light would have. Weights have alpha in them, or are too small
    where there is none, so that light without opacity would not be seen."""
    assert f.color is not None
    light = f.alpha[:, None] * f.color
    if f.emission is not None:
        light = light + f.emission
    arrays = (f.depth, np.ones_like(f.alpha), light, None, None, None, None)
    ends = np.arange(len(f) + 1)
    each = Fragments._of_checked(ends, arrays, (1, len(f)), f.depth_range, (0, 0))
    fields = dataclasses.replace(technique, bits=32).fields_for(each)
    weight = _core.target_sums(each, fields, threads)[..., 3].ravel()
    kept = _core.surviving(f, cull_opaque, threads)[0]
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    alpha = np.where(kept, f.coverage.astype(np.float64), 0.0)
    through = np.ones(len(f.counts))
    np.multiply.at(through, pixel, 1 - alpha)
    # of no fragments it counts in whole numbers
    total = np.bincount(pixel, alpha * weight, minlength=len(f.counts)).astype(np.float64)
    share = np.divide(1 - through, total, out=np.ones_like(total), where=total > 0)
    reaching = np.where(total[pixel] > 0, share[pixel] * weight, 1.0)
    return np.where(kept, reaching, 0.0)


def _apart(f: Fragments) -> tuple[NDArray[Any] | None, NDArray[Any] | None]:
    """(emission, color): that of opaque surfaces is a part of their colour, since what is behind
    transparent ones is seen through all of them, as techniques have it."""
    if f.emission is None:
        return None, f.color
    opaque = opaque_fragments(f._arrays())
    if not opaque.any():
        return f.emission, f.color
    assert f.color is not None  # else there is no emission
    emission, color = f.emission.copy(), f.color.copy()
    most = np.finfo(f.dtype).max
    with np.errstate(over="ignore"):
        color[opaque] = np.clip(color[opaque] + emission[opaque], -most, most)
    emission[opaque] = 0
    return emission, color


def _unlit(f: Fragments, color: NDArray[Any] | None) -> Fragments:
    return f._with(f.depth, f.alpha, color, f.transmission)
