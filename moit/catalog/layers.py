"""Techniques that keep a few layers of each pixel."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.options import WARPS, depth_to_warp, flag, whole, within
from moit.catalog.renormalised import Renormalised
from moit.catalog.targets import Target, Targets, added, formats_for, held_in, multiplied
from moit.catalog.technique import Listed, Technique
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

    def _layers_and(self, *tail: Target) -> Targets:
        """What holds them, and what leaves them is blended to."""
        held = held_in(formats_for(5 * self.layers, "32f"), "ordered")
        return Targets(held, tail=tail)


@dataclasses.dataclass(frozen=True)
class DepthPeeling(Renormalised, _Layers):
    """The foremost fragments, exactly; what lies behind them is left out.

    layers : 1 to 32 passes, each of which draws the nearest fragment behind that of the pass
        before.
    normalize : what all fragments together let through is multiplied up in a target of its own, and
        the layers drawn are scaled to cover the rest (MBOIT eq. 2). False, as published.

    Everitt, "Interactive Order-Independent Transparency", NVIDIA 2001. The background shows through
    the layers drawn, so the image is brighter or darker than it should be by what is left out, and
    total transmittance is that of the layers drawn, unless normalised; the curve is exact up to the
    last of them and constant behind it. Fragments at one depth are layers of their own, in arrival
    order as in `sorted` (on a GPU only one of them would be drawn). The state is the depth of the
    pass before.

    >>> str(moit.DepthPeeling(4))
    'depth-peeling4'
    """

    normalize: bool = False

    kind: ClassVar[str] = "depth-peeling"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = ({"layers": 4},)
    family: ClassVar[str] = "layers"
    source: ClassVar[str] = "Everitt 2001"
    papers: ClassVar[tuple[str, ...]] = ("everitt2001",)

    @property
    def bits_per_pixel(self) -> float | None:
        return 64 if self.normalize else 32

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_normalize()

    def shipped_to(self) -> Targets | None:
        return Targets(shaded=(Target("rgba16f", "under"),), rounds=self.layers)


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
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = ({"layers": 4},)
    family: ClassVar[str] = "layers"
    source: ClassVar[str] = "Bavoil et al. 2007"
    papers: ClassVar[tuple[str, ...]] = ("bavoil2007",)

    @property
    def needs_order(self) -> bool:
        return True  # a fragment finds its place among those that are kept

    @property
    def bits_per_pixel(self) -> float | None:
        return self.layers * LAYER_BITS

    def shipped_to(self) -> Targets | None:
        return self._layers_and(Target("rgba16f", "over"))


@dataclasses.dataclass(frozen=True)
class HybridTransparency(Renormalised, _Layers):
    """The foremost fragments exactly, over a weighted average of all others.

    layers : 1 to 32 fragments in the core.
    normalize : what the others cover is exact, multiplied up in place of their count: so total
        transmittance is exact, and colours are those of the core and the rest of the coverage in
        the tail's mean colour. False, as published.
    core_alpha : in [0, 1]: what has less alpha never is in the core, and counts as behind it. So
        faint fragments in front, of which splats have many, leave the core to those that are seen
        (Hahlbohm et al., "Efficient Perspective-Correct 3D Gaussian Splatting Using Hybrid
        Transparency", 2025, who have 0.05 and normalize). 0: all compete.

    Maule, Comba, Torchelsen and Bastos, "Hybrid Transparency", I3D 2013. The tail is blended as
    Bavoil and Myers' weighted average: n fragments of the mean opacity, in the mean colour weighted
    by opacity; so total transmittance is exact up to `layers` + 1 fragments only. Fragments at one
    depth are taken in arrival order. A fragment's transmittance is what its colour counts with in
    the image; the tail has no depths, hence no curve.

    bits_per_pixel : depth, colour and alpha of `layers` fragments, 160 bits each, and 32 for the
        count of the tail's or what it lets through; its sums are the accumulation target.

    >>> str(moit.HybridTransparency(4))
    'hybrid4'
    """

    normalize: bool = False
    core_alpha: float = 0.0

    kind: ClassVar[str] = "hybrid"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = ({"layers": 4},)
    family: ClassVar[str] = "layers"
    source: ClassVar[str] = "Maule et al. 2013"
    papers: ClassVar[tuple[str, ...]] = ("maule2013",)

    @property
    def uses_atomics(self) -> bool:
        return True  # the core is found without any order

    @property
    def bits_per_pixel(self) -> float | None:
        return self.layers * LAYER_BITS + 32

    @property
    def exact_up_to(self) -> int:
        return 1 if self.core_alpha else super().exact_up_to

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_normalize()
        within(self, "core_alpha", 0, 1)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "core_alpha": self.core_alpha}

    def shipped_to(self) -> Targets | None:
        total = multiplied() if self.normalize else Target("r16f", "add")
        return self._layers_and(*added("16f", total))


class _Merging(Technique):
    """What those share that merge neighbours where there is one too many; options are theirs."""

    quantized: bool
    warp: str | None
    merge: str

    merges: ClassVar[tuple[str, ...]]

    def _check_merging(self) -> None:
        flag(self, "quantized")
        one_of("merge", self.merge, self.merges)
        if self.warp is not None:
            one_of("warp", self.warp, WARPS)

    @property
    def by_energy(self) -> bool:
        return self.merge == "energy"

    @property
    def depth_warp(self) -> str | None:
        if self.warp is None and (self.quantized or self.by_energy):
            return "log"
        return self.warp

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {"quantized": words}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "quantized": self.quantized,
            "by_energy": self.by_energy,
            "warp": WARPS.index(self.depth_warp or "none"),
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        if self.depth_warp:
            assert self.unit_range is not None
            depth_to_warp(f, self.depth_warp, "image", self.unit_range)
        return super().fields_for(f)


@dataclasses.dataclass(frozen=True)
class AdaptiveTransparency(Renormalised, _Merging):
    """Transmittance as a few steps; the step that matters least goes when there is one too many.

    nodes : 2 to 32 steps, each a depth and the transmittance behind it.
    quantized : depth and transmittance as words of 16 bits, rounded after each fragment; False:
        numbers of the fragments' dtype.
    warp : what depth goes through before it is held: "log" (depth must be positive), "linear", or
        "none": depth lies in [0, 1] already. Which step matters least depends on it, as gaps are
        those of the depth that is held. None: "log", or where quantized=False and merge="area"
        depth as it is, in any range.
    merge : which step goes, and where. "area", as published: of the nodes between the first and the
        last that one which takes the least area from under the function, the first of equals; its
        step is taken where the node before it stands. "energy", ours: those two neighbours become
        one whose merging harms the picture least (csrc/kernels/adaptive.h), at the mean of their
        depths weighted by what they take of the light, or at the farther one's where that takes
        more than one and a half times as much.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
        False, as published: what steps take too early is missing from the image.

    Salvi, Montgomery and Lefohn, "Adaptive Transparency", HPG 2011; the depth's words are those of
    Muenstermann et al. 2018, section 7.3. The end of the transmittance is exact (but for rounding),
    and up to `nodes` fragments all of it is; as published it is never too high. A second pass
    composites with it. Fragments do not occlude others of equal depth; where they count with more
    than the pixel covers, its colours are scaled to that. With normalize=True colours are three to
    four times as close to the exact ones as published, and with merge="energy" as well two to four
    times again (docs/renormalised.md). Of a word's last bit as many layers show as there are behind
    it: of 10,000 with alpha .01 up to .0015, by which float32 may differ from float64.

    >>> str(moit.AdaptiveTransparency(2))
    'adaptive2'
    >>> str(moit.AdaptiveTransparency(8, merge="energy", normalize=True))
    "adaptive8(merge='energy',normalize=True)"
    """

    nodes: int
    quantized: bool = True
    warp: str | None = None
    merge: str = "area"
    normalize: bool = False

    kind: ClassVar[str] = "adaptive"
    counted: ClassVar[str] = "nodes"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = ({"nodes": 4},)
    family: ClassVar[str] = "layers"
    source: ClassVar[str] = "Salvi et al. 2011"
    papers: ClassVar[tuple[str, ...]] = ("salvi2011",)
    merges: ClassVar[tuple[str, ...]] = ("area", "energy")

    def __post_init__(self) -> None:
        whole(self, "nodes", 2, MOST_LAYERS)
        self._check_merging()
        self._check_normalize()

    @property
    def bits_per_pixel(self) -> float | None:
        return self.nodes * (32 if self.quantized else 64)

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": self.nodes * 32} if self.quantized else {}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "count": self.nodes}

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        return Targets(held_in(formats_for(2 * self.nodes, "32f"), "ordered"), added(colours))


@dataclasses.dataclass(frozen=True)
class MultiLayerAlphaBlending(_Merging):
    """A few layers in order; of each fragment too many two neighbours blend into one.

    layers : 1 to 32.
    quantized : premultiplied colour and transmittance as half floats (RGBA16F), rounded after each
        fragment, and depth as a word of 16 bits; False: numbers of the fragments' dtype.
    warp : what depth goes through before it is held: "log" (depth must be positive), "linear", or
        "none": depth lies in [0, 1] already. None: "log", or where quantized=False and
        merge="last" depth as it is, in any range.
    min_alpha : fragments of lesser alpha are skipped; 0 takes all. Half floats hold transmittance
        to 0.0005 below 1, so the default drops little more than rounding would.
    merge : which two neighbours blend. "last", as published: the two farthest, which stand where
        the front one stood. "energy", ours: those whose blending harms the picture least
        (csrc/kernels/mlab.h), where the one stood that takes more of the light.
    buckets : of depth (MLABDB): the first layer is for what lies in front of the first fragment
        with front_alpha, the others for what does not, up to the first with back_alpha; what lies
        behind that is dropped. So many faint fragments in front push nothing together that is seen
        clearly. At least two layers; where both ends are is found in a pass before.
    front_alpha, back_alpha : of at least so much, from 0 to 1; as published 0.25 and 0.98.

    Salvi and Vaidyanathan, "Multi-layer Alpha Blending", I3D 2014; storage as Muenstermann et al.
    2018, section 7.3 and table 1. A fragment goes in front of a layer of its depth, so of equal
    depths the later is in front. Exact for up to `layers` + 1 fragments that are not skipped, and
    for any number of distinct depths that arrive front to back or back to front, but for storage.
    Nothing is to be renormalised: layers that are blended keep all that they take. Colours beyond
    65504 are held as that. A fragment's transmittance is that of the layers in front of its depth
    when all fragments are in; what colours counted with in the image may differ where layers were
    blended out of order. Buckets: Kern, Neuhauser, Maack, Han, Usher and Westermann, "A Comparison
    of Rendering Techniques for 3D Line Sets with Transparency", TVCG 2021, as their LineVis has
    them; the first layer is exact for two fragments, and of what is dropped up to
    1 - back_alpha is missing.

    >>> str(moit.MultiLayerAlphaBlending(4))
    'mlab4'
    >>> str(moit.MultiLayerAlphaBlending(4, merge="energy"))
    "mlab4(merge='energy')"
    >>> str(moit.MultiLayerAlphaBlending(8, buckets=True))
    'mlab8(buckets=True)'
    """

    layers: int
    quantized: bool = True
    warp: str | None = None
    min_alpha: float = 0.001
    merge: str = "last"
    buckets: bool = dataclasses.field(default=False, kw_only=True)
    front_alpha: float = dataclasses.field(default=0.25, kw_only=True)
    back_alpha: float = dataclasses.field(default=0.98, kw_only=True)

    kind: ClassVar[str] = "mlab"
    counted: ClassVar[str] = "layers"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = tuple({"layers": layers} for layers in (2, 4, 6))
    family: ClassVar[str] = "layers"
    source: ClassVar[str] = "Salvi and Vaidyanathan 2014"
    papers: ClassVar[tuple[str, ...]] = ("salvi2014",)
    merges: ClassVar[tuple[str, ...]] = ("last", "energy")

    def __post_init__(self) -> None:
        whole(self, "layers", 1, MOST_LAYERS)
        for alpha in ("min_alpha", "front_alpha", "back_alpha"):
            within(self, alpha, 0, 1)
        flag(self, "buckets")
        self._check_merging()
        if self.buckets and (self.layers < 2 or self.merge != "last"):
            raise ValueError(
                "buckets: expected at least 2 layers and merge='last', got "
                f"{self.layers} and {self.merge!r}"
            )

    @property
    def bits_per_pixel(self) -> float | None:
        """Layers, and the two depths at which buckets end."""
        ends = 2 * (16 if self.quantized else 32) if self.buckets else 0
        return self.layers * (80 if self.quantized else LAYER_BITS) + ends

    @property
    def exact_up_to(self) -> int:
        return 1 if self.buckets else super().exact_up_to

    @property
    def geometry_passes(self) -> int | None:
        return 2 if self.buckets else super().geometry_passes

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": self.layers * 80} if self.quantized else {}

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.layers,
            "min_alpha": self.min_alpha,
            "buckets": self.buckets,
            "front_alpha": self.front_alpha,
            "back_alpha": self.back_alpha,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        # where buckets end: words of how far before the farthest depth
        ends = (Target("rg16", "max"),) if self.buckets else ()
        return Targets((*held_in(formats_for(5 * self.layers, "32f"), "ordered"), *ends))
