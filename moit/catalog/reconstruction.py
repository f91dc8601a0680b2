"""What techniques share that store a function of depth and read transmittance back from it."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from moit import _core
from moit.catalog.options import WARPS, depth_to_warp, flag, within
from moit.catalog.targets import Target, Targets, added, formats_for, held_in
from moit.catalog.technique import Technique
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments

# alpha is clamped to this where its logarithm is taken (MT, supplement 1.1).
MAX_ALPHA = 1 - 0.5 / 256

DEPTH_RANGES = ("image", "pixel")


@dataclasses.dataclass(frozen=True, kw_only=True)
class WarpedDepth(Technique):
    """Options of techniques that work on warped depth.

    warp : "log" (depth must be positive), "linear", or "none": depth lies in `unit_range` already.
    depth_range : what maps to the unit range: "image", the fragments' depth_range, or "pixel",
        each pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.
    """

    warp: str = "log"
    depth_range: str = "image"
    normalize: bool = True
    max_alpha: float = MAX_ALPHA

    def __post_init__(self) -> None:
        one_of("warp", self.warp, WARPS)
        one_of("depth_range", self.depth_range, DEPTH_RANGES)
        if self.warp == "none" and self.depth_range == "pixel":
            raise ValueError("depth_range: 'pixel' has no meaning with warp='none'")
        flag(self, "normalize")
        within(self, "max_alpha", 0, 1)
        if not 0 < self.max_alpha < 1:
            raise ValueError(f"max_alpha: expected a number in (0, 1), got {self.max_alpha}")

    @property
    def _extent_bits(self) -> int:
        """What a pixel's own near and far take."""
        return 64 if self.range_per_pixel else 0

    @property
    def depth_warp(self) -> str | None:
        return self.warp

    @property
    def range_per_pixel(self) -> bool:
        return self.depth_range == "pixel"

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "warp": WARPS.index(self.warp),
            "range_per_pixel": self.range_per_pixel,
            "normalize": self.normalize,
            "max_alpha": self.max_alpha,
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        assert self.unit_range is not None
        depth_to_warp(f, self.warp, self.depth_range, self.unit_range)
        return super().fields_for(f)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reconstruction(WarpedDepth):
    """Options of those that count a fragment among what occludes it, unless told not to.

    exclude_self : a fragment does not occlude itself: its own absorbance is taken from what may
        lie at its depth. False: as published.
    """

    exclude_self: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        flag(self, "exclude_self")

    @property
    def excludes_self(self) -> bool:
        return self.exclude_self

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "exclude_self": self.exclude_self}


@dataclasses.dataclass(frozen=True, kw_only=True)
class MomentTechnique(WarpedDepth):
    """Options of techniques that store moments of absorbance over depth.

    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm; "published", the paper's; None, the default of the class.
    """

    bias: float | str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.bias, str):
            one_of("bias", self.bias, ("published",))
        elif self.bias is not None:
            within(self, "bias", 0, 1)

    @property
    def moment_count(self) -> int:
        """How many moments there are beside b0."""
        raise NotImplementedError

    @property
    def thick_points(self) -> int:
        if self.thick != "moments":
            return super().thick_points
        return self.moment_count // 2 + 1

    @property
    def moment_sets(self) -> int:
        """How many b0 and b there are: 2 where a second pass gathers its own."""
        return 1

    @property
    def keeps_words_of_moments(self) -> bool:
        """Whether what is read is words made of gathered moments, not the moments themselves."""
        return False

    @property
    def moments_are_complex(self) -> bool:
        return False

    @property
    def _most_moment(self) -> float:
        """The largest number that a stored moment may be."""
        return 1.0

    def _state_fields(self) -> dict[str, Any]:
        """Fields of the core that say what is stored."""
        raise NotImplementedError

    def bias_for(self, dtype: Any) -> float:
        """What `bias` comes to for moments stored as `dtype`, float32 or float64."""
        if self.bias is None or isinstance(self.bias, str):
            return _known_bias(self, self.bias or np.dtype(dtype).name)
        return float(self.bias)

    @property
    def blended_bias(self) -> float:
        """What `bias` comes to for moments that blending adds up in float32: the published one,
        where none is given. With less the order of addition shows, in some pixels by a tenth.
        """
        if self.bias is not None:
            return self.bias_for(np.float32)
        return _known_bias(self, "published")

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            **self._state_fields(),
            "bias": self.bias_for(dtype),
        }


@functools.lru_cache(256)
def _known_bias(technique: MomentTechnique, which: str) -> float:
    """The core's for "float32" or "float64" storage, or "published"; it is asked with any bias."""
    fields = dataclasses.replace(technique, bias=0.0).fields_for_core(np.dtype(np.float32))
    return _core.bias(fields, which)


@dataclasses.dataclass(frozen=True, kw_only=True)
class HalfMoments(MomentTechnique):
    """Options of power moments that may be kept in half floats.

    storage : None: numbers of the fragments' dtype. "half": half floats, to which blending adds
        each fragment's terms.
    """

    storage: str | None = None

    def __post_init__(self) -> None:
        one_of("storage", self.storage, (None, "half"))
        super().__post_init__()

    @property
    def in_halves(self) -> bool:
        return self.storage == "half"

    @property
    def _extent_bits(self) -> int:
        return super()._extent_bits // 2 if self.in_halves else super()._extent_bits

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {"storage": "half" if words else None}

    def _state_fields(self) -> dict[str, Any]:
        return {"halves": self.in_halves}

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        if not self.in_halves:
            return super().drawn_to(colours)
        extent = (Target("rg16", "max"),) if self.range_per_pixel else ()
        held = held_in((*formats_for(self.moment_count, "16f"), "r16f"))
        return Targets((*held, *extent), added(colours))


@dataclasses.dataclass(frozen=True, kw_only=True)
class OverestimatingMoments(Reconstruction, MomentTechnique):
    """Options of those that count one share of what may lie at a depth, whatever the ray.

    overestimation : beta in [0, 1]: 0 counts what must lie in front of a depth, 1 what can.
    """

    overestimation: float = 0.25

    def __post_init__(self) -> None:
        super().__post_init__()
        within(self, "overestimation", 0, 1)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "overestimation": self.overestimation}
