"""The nearest fragments exactly, and behind them what moments of all others leave open."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit.catalog.layers import MOST_LAYERS
from moit.catalog.moments import PowerMoments, TrigonometricMoments
from moit.catalog.names import technique
from moit.catalog.neural import BoundedNeural
from moit.catalog.options import WARPS, depth_to_warp, flag, hold, whole
from moit.catalog.reconstruction import MomentTechnique
from moit.catalog.targets import KeyWords, Target, Targets, added
from moit.catalog.technique import NUMBERS, Listed, Technique
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments

TAILS = (PowerMoments, TrigonometricMoments, BoundedNeural)
USUAL_TAIL = "neural-bounded"
KEY_BITS = (32, 64)
# What the core's front has of a tail's fields, as far as the tail has them.
TAIL_FIELDS = (
    *("warp", "range_per_pixel", "max_alpha", "bias", "bits", "network"),
    *("overestimation", "exclude_self", "wrapping_zone"),
)


@dataclasses.dataclass(frozen=True)
class FrontLayers(Technique):
    """The nearest fragments exactly, and behind them what moments of all others leave open.

    layers : 1 to 32 nearest fragments.
    tail : what reads moments of all others: the name of power moments, trigonometric moments or
        of bounded neural transmittance with options, or such a technique. Words and half floats
        cannot be: the nearest are taken out of sums over all. `warp`, `depth_range`, `max_alpha`,
        `bias` and what else it has are the tail's.
    normalize : scale the colours of the tail so that their weights sum to what the tail covers; the
        nearest count as they are.

    A first pass draws all: by atomic minima it keeps the nearest, 64 bits each, depth and alpha as
    they are; and it adds up moments of all fragments. What the nearest add to these is taken out,
    and so what rounding has left is a larger part of the less that remains: the tail's bias is at
    least that of floats by how many times more all absorb than the tail, up to .2. A tail of less
    than a millionth is none. The second pass shades. A fragment's transmittance is what lies in
    front of it of the nearest, times what reads the tail; so is the curve. Bounds: the nearest are
    exact, and no other is seen through less than these leave. Of fragments at one depth the earlier
    is in front while they are among the nearest. Exact for up to `layers` fragments. Ours.

    key_bits : 64, or 32 of each of the nearest: 20 of warped depth, and 12 of the root of
        1 - alpha. So that what is taken out is what was added, moments are of all fragments as such
        keys have them; colours are weighed by alpha as it is. Fragments of one key are in front of
        one another as they arrive. Of bounds the keys prove as much as they hold. With
        `depth_range="image"` of the tail only.

    bits_per_pixel : `key_bits` for each of the nearest, the tail's, and 64 for the second
        accumulator of colours.

    >>> str(moit.FrontLayers(2)), moit.FrontLayers(2).bits_per_pixel
    ('front2', 352)
    >>> str(moit.FrontLayers(4, tail="power6"))
    "front4(tail='power6')"
    >>> moit.FrontLayers(2, tail="neural-bounded6", key_bits=32).bits_per_pixel
    352
    """

    layers: int
    tail: str | Technique = USUAL_TAIL
    normalize: bool = dataclasses.field(default=True, kw_only=True)
    key_bits: int = dataclasses.field(default=64, kw_only=True)

    kind: ClassVar[str] = "front"
    counted: ClassVar[str] = "layers"
    usual: ClassVar[int] = 2
    listed: ClassVar[Listed] = ({"layers": 2},)
    family: ClassVar[str] = "strongest"
    source: ClassVar[str] = "ours"

    def __post_init__(self) -> None:
        whole(self, "layers", 1, MOST_LAYERS)
        flag(self, "normalize")
        one_of("key_bits", self.key_bits, KEY_BITS)
        if self.tail == USUAL_TAIL:
            return
        found = technique(self.tail)
        if not isinstance(found, TAILS):
            raise ValueError(
                "tail: expected power or trigonometric moments, or bounded neural transmittance, "
                f"got {found}"
            )
        if getattr(found, "in_halves", False) or getattr(found, "bits", 32) == 16:
            raise ValueError(
                f"tail: the nearest fragments are taken out of sums over all, and {found} has "
                "rounded these after each; expected numbers of 32 bits"
            )
        if found.block_side > 1 or not getattr(found, "normalize", True):
            raise ValueError(
                f"tail: expected a state of each pixel, and no 'normalize' of its own, got {found}"
            )
        if self.key_bits < 64 and found.range_per_pixel:
            raise ValueError(
                "key_bits: keys of 32 bits have depth in the image's range, as no pixel's own is "
                f"known yet; expected 64 with the tail {found}, got {self.key_bits}"
            )
        hold(self, "tail", str(found) if found.has_name else found)

    @property
    def behind(self) -> MomentTechnique:
        """What reads moments of the fragments that are not kept."""
        found = technique(self.tail)
        assert isinstance(found, MomentTechnique)
        return found

    @property
    def bits_per_pixel(self) -> float | None:
        held = self.behind.bits_per_pixel
        assert held is not None
        return self.key_bits * self.layers + held + 64 * self.normalize

    @property
    def depth_warp(self) -> str | None:
        return self.behind.depth_warp

    @property
    def range_per_pixel(self) -> bool:
        return self.behind.range_per_pixel

    @property
    def has_name(self) -> bool:
        return isinstance(self.tail, str)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        tail = self.behind.fields_for_core(dtype)
        own = {
            "normalize": self.normalize,
            "count": self.layers,
            "small_keys": self.key_bits < 64,
        }
        moments = {"tail": NUMBERS[self.behind.kind], "moment_count": self.behind.moment_count}
        unread = {"overestimation": 0.0, "exclude_self": False, "wrapping_zone": 0.0}
        known = {name: tail[name] for name in TAIL_FIELDS if name in tail}
        return {**unread, **known, **super().fields_for_core(dtype), **own, **moments}

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        assert self.unit_range is not None
        warp = self.depth_warp or WARPS[-1]
        depth_to_warp(f, warp, "pixel" if self.range_per_pixel else "image", self.unit_range)
        return super().fields_for(f)

    def shipped_to(self) -> Targets | None:
        tail = self.behind.drawn_to()
        assert tail
        words = KeyWords(self.layers * self.key_bits // 32, of_all=True)
        return Targets(tail.held, added("16f", Target("rgba16f", "add")), words=words)
