"""Which text of shaders/engine a technique goes home as, what its options decide there, and why
others have none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from moit import _core
from moit.catalog import Technique
from moit.catalog.targets import Target, targets_of

# What an engine calls, in this order, as far as a text has it.
ENTRIES = (
    "warped",
    "accumulate",
    "factor",
    "transmittance",
    "transmittance_of_sums",
    "shaded",
    "resolve",
)
DEPTH_RANGE = (0.1, 1000.0)  # of a camera, where none is said


@dataclasses.dataclass(frozen=True)
class Recipe:
    """A technique as a text for engines.

    text : below shaders/.
    held : targets of pass 1, in the order of the members of `sums`; () where one pass does all.
    shaded : of the pass that shades, likewise.
    fixed : defines that are decided here.
    values : defaults of options, which an engine may set otherwise.
    arrays : constants that the text reads by name: of networks.
    never_negative : of structs the member that no pixel has below 0 (moit.kit.wgsl).
    limits : what an engineer has to know.
    """

    text: str
    held: tuple[Target, ...]
    shaded: tuple[Target, ...]
    fixed: Mapping[str, object] = dataclasses.field(default_factory=dict)
    values: Mapping[str, float | int] = dataclasses.field(default_factory=dict)
    arrays: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    never_negative: Mapping[str, str] = dataclasses.field(default_factory=dict)
    limits: tuple[str, ...] = ()

    @property
    def passes(self) -> int:
        """Over transparent geometry."""
        return 2 if self.held else 1


def recipe_of(technique: Technique, depth_range: tuple[float, float]) -> Recipe:
    """Raises ValueError where there is none, which says why and what is nearest."""
    make = _FAMILIES.get(technique.kind)
    if make is None:
        raise _no_kit(technique, _why(technique), _nearest(technique))
    return make(technique, depth_range)


def names_with_kits() -> tuple[str, ...]:
    """Of techniques without options."""
    return tuple(name for names in _NAMES.values() for name in names)


def _no_kit(technique: Technique, why: str, nearest: str) -> ValueError:
    return ValueError(f"technique: {technique} has no kit: {why}; nearest is {nearest}")


def _why(technique: Technique) -> str:
    if technique.engine != "core":
        return "it is no single technique of passes"
    if not technique.targets:
        return "it keeps lists of fragments, which blending alone cannot make"
    if technique.needs_order:
        return "its fragments change a pixel one after the other, which blending alone cannot do"
    return "there is no text of it for engines"


def _nearest(technique: Technique) -> str:
    first = technique.kind.partition("-")[0]
    return {"unsorted": "'weighted-average'", "moment": "'power4'"}.get(first, "'power4'")


def warp_constants(warp: str, near: float, far: float) -> dict[str, float | int]:
    """The two constants that take depth to [-1, 1], and whether its logarithm is taken."""
    if warp == "none":
        return {"WARP_LOG": 0, "WARP_SCALE": 1.0, "WARP_OFFSET": 0.0}
    if warp == "linear":
        scale = 2.0 / (far - near)
        return {"WARP_LOG": 0, "WARP_SCALE": scale, "WARP_OFFSET": -1.0 - scale * near}
    scale = 2.0 / math.log2(far / near)
    return {"WARP_LOG": 1, "WARP_SCALE": scale, "WARP_OFFSET": -1.0 - scale * math.log2(near)}


def _targets(technique: Technique) -> tuple[tuple[Target, ...], tuple[Target, ...]]:
    found = targets_of(technique)
    assert found
    return found.held, found.shaded


_LARGE_SUMS = (
    "Sums of half floats stay finite up to 65504: with the weights of weighted blending, which "
    "reach 3000, some twenty bright fragments close to the eye are at their end."
)
_FLOAT_BLENDING = (
    "Targets of 32-bit floats have to blend: WebGPU needs the feature float32-blendable, Vulkan "
    "says so by VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT, and OpenGL ES needs "
    "EXT_float_blend."
)


def _weighted_blended(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    if not isinstance(technique.weight, str):
        raise _no_kit(technique, "its weight is a Python function", "'wboit'")
    near, far = depth_range
    _, shaded = _targets(technique)
    half = (shaded[0], dataclasses.replace(shaded[1], format="r8"))
    return Recipe(
        "engine/weighted.glsl",
        (),
        half,
        {"WEIGHT": f"WEIGHT_{technique.weight.upper()}"},
        {
            "DEPTH_SCALE": technique.depth_scale,
            "BUFFER_SCALE": far / (far - near),
            "BUFFER_NEAR": near,
        },
        limits=(
            "Coverage is exact; how colours share it is a guess by depth and opacity, and wrong "
            "where a near surface is nearly opaque.",
            "A target of one byte loses fragments of alpha below 1/510.",
            _LARGE_SUMS,
        ),
    )


def _weighted_average(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    _, shaded = _targets(technique)
    return Recipe(
        "engine/weighted_average.glsl",
        (),
        shaded,
        limits=("Depth has no part in it: what is behind counts as what is in front.",),
    )


def _weighted_sum(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    _, shaded = _targets(technique)
    return Recipe(
        "engine/weighted_sum.glsl",
        (),
        shaded[:1],
        limits=(
            "Depth has no part in it. Where opacities sum to more than 1 the background counts "
            "with a negative weight: clamp, or choose another technique.",
        ),
    )


def _refuse_options(technique: Any, plain: str) -> None:
    if technique.range_per_pixel:
        raise _no_kit(technique, "a pass that finds each pixel's own extent is not in it", plain)
    if not technique.normalize:
        raise _no_kit(technique, "its resolve makes weights sum to what is covered", plain)


def _power(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    name = f"'power{technique.count}'"
    _refuse_options(technique, name)
    if technique.bits == 16:
        raise _no_kit(technique, _why(technique), name)
    if technique.count not in _POWER_COUNTS:
        raise _no_kit(technique, "there is no text of it for engines", "'power4'")
    held, shaded = _targets(technique)
    return Recipe(
        f"engine/power{technique.count}.glsl",
        held,
        shaded,
        {"EXCLUDE_SELF": int(technique.exclude_self)},
        {
            "BIAS": _bias(technique),
            "BETA": technique.overestimation,
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique.warp, *depth_range),
        },
        never_negative={"sums": "target1", "factors": "factor1.w"},
        limits=(_FLOAT_BLENDING,),
    )


def _bias(technique: Any) -> float:
    fields = technique.fields_for_core(np.dtype(np.float32))
    moments = _core.pass_constants(fields, False, 1.0, 2.0)[-1]
    assert moments
    return moments[0]


_POWER_COUNTS = (4,)
_FAMILIES: dict[str, Callable[[Any, tuple[float, float]], Recipe]] = {
    "wboit": _weighted_blended,
    "weighted-average": _weighted_average,
    "weighted-sum": _weighted_sum,
    "power": _power,
}
_NAMES = {
    "wboit": ("wboit",),
    "weighted-average": ("weighted-average",),
    "weighted-sum": ("weighted-sum",),
    "power": tuple(f"power{count}" for count in _POWER_COUNTS),
}
