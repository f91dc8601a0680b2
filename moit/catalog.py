"""The techniques: what each stores per pixel, by which options, and where it was published.

A technique is a small frozen dataclass. `str` gives its name with the options that differ from the
default; `technique` reads that back.
"""

from __future__ import annotations

import ast
import dataclasses
import difflib
import math
import numbers
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.arguments import one_of, truth
from moit.arrays import as_array, finite
from moit.exceptions import FragmentsError

if TYPE_CHECKING:
    from moit.fragments import Fragments

# alpha is clamped to this where its logarithm is taken (MT, supplement 1.1).
MAX_ALPHA = 1 - 0.5 / 256

WARPS = ("log", "linear", "none")
DEPTH_RANGES = ("image", "pixel")
WEIGHTS = ("blog", "eq7", "eq8", "eq9", "eq10", "phenomenological")
GIVEN_WEIGHTS = len(WEIGHTS)

# A weight of weighted blending: (depth (N,), alpha (N,), color (N, 3) or None) -> (N,).
Weight = Callable[[NDArray[Any], NDArray[Any], NDArray[Any] | None], NDArray[Any]]

# The order of moit_kind in csrc/moit.h.
KINDS = (
    "sorted",
    "unsorted",
    "weighted-sum",
    "weighted-average",
    "wboit",
    "power",
)


@dataclasses.dataclass(frozen=True)
class Technique:
    """Base of all techniques.

    order_independent : whether fragments may arrive in any order.
    bits_per_pixel : state beyond a colour accumulation target; None where it grows with the
        fragments.
    published_bits : the same as papers count it, by the paper's short name.
    has_curve : whether there is a transmittance at every depth, not only at fragments.
    unit_range : the depths that moments are taken of, or None.
    """

    order_independent: ClassVar[bool] = True
    has_curve: ClassVar[bool] = False
    source: ClassVar[str] = ""
    unit_range: ClassVar[tuple[float, float] | None] = None
    kind: ClassVar[str] = ""

    @property
    def base_name(self) -> str:
        """The name without options."""
        return self.kind

    @property
    def bits_per_pixel(self) -> float | None:
        return 0

    @property
    def published_bits(self) -> dict[str, float]:
        return {}

    @property
    def _in_name(self) -> tuple[str, ...]:
        """Options that `base_name` shows."""
        return ()

    def __str__(self) -> str:
        options = []
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name not in self._in_name and value != field.default:
                shown = getattr(value, "__name__", "callable") if callable(value) else repr(value)
                options.append(f"{field.name}={shown}")
        return self.base_name + (f"({','.join(sorted(options))})" if options else "")

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        """The fields of moit_technique (csrc/moit.h) that it sets, for numbers of dtype."""
        return {"kind": KINDS.index(self.kind)}

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        """The same for a question about `f`. FragmentsError where `f` is not what it needs."""
        return self.fields_for_core(f.depth.dtype)


@dataclasses.dataclass(frozen=True)
class Sorted(Technique):
    """The exact composite: fragments front to back, equal depths in arrival order.

    The A-buffer of Carpenter 1984; what all else is measured against. Order-independent but for
    fragments of equal depth.
    """

    kind: ClassVar[str] = "sorted"
    has_curve: ClassVar[bool] = True
    source: ClassVar[str] = "Carpenter 1984 (A-buffer), the reference"

    @property
    def bits_per_pixel(self) -> float | None:
        return None


@dataclasses.dataclass(frozen=True)
class AlphaBlend(Technique):
    """Over in arrival order, each fragment in front of those that came before it.

    Porter and Duff 1984; right only where fragments arrive back to front.
    """

    kind: ClassVar[str] = "unsorted"
    order_independent: ClassVar[bool] = False
    source: ClassVar[str] = "Porter and Duff 1984"


@dataclasses.dataclass(frozen=True)
class WeightedSum(Technique):
    """First-order terms of the composite: sum of alpha c, and 1 - sum of alpha of what is behind.

    Meshkin, "Sort-independent alpha blending", GDC 2007. Dark and even negative where opacities
    sum to more than 1. It needs no state beyond the accumulation target.
    """

    kind: ClassVar[str] = "weighted-sum"
    source: ClassVar[str] = "Meshkin 2007"


@dataclasses.dataclass(frozen=True)
class WeightedAverage(Technique):
    """n layers of the mean opacity in the mean colour weighted by opacity.

    Bavoil and Myers, "Order Independent Transparency with Dual Depth Peeling", 2008. The state
    beyond the accumulation target is the count of fragments, 32 bits.
    """

    kind: ClassVar[str] = "weighted-average"
    source: ClassVar[str] = "Bavoil and Myers 2008"

    @property
    def bits_per_pixel(self) -> float | None:
        return 32


