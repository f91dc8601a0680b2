"""The technique that is another one on every pixel."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from moit.catalog.aliases import separated
from moit.catalog.names import names_in, technique
from moit.catalog.options import flag, hold, positive, whole
from moit.catalog.technique import EXACT, FACTS, Technique
from moit.fragments.fragments import Fragments


@dataclasses.dataclass(frozen=True)
class PerPixel(Technique):
    """The cheapest technique on every pixel whose colour comes out well enough; else `sorted`.

    max_error : on the image: the largest difference that any of a pixel's four channels may have
        from the exact one, in linear values; positive. The default is two steps of a byte. It
        holds before any background from -1 to 1, all of which get one choice; before a brighter
        one, for which techniques are chosen anew, up to that. (On a GPU techniques may round
        otherwise; what is chosen and proved is of the CPU's.)
    techniques : names of candidates; None: `moit.per_pixel.plan.CANDIDATES`, with the linear warp
        where depth is not positive. Not those that look at neighbours (resolution above 1), that
        are random, or whose bits a pixel are not known beforehand.
    certify : False: predicted. Candidates are tried on a sample of this image's pixels, beside the
        exact answer; from what a cheap pass knows of a pixel (count, absorbance, spread of depth,
        how colour goes along with depth) the sample teaches how likely each candidate errs by
        more; and of choices that save ever more bits the last is taken that a second part of the
        sample, which taught nothing, still proves: of the pixels with fragments that nobody looked
        at, at most one in a thousand is off by more than max_error, with 99.9 % certainty. Pixels
        of the sample get what was measured to be good there.
        True: proved. Between which colours the exact one lies follows from `moit.bounds` of eight
        power moments over each pixel's own depth, its known sum of weights and its fragments'
        colours; a candidate is taken where all of these are within max_error of what it gives. No
        pixel is off by more.
    sample : how many pixels are tried, from 0. An image with not many more is tried as a whole;
        with less than about 14,000 little can be proved, and more is sorted.
    seed : of the sample.

    Cheap is what takes few bits a pixel (`bits_per_pixel` of the candidate, 96 for each fragment
    that is sorted, 0 where there is none): memory, not time. On a CPU, sorting is quicker than
    choosing. `moit.choose` tells which pixels got what, what it comes to, and how far off it is.

    Asked for a curve, candidates without one are left out. Without colour, errors are those of
    transmittance, summed over a pixel's fragments by their alpha. Ours; the moments are those of
    Muenstermann et al. 2018, whose bounds it rests on.

    >>> str(moit.PerPixel(0.01))
    'per-pixel(max_error=0.01)'
    """

    max_error: float = 2 / 255
    techniques: tuple[str, ...] | None = None
    certify: bool = False
    sample: int = dataclasses.field(default=32768, kw_only=True)
    seed: int = dataclasses.field(default=0, kw_only=True)

    kind: ClassVar[str] = "per-pixel"
    family: ClassVar[str] = "layers"
    sorts: ClassVar[bool] = True
    engine: ClassVar[str] = "per-pixel"
    row: ClassVar[Mapping[str, Any]] = {
        **dict.fromkeys(FACTS["sorted"], False),
        "kind": kind,
        "ties_in_order": True,
        "ties": "chosen",
        "has_curve": True,
        "takes_transmission": True,
        "thick": "points",
    }
    source: ClassVar[str] = "ours: only what a scene needs"

    def __post_init__(self) -> None:
        positive(self, "max_error")
        flag(self, "certify")
        whole(self, "sample", 0)
        whole(self, "seed", 0)
        if self.techniques is not None:
            hold(self, "techniques", _checked(self.techniques))

    @property
    def needs_order(self) -> bool:
        """Whether a candidate does; one of those that there are by default does."""
        return self.techniques is None or any(technique(one).needs_order for one in self.techniques)

    @property
    def bits_per_pixel(self) -> float | None:
        return None  # moit.choose measures it

    @property
    def geometry_passes(self) -> int | None:
        return None

    @property
    def local(self) -> bool:
        return False  # what is chosen hangs on a sample of all pixels

    @property
    def supports_transmission(self) -> bool:
        return all(t.supports_transmission for t in _made(self.techniques or ()))

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        raise TypeError(f"technique: {self} has no fields of its own")

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        """None; FragmentsError where `f` is not what a candidate needs."""
        for one in _made(self.techniques or ()):
            one.fields_for(f)
        return {}

    def fields_for_totals(self, f: Fragments) -> dict[str, Any]:
        return {}


@functools.lru_cache(16)
def _made(names: tuple[str, ...]) -> tuple[Technique, ...]:
    return tuple(technique(name) for name in names)


def _checked(names: Any) -> tuple[str, ...]:
    """Techniques by their names, each once, without `sorted`, which is one always."""
    if isinstance(names, str) and len(separated(names)) > 1:
        names = separated(names)
    if isinstance(names, (str, Technique)) or not isinstance(names, Iterable):
        raise TypeError(f"techniques: expected several names, got {names!r:.80}")
    found = []
    for one in (technique(name) for given in names for name in names_in(given)):
        if one.exact_up_to == EXACT:
            continue
        if not one.has_name:
            raise ValueError(f"techniques: {one} has no name that stands for it")
        if one.engine != "core":
            raise ValueError(f"techniques: {one} is no candidate for a pixel")
        if one.random:
            raise ValueError(f"techniques: {one} is random, and errs by what no sample can tell")
        if not one.local:
            raise ValueError(f"techniques: {one} looks at neighbours, which may be others' pixels")
        if one.bits_per_pixel is None:
            raise ValueError(f"techniques: {one} takes bits that are not known beforehand")
        found.append(str(one))
    return tuple(dict.fromkeys(found))
