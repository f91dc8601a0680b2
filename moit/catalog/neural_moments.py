"""Techniques in which a network reads transmittance, or a colour, off sums over a pixel."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit.catalog.network import network_of
from moit.catalog.neural import NetworkOption, hold_network
from moit.catalog.options import WARPS, depth_to_warp, flag, within
from moit.catalog.reconstruction import DEPTH_RANGES, MAX_ALPHA
from moit.catalog.targets import Target, Targets, added, held_in
from moit.catalog.technique import Technique
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments


@dataclasses.dataclass(frozen=True)
class _Networked(Technique):
    """Options of techniques whose network sees warped depth and absorbance."""

    network: NetworkOption = None
    warp: str = dataclasses.field(default="log", kw_only=True)
    max_alpha: float = dataclasses.field(default=MAX_ALPHA, kw_only=True)

    def __post_init__(self) -> None:
        one_of("warp", self.warp, WARPS)
        within(self, "max_alpha", 0, 1)
        if not 0 < self.max_alpha < 1:
            raise ValueError(f"max_alpha: expected a number in (0, 1), got {self.max_alpha}")
        hold_network(self, self.network, self.network_kind)

    @property
    def depth_warp(self) -> str | None:
        return self.warp

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "warp": WARPS.index(self.warp),
            "max_alpha": self.max_alpha,
            "network": network_of(self.network, self.network_kind).packed(),
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        assert self.unit_range is not None
        depth_to_warp(f, self.warp, "image", self.unit_range)
        return super().fields_for(f)


@dataclasses.dataclass(frozen=True)
class NeuralMoments(_Networked):
    """Transmittance that a network reads off power moments of depth.

    network : None, the one that comes with moit; the path of a file that `moit.train` or
        `Network.write` wrote; or a `moit.Network`: of the kind `network_kind`, as networks for one
        range of depth know nothing of the other.
    depth_range : what maps to [-1, 1] where moments are taken: "image", the fragments' depth_range,
        as published; or "pixel", each pixel's own extent. With the latter the error of colours is
        a third to two thirds less on four kinds of random rays; it takes a pass more, that
        finds extents before moments are gathered.
    warp : what depth goes through first: "log" (depth must be positive), "linear", or "none":
        depth lies in [-1, 1] already.
    normalize : scale a pixel's colours so that their weights sum to what is covered (eq. 7).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    There is no resolution: the network sees where its pixel's fragments begin and end and how many
    there are, and nothing of a block of pixels is a mean of that. `neural-bounded` has states of
    blocks.

    Tsopouridis, Vasilakis and Fudos, "Neural Moment Transparency", Eurographics Short Papers 2024,
    equations 4 to 7, section 3.1, figure 3. Of seven features the network, of 32 and 16 hidden
    values with ReLU, makes the logit of T: the fragment's depth between its pixel's ends on an
    exponential scale, the count of fragments, the total absorbance b0, and the sums b1 to b4 of
    absorbance times powers of depth.

    What the paper leaves open: one fragment, or several at one depth, have 0 for depth between the
    ends; where extents are rounded, that is clamped to [0, 1]; no other feature is bounded, so that
    more fragments than the network was trained on give what it makes of them, of which eq. 7 keeps
    the scale right. It is not bound to fall with depth, and sees only sums: the fragment's own
    opacity is unknown to it. Unlike published, T is no less than the total, which is exact; a curve
    is 1 in front of the pixel's extent and the total behind it.

    bits_per_pixel : b0 and four moments, the count, and an extent of 32 bits: half floats as
        published, or with depth_range "pixel" words. The sum of weights is in the accumulation
        target's alpha.

    >>> str(moit.NeuralMoments())
    'neural'
    """

    depth_range: str = dataclasses.field(default="pixel", kw_only=True)
    normalize: bool = dataclasses.field(default=True, kw_only=True)

    kind: ClassVar[str] = "neural"
    family: ClassVar[str] = "power, neural"
    source: ClassVar[str] = "Tsopouridis et al. 2024 (NMT)"
    papers: ClassVar[tuple[str, ...]] = ("tsopouridis2024neural",)

    def __post_init__(self) -> None:
        one_of("depth_range", self.depth_range, DEPTH_RANGES)
        flag(self, "normalize")
        super().__post_init__()

    @property
    def network_kind(self) -> str:
        return "neural" if self.range_per_pixel else "neural-image"

    @property
    def range_per_pixel(self) -> bool:
        return self.depth_range == "pixel"

    @property
    def bits_per_pixel(self) -> float | None:
        return 32 * 5 + 32 + 2 * 16

    @property
    def published_bits(self) -> dict[str, float]:
        return {"NMT": 352}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "range_in_words": self.range_per_pixel,
            "normalize": self.normalize,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        """The paper's; its half floats are words where a round before has to find extents."""
        # -z and z; words are of what is above -1
        extent = Target("rg16", "max") if self.range_per_pixel else Target("rg16f", "max", -1.0)
        return Targets((*held_in(("rgba32f", "rg32f")), extent), added(colours))