@dataclasses.dataclass(frozen=True)
class WeightedBlended(Technique):
    """Weighted blended order-independent transparency: coverage exact, its split by a weight.

    weight : "blog" (McGuire's post; the default), "eq7" to "eq10" (the paper), "phenomenological"
        (the form in wide use), or a callable (depth (N,), alpha (N,), color (N, 3) or None)
        -> (N,) of finite weights that are not negative.
    depth_scale : scene units, for which the weights are tuned, per unit of depth; positive.
    bits : 32, floats.

    McGuire and Bavoil, JCGT 2(2), 2013, equations 7 to 10. A fragment's transmittance is
    w_i (1 - prod(1 - alpha)) / sum(alpha w): what its colour counts in the picture. There is no
    curve. The published bits are those of the revealage target.
    """

    weight: str | Weight = "blog"
    depth_scale: float = 1.0
    bits: int = 32

    kind: ClassVar[str] = "wboit"
    source: ClassVar[str] = "McGuire and Bavoil 2013 (WBOIT)"

    def __post_init__(self) -> None:
        if not callable(self.weight):
            one_of("weight", self.weight, WEIGHTS)
        _positive(self, "depth_scale")
        one_of("bits", self.bits, (32,))

    @property
    def base_name(self) -> str:
        named = isinstance(self.weight, str) and self.weight != "blog"
        return f"wboit-{self.weight}" if named else "wboit"

    @property
    def bits_per_pixel(self) -> float | None:
        return 8

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": 8, "MT": 96}

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("weight",) if isinstance(self.weight, str) else ()

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        known = isinstance(self.weight, str)
        return {
            **super().fields_for_core(dtype),
            "weight": WEIGHTS.index(str(self.weight)) if known else GIVEN_WEIGHTS,
            "depth_scale": self.depth_scale,
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        fields = super().fields_for(f)
        if callable(self.weight):
            return {**fields, "weights": self._given_weights(f)}
        if self.weight == "blog" and f.color is None:
            raise FragmentsError("color: the weight 'blog' needs it; found None")
        if f.depth_range[0] <= 0:
            _each_depth(f, f.depth > 0, f"positive depth for the weight of {self}")
        return fields

    def _given_weights(self, f: Fragments) -> NDArray[Any]:
        assert callable(self.weight)
        scale = finite(np.array(self.depth_scale), "depth_scale", f.depth.dtype)[()]
        weights = as_array(self.weight(f.depth * scale, f.alpha, f.color), "weight")
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


@dataclasses.dataclass(frozen=True)
class PowerMoments(Technique):
    """Absorbance along the ray from its power moments of depth.

    count : 4, 6 or 8 moments beside the total absorbance b0.
    bits : 32: one number of the fragments' dtype per moment.
    b0 : None; reserved for storage in fewer bits.
    overestimation : beta in [0, 1]: 0 counts what must lie in front of a depth, 1 what can.
    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm. "published": the paper's for float32 (5e-7, 5e-6, 5e-5 for 4, 6, 8 moments). None:
        5e-8, 5e-8, 1.5e-7 where the fragments are float32, and 1e-15, 1e-15, 1e-14 where they are
        float64. The default is that much less because matrices are factorised in double: nothing
        is worse for it, and what bias costs falls in proportion (README, "The bias").
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : what maps to [-1, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (eq. 2).
    exclude_self : a fragment does not occlude itself: its own absorbance is taken from what may
        lie at its depth. False: as published.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D
    2018, algorithm 1, equations 1 and 2, sections 3 and 4.
    """

    count: int
    bits: int = 32
    b0: str | None = None
    overestimation: float = 0.25
    bias: float | str | None = None
    warp: str = "log"
    depth_range: str = "image"
    normalize: bool = True
    exclude_self: bool = False
    max_alpha: float = MAX_ALPHA

    kind: ClassVar[str] = "power"
    has_curve: ClassVar[bool] = True
    source: ClassVar[str] = "Muenstermann et al. 2018 (MBOIT), algorithm 1"
    unit_range: ClassVar[tuple[float, float] | None] = (-1.0, 1.0)

    def __post_init__(self) -> None:
        one_of("count", self.count, (4, 6, 8))
        one_of("bits", self.bits, (32,))
        one_of("b0", self.b0, (None,))
        _within(self, "overestimation", 0, 1)
        if isinstance(self.bias, str):
            one_of("bias", self.bias, ("published",))
        elif self.bias is not None:
            _within(self, "bias", 0, 1)
        one_of("warp", self.warp, WARPS)
        one_of("depth_range", self.depth_range, DEPTH_RANGES)
        if self.warp == "none" and self.depth_range == "pixel":
            raise ValueError("depth_range: 'pixel' has no meaning with warp='none'")
        for name in ("normalize", "exclude_self"):
            _hold(self, name, truth(name, getattr(self, name)))
        _within(self, "max_alpha", 0, 1)
        if not 0 < self.max_alpha < 1:
            raise ValueError(f"max_alpha: expected a number in (0, 1), got {self.max_alpha}")

    @property
    def base_name(self) -> str:
        return f"power{self.count}"

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("count",)

    @property
    def bits_per_pixel(self) -> float | None:
        extent = 64 if self.depth_range == "pixel" else 0  # the pixel's near and far
        return (self.count + 1) * self.bits + extent

    @property
    def published_bits(self) -> dict[str, float]:
        bits: dict[str, float] = {"MBOIT": (self.count + 1) * self.bits}
        return bits | ({"NMT": 320} if self.count == 4 else {})

    def bias_for(self, dtype: Any) -> float:
        """What `bias` comes to for moments stored as `dtype`, float32 or float64."""
        if self.bias is None or isinstance(self.bias, str):
            return _core.bias(self.count, self.bias or np.dtype(dtype).name)
        return float(self.bias)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.count,
            "bias": self.bias_for(dtype),
            "overestimation": self.overestimation,
            "warp": WARPS.index(self.warp),
            "range_per_pixel": self.depth_range == "pixel",
            "normalize": self.normalize,
            "exclude_self": self.exclude_self,
            "max_alpha": self.max_alpha,
        }

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        near = f.depth_range[0]
        if self.warp == "log" and (near <= 0 or self.depth_range == "pixel"):
            _each_depth(f, f.depth > 0, "positive depth for the log warp; use warp='linear'")
            if self.depth_range == "image":
                raise FragmentsError(
                    f"depth_range: found {f.depth_range}; needed a positive near for the log warp; "
                    "use warp='linear'"
                )
        if self.warp == "none":
            _each_depth(f, np.abs(f.depth) <= 1, "depth in [-1, 1] with warp='none'")
        return super().fields_for(f)


