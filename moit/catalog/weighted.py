"""Techniques that weigh each fragment by itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog.options import each_depth, names_of, positive
from moit.catalog.renormalised import Renormalised
from moit.catalog.targets import Target, Targets, added, multiplied
from moit.catalog.technique import Listed, Technique
from moit.checks.arguments import one_of
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError
from moit.fragments.fragments import Fragments

WEIGHTS = tuple(one for one in names_of("WEIGHT") if one != "given")

# A weight of weighted blending: (depth (N,), alpha (N,), color (N, 3) or None) -> (N,).
Weight = Callable[[NDArray[Any], NDArray[Any], NDArray[Any] | None], NDArray[Any]]


@dataclasses.dataclass(frozen=True)
class WeightedSum(Renormalised):
    """First-order terms of the composite: sum of alpha c, and 1 - sum of alpha of what is behind.

    normalize : coverage is exact, multiplied up in a target of its own, and colours are scaled to
        it (MBOIT eq. 2): the colours of `weighted-average` with the coverage of `wboit`. False, as
        published.

    Meshkin, "Sort-independent alpha blending", GDC 2007. As published dark and even negative where
    opacities sum to more than 1, with no state beyond the accumulation target.

    >>> str(moit.WeightedSum())
    'weighted-sum'
    """

    normalize: bool = False

    kind: ClassVar[str] = "weighted-sum"
    family: ClassVar[str] = "weighted"
    source: ClassVar[str] = "Meshkin 2007"
    papers: ClassVar[tuple[str, ...]] = ("meshkin2007",)

    def __post_init__(self) -> None:
        self._check_normalize()

    @property
    def bits_per_pixel(self) -> float | None:
        return 32 if self.normalize else 0

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        second = multiplied() if self.normalize else Target(f"r{colours}", "add")
        return Targets(shaded=added(colours, second))


@dataclasses.dataclass(frozen=True)
class WeightedAverage(Technique):
    """n layers of the mean opacity in the mean colour weighted by opacity.

    Bavoil and Myers, "Order Independent Transparency with Dual Depth Peeling", 2008. The state
    beyond the accumulation target is the count of fragments, 32 bits.

    >>> str(moit.WeightedAverage())
    'weighted-average'
    """

    kind: ClassVar[str] = "weighted-average"
    family: ClassVar[str] = "weighted"
    source: ClassVar[str] = "Bavoil and Myers 2008"
    papers: ClassVar[tuple[str, ...]] = ("bavoil2008",)

    @property
    def bits_per_pixel(self) -> float | None:
        return 32

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        return Targets(shaded=added(colours, Target(f"r{colours}", "add")))


@dataclasses.dataclass(frozen=True)
class WeightedBlended(Technique):
    """Weighted blended order-independent transparency: coverage exact, its split by a weight.

    weight : "blog" (McGuire's post; the default), "eq7" to "eq10" (the paper), "phenomenological"
        (the form in wide use), or a callable (depth (N,), alpha (N,), color (N, 3) or None)
        -> (N,) of finite weights that are not negative. With transmission alpha is the net
        coverage, as in McGuire and Mara 2016, listing 1.
    depth_scale : scene units, for which the weights are tuned, per unit of depth; positive.
    bits : 32, floats; 16, the published targets: half floats for the sums and a byte for what the
        pixel lets through, rounded at every fragment in the order of arrival. A byte loses
        fragments of alpha below 1/510, and sums stay at 65504, half's largest number.

    McGuire and Bavoil, JCGT 2(2), 2013, equations 7 to 10. A fragment's transmittance is
    w_i (1 - prod(1 - alpha)) / sum(alpha w): what its colour counts in the picture. There is no
    curve. The published bits are those of the revealage target.

    >>> str(moit.WeightedBlended())
    'wboit'
    """

    weight: str | Weight = "blog"
    depth_scale: float = 1.0
    bits: int = 32

    kind: ClassVar[str] = "wboit"
    listed: ClassVar[Listed] = tuple({"weight": weight} for weight in WEIGHTS)
    family: ClassVar[str] = "weighted"
    words: ClassVar[tuple[str, Any, Any] | None] = ("bits", 16, 32)
    source: ClassVar[str] = "McGuire and Bavoil 2013 (WBOIT)"
    papers: ClassVar[tuple[str, ...]] = ("mcguire2013",)

    def __post_init__(self) -> None:
        if not callable(self.weight):
            one_of("weight", self.weight, WEIGHTS)
        positive(self, "depth_scale")
        one_of("bits", self.bits, (32, 16))

    @property
    def base_name(self) -> str:
        named = isinstance(self.weight, str) and self.weight != "blog"
        return f"wboit-{self.weight}" if named else "wboit"

    @property
    def bits_per_pixel(self) -> float | None:
        return 8

    @property
    def cited(self) -> tuple[str, ...]:
        return (*self.papers, *(["mcguire2017"] if self.weight == "phenomenological" else []))

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": 8, "MT": 96}

    @property
    def has_name(self) -> bool:
        return isinstance(self.weight, str)

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("weight",) if isinstance(self.weight, str) else ()

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        known = isinstance(self.weight, str)
        return {
            **super().fields_for_core(dtype),
            "weight": WEIGHTS.index(str(self.weight)) if known else _core.numbers()["WEIGHT_GIVEN"],
            "depth_scale": self.depth_scale,
            "bits": self.bits,
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        fields = super().fields_for(f)
        if callable(self.weight):
            return {**fields, "weights": self._given_weights(f)}
        if self.weight == "blog" and f.color is None:
            raise FragmentsError("color: the weight 'blog' needs it; found None")
        if f.depth_range[0] <= 0:
            each_depth(f, f.depth > 0, f"positive depth for the weight of {self}")
        return fields

    def fields_for_totals(self, f: Fragments) -> dict[str, Any]:
        """Coverage is exact under any weight: one that needs nothing will do."""
        return {**self.fields_for_core(f.depth.dtype), "weight": WEIGHTS.index("eq7")}

    def _given_weights(self, f: Fragments) -> NDArray[Any]:
        assert callable(self.weight)
        scale = finite(np.array(self.depth_scale), "depth_scale", f.depth.dtype)[()]
        weights = as_array(self.weight(f.depth * scale, f.coverage, f.color), "weight")
        if weights.shape != f.depth.shape or weights.dtype.kind not in "fiu":
            raise ValueError(
                f"weight: expected the callable to give {f.depth.shape} real numbers, got "
                f"{weights.shape} of {weights.dtype}"
            )
        ready = finite(weights, "weight", f.depth.dtype)
        if len(ready) and ready.min() < 0:
            at = int(np.argmin(ready >= 0))
            raise ValueError(
                f"weight[{at}]: found {ready[at]}; needed a number that is not negative"
            )
        return ready

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        return Targets(shaded=added(colours, multiplied("r8" if self.bits == 16 else "r32f")))
