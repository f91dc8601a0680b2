"""Techniques that keep a few layers of each pixel."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.options import depth_to_warp, flag, whole, within
from moit.catalog.reconstruction import WARPS
from moit.catalog.technique import Technique
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments

MOST_LAYERS = _core.numbers()["MOST_LAYERS"]

# What a layer of unrounded numbers takes: depth, colour and alpha of 32 bits each.
LAYER_BITS = 160


@dataclasses.dataclass(frozen=True)
class _Layers(Technique):
    layers: int

    counted: ClassVar[str] = "layers"

    def __post_init__(self) -> None:
        whole(self, "layers", 1, MOST_LAYERS)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "count": self.layers}


@dataclasses.dataclass(frozen=True)
class DepthPeeling(_Layers):
    """The foremost fragments, exactly; what lies behind them is left out.

    layers : 1 to 32 passes, each of which draws the nearest fragment behind that of the pass
        before.

    Everitt, "Interactive Order-Independent Transparency", NVIDIA 2001. The background shows through
    the layers drawn, so the image is brighter or darker than it should be by what is left out, and
    total transmittance is that of the layers drawn; the curve is exact up to the last of them and
    constant behind it. Fragments at one depth are layers of their own, in arrival order as in
    `sorted` (on a GPU only one of them would be drawn). The state is the depth of the pass
    before.

    >>> str(moit.DepthPeeling(4))
    'depth-peeling4'
    """

    kind: ClassVar[str] = "depth-peeling"
    source: ClassVar[str] = "Everitt 2001"

    @property
    def bits_per_pixel(self) -> float | None:
        return 32


@dataclasses.dataclass(frozen=True)
class KBuffer(_Layers):
    """The nearest fragments in order, over a tail of all others in the order they had to go.

    layers : 1 to 32 fragments that a pixel keeps. When one more arrives, the farthest of them (the
        last to arrive of equals) leaves and is laid over the tail.

    Bavoil, Callahan, Lefohn, Comba and Silva, "Multi-fragment Effects on the GPU using the
    k-Buffer", I3D 2007. Exact for up to `layers` + 1 fragments, and for any number that arrive
    back to front but for each being at most `layers` places late: the k-nearly sorted sequences
    that the buffer was made for. Total transmittance is exact. A fragment's transmittance is what
    its colour counts with in the image; the tail has no depths, hence no curve.

    bits_per_pixel : depth, colour and alpha of `layers` fragments, 160 bits each; the tail is the
        accumulation target.

    >>> str(moit.KBuffer(4))
    'kbuffer4'
    """

    kind: ClassVar[str] = "kbuffer"
    source: ClassVar[str] = "Bavoil et al. 2007"

    @property
    def needs_order(self) -> bool:
        return True  # a fragment finds its place among those that are kept

    @property
    def bits_per_pixel(self) -> float | None:
        return self.layers * LAYER_BITS


@dataclasses.dataclass(frozen=True)
class HybridTransparency(_Layers):
    """The foremost fragments exactly, over a weighted average of all others.

    layers : 1 to 32 fragments in the core.

    Maule, Comba, Torchelsen and Bastos, "Hybrid Transparency", I3D 2013. The tail is blended as
    Bavoil and Myers' weighted average: n fragments of the mean opacity, in the mean colour weighted
    by opacity; so total transmittance is exact up to `layers` + 1 fragments only. Fragments at one
    depth are taken in arrival order. A fragment's transmittance is what its colour counts with in
    the image; the tail has no depths, hence no curve.

    bits_per_pixel : depth, colour and alpha of `layers` fragments, 160 bits each, and 32 for the
        count of the tail's; its sums are the accumulation target.

    >>> str(moit.HybridTransparency(4))
    'hybrid4'
    """

    kind: ClassVar[str] = "hybrid"
    source: ClassVar[str] = "Maule et al. 2013"
    uses_atomics: ClassVar[bool] = True  # the core is found without any order

    @property
    def bits_per_pixel(self) -> float | None:
        return self.layers * LAYER_BITS + 32


def _check_storage(technique: AdaptiveTransparency | MultiLayerAlphaBlending) -> None:
    flag(technique, "quantized")
    one_of("warp", technique.warp, WARPS)
    if technique.warp != "log" and not technique.quantized:
        raise ValueError(
            f"warp: {technique.warp!r} has no meaning with quantized=False, where depth is held "
            "as it is"
        )


def _storage_fields(technique: AdaptiveTransparency | MultiLayerAlphaBlending) -> dict[str, Any]:
    return {
        "quantized": technique.quantized,
        "warp": WARPS.index(technique.depth_warp or "none"),
    }


def _check_depth(technique: AdaptiveTransparency | MultiLayerAlphaBlending, f: Fragments) -> None:
    if technique.quantized:
        assert technique.unit_range is not None
        depth_to_warp(f, technique.warp, "image", technique.unit_range)


@dataclasses.dataclass(frozen=True)
class AdaptiveTransparency(Technique):
    """Transmittance as a few steps; the step that matters least goes when there is one too many.

    nodes : 2 to 32 steps, each a depth and the transmittance behind it.
    quantized : depth and transmittance as words of 16 bits, rounded after each fragment; False:
        numbers of the fragments' dtype, and depth as it is.
    warp : what depth goes through before it becomes a word: "log" (depth must be positive),
        "linear", or "none": depth lies in [0, 1] already. Which step matters least depends on it:
        areas are measured in the depth that is held.

    Salvi, Montgomery and Lefohn, "Adaptive Transparency", HPG 2011; the depth's words are those of
    Muenstermann et al. 2018, section 7.3. Of the nodes between the first and the last that one is
    left out which takes the least area from under the function, the first of equals. So the
    transmittance is never too high (but for rounding), its end is exact, and up to `nodes`
    fragments all of it is. A second pass composites with it, without renormalisation: what steps
    take too early is missing from the image. Fragments do not occlude others of equal depth; where
    they count with more than the pixel covers, its colours are scaled to that. Of a word's last bit
    as many layers show as there are behind it: of 10,000 with alpha .01 up to .0015, by which
    float32 may differ from float64.

    >>> str(moit.AdaptiveTransparency(2))
    'adaptive2'
    """

    nodes: int
    quantized: bool = True
    warp: str = "log"

    kind: ClassVar[str] = "adaptive"
    counted: ClassVar[str] = "nodes"
    source: ClassVar[str] = "Salvi et al. 2011"

    def __post_init__(self) -> None:
        whole(self, "nodes", 2, MOST_LAYERS)
        _check_storage(self)

    @property
    def depth_warp(self) -> str | None:
        return self.warp if self.quantized else None

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {"quantized": True} if words else {"quantized": False, "warp": "log"}

    @property
    def bits_per_pixel(self) -> float | None:
        return self.nodes * (32 if self.quantized else 64)

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": self.nodes * 32} if self.quantized else {}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "count": self.nodes, **_storage_fields(self)}

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        _check_depth(self, f)
        return super().fields_for(f)


@dataclasses.dataclass(frozen=True)
class MultiLayerAlphaBlending(Technique):
    """A few layers in order; of each fragment too many the two farthest layers blend into one.

    layers : 1 to 32.
    quantized : premultiplied colour and transmittance as half floats (RGBA16F), rounded after each
        fragment, and depth as a word of 16 bits; False: numbers of the fragments' dtype, and depth
        as it is.
    warp : what depth goes through before it becomes a word: "log" (depth must be positive),
        "linear", or "none": depth lies in [0, 1] already.
    min_alpha : fragments of lesser alpha are skipped; 0 takes all. Half floats hold transmittance
        to 0.0005 below 1, so the default drops little more than rounding would.

    Salvi and Vaidyanathan, "Multi-layer Alpha Blending", I3D 2014; storage as Muenstermann et al.
    2018, section 7.3 and table 1. A blended layer stands where its front one stood; a fragment goes
    in front of a layer of its depth, so of equal depths the later is in front. Exact for up to
    `layers` + 1 fragments that are not skipped, and for any number that arrive front to back or
    back to front, but for storage. Colours beyond 65504 are held as that. A fragment's
    transmittance is that of the layers in front of its depth when all fragments are in; what
    colours counted with in the image may differ where layers were blended out of order.

    >>> str(moit.MultiLayerAlphaBlending(4))
    'mlab4'
    """

    layers: int
    quantized: bool = True
    warp: str = "log"
    min_alpha: float = 0.001

    kind: ClassVar[str] = "mlab"
    counted: ClassVar[str] = "layers"
    source: ClassVar[str] = "Salvi and Vaidyanathan 2014"

    def __post_init__(self) -> None:
        whole(self, "layers", 1, MOST_LAYERS)
        within(self, "min_alpha", 0, 1)
        _check_storage(self)

    @property
    def depth_warp(self) -> str | None:
        return self.warp if self.quantized else None

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {"quantized": True} if words else {"quantized": False, "warp": "log"}

    @property
    def bits_per_pixel(self) -> float | None:
        return self.layers * (80 if self.quantized else LAYER_BITS)

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": self.layers * 80} if self.quantized else {}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.layers,
            "min_alpha": self.min_alpha,
            **_storage_fields(self),
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        _check_depth(self, f)
        return super().fields_for(f)