def _each_depth(f: Fragments, good: NDArray[np.bool_], needed: str) -> None:
    if not good.all():
        at = int(np.argmin(good))
        raise FragmentsError(f"depth[{at}]: found {f.depth[at]}; needed {needed}")


def _hold(technique: Technique, name: str, value: Any) -> None:
    """Sets an option of a frozen technique that is just being made."""
    object.__setattr__(technique, name, value)


def _hold_number(technique: Technique, name: str) -> float:
    """Turns an option into a float, so that `str` shows what `technique` reads."""
    value = getattr(technique, name)
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {number}")
    _hold(technique, name, number)
    return number


def _within(technique: Technique, name: str, least: float, most: float) -> None:
    number = _hold_number(technique, name)
    if not least <= number <= most:
        raise ValueError(f"{name}: expected a number from {least} to {most}, got {number}")


def _positive(technique: Technique, name: str) -> None:
    number = _hold_number(technique, name)
    if not number > 0:
        raise ValueError(f"{name}: expected a positive number, got {number}")


def _catalog() -> dict[str, Technique]:
    listed: list[Technique] = [
        Sorted(),
        AlphaBlend(),
        WeightedSum(),
        WeightedAverage(),
        *(WeightedBlended(weight) for weight in WEIGHTS),
        *(PowerMoments(count) for count in (4, 6, 8)),
    ]
    return {one.base_name: one for one in listed}


CATALOG = _catalog()


def techniques() -> list[Technique]:
    """One of every kind, with default options, in the order of the documentation's table."""
    return list(CATALOG.values())


def technique(name: str | Technique) -> Technique:
    """The technique that `name` stands for: the inverse of `str`.

    name : as `power4` or `power4(bias=0.0,exclude_self=True)`: a name of `techniques()` and
        options of its class as Python literals. A technique is returned as it is.

    Raises ValueError where there is no such technique (with the nearest match) or option, or an
    option's value is bad; TypeError where `name` is no string.
    """
    if isinstance(name, Technique):
        if name.kind not in KINDS:
            raise TypeError(f"technique: {type(name).__name__} is no technique by itself")
        return name
    if not isinstance(name, str):
        raise TypeError(f"technique: expected a name or a technique, got {type(name).__name__}")
    parsed = re.fullmatch(r"\s*([^()\s]+)\s*(?:\((.*)\))?\s*", name, re.DOTALL)
    if not parsed or parsed[1] not in CATALOG:
        near = difflib.get_close_matches(parsed[1] if parsed else name, CATALOG, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(CATALOG)}"
        raise ValueError(f"technique: there is no {name!r}{hint}")
    found = CATALOG[parsed[1]]
    options = _options_in(name, parsed[2] or "")
    fields = {field.name: field for field in dataclasses.fields(found)}
    known = list(fields)
    for option, value in options.items():
        if option not in known:
            near = difflib.get_close_matches(option, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; it has {', '.join(known)}"
            raise ValueError(f"{parsed[1]}: there is no option {option!r}{hint}")
        said = getattr(found, option)
        if option in found._in_name and value != said != fields[option].default:
            raise ValueError(f"{option}: {parsed[1]} says {said!r}, got {value!r:.80}")
    try:
        return dataclasses.replace(found, **options)
    except TypeError as error:
        raise ValueError(*error.args) from None


def _options_in(name: str, text: str) -> Mapping[str, Any]:
    try:
        call = ast.parse(f"f({text})", mode="eval").body
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            names = [word.arg for word in call.keywords]
            if all(names) and len(set(names)) == len(names):
                return {str(word.arg): ast.literal_eval(word.value) for word in call.keywords}
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        pass
    raise ValueError(
        f"technique: expected options as name=value,... with plain values, got {name!r:.200}"
    )