@dataclasses.dataclass(frozen=True)
class DeepFragments(_Networked):
    """The two nearest fragments exactly, and behind them a colour that a network makes of sums.

    network : None, the one that comes with moit; the path of a file that `moit.train` or
        `Network.write` wrote; or a `moit.Network` of kind "dfa".
    warp : what depth goes through for the network: "log" (depth must be positive), "linear", or
        "none": depth lies in [0, 1] already.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    After DFA: Tsopouridis, Vasilakis and Fudos, "Deep and Fast Approximate Order Independent
    Transparency", CGF 2024, as far as "Neural Moment Transparency" by the same authors tells of it:
    it knows the two closest fragments' colours, what its features tell covers the pixel's whole
    depth and colours, it predicts the pixel's colour, and takes 352 bits. All else is inferred:

    - A first pass finds the depths of the two nearest and of the last fragment and the total
      absorbance; a second composites the two, and sums up the others, once with their absorbance
      for weight and once with that times exp(-b0 v), what would reach them if absorbance were
      spread evenly from the second fragment (v = 0) to the last (v = 1).
    - Both sums are a guess of the colour behind the two. The network sees the absorbance there, the
      share of it that the weights leave, the transmittance, and the distances from the first to
      the second and from that to the last fragment; it says with which share the first guess
      counts. So the colour predicted lies within those of the fragments, however bright these are,
      and is scaled by what is covered. Layers of 32 and 16 hidden values, as NMT's.

    Exact for up to two fragments and for one of any number that is opaque in their place. Fragments
    at one depth are taken in arrival order. Sums are rounded to half floats after each fragment, as
    render targets would, so that arrival order shows by that much. Total transmittance is exact. A
    fragment's transmittance is what its colour counts with in the image by its alpha, which may be
    more than 1; for lack of one behind the second fragment there is no curve. Colours beyond 65504
    times their absorbance are held as that.

    bits_per_pixel : two depths and b0 in 32 bits, the last depth, a colour with its weight and a
        colour without in 16 bits a number; the two nearest fragments' colour is the accumulation
        target.

    >>> str(moit.DeepFragments())
    'dfa'
    """

    bits: ClassVar[int] = 16  # of a sum's number
    layers: ClassVar[int] = 2  # that are kept as they are
    kind: ClassVar[str] = "dfa"
    family: ClassVar[str] = "power, neural"
    source: ClassVar[str] = "Tsopouridis et al. 2024 (DFA, as NMT tells of it)"
    papers: ClassVar[tuple[str, ...]] = ("tsopouridis2024deep", "tsopouridis2024neural")

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {} if words else None  # sums are half floats

    @property
    def bits_per_pixel(self) -> float | None:
        return 3 * 32 + (1 + 4 + 3) * 16

    @property
    def published_bits(self) -> dict[str, float]:
        return {"NMT": 352}
