"""Recipes of kits whose fragments change a pixel one after the other."""

from __future__ import annotations

from typing import Any

from moit.catalog.targets import Target, shipped_targets_of
from moit.kit.recipe import Recipe, State, no_kit, recipe_for, warp_constants

FULL = 0xFFFFFFFF  # depth that no step has, before which all is let through
NOTHING = 0x3C000000  # a black layer that lets all through: half floats 0 and 1
NO_DEPTH = 0x7F7FFFFF  # the largest float
ONE = 0x3F800000

_ORDERED = (
    "Fragments of a pixel have to come one after the other, in the order of triangles: OpenGL and "
    "Vulkan need a fragment shader interlock, Direct3D 11.3 and 12 rasterizer-ordered views, Metal "
    "raster order groups. Without order pictures flicker."
)
_EARLY = (
    "Depth has to be tested before fragments insert (early fragment tests), or hidden ones count."
)
_WORDS = (
    "Depth is a word of 16 bits: what is closer together than a 65534th of the depth range is at "
    "one depth. Give the tightest range that holds."
)

_BY_AREA = (
    "Of more the step goes that matters least: what is behind it is then too dark, and what the "
    "pixel covers stays right."
)
_BY_ENERGY = (
    "Of more the two steps become one whose merging harms the picture least, which errs to both "
    "sides. Of two choices that harm it alike to five digits rounding takes one: transmittance is "
    "then thousandths from what the other gives, and no farther from the truth."
)
_CORE = "Faint fragments, of less alpha than MOIT_CORE_ALPHA, are never exact."


@recipe_for("adaptive")
def adaptive(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    nodes, quantized = technique.nodes, int(technique.quantized)
    found = shipped_targets_of(technique)
    assert found
    warp = technique.depth_warp
    clears = (FULL,) * nodes if quantized else (NO_DEPTH, ONE) * nodes
    return Recipe(
        "engine/adaptive.glsl",
        (),
        found.shaded,
        {
            **{"NODES": nodes, "QUANTIZED": quantized, "WORDS": len(clears)},
            **{"BY_ENERGY": int(technique.by_energy), "NORMALIZE": int(technique.normalize)},
        },
        warp_constants(technique, depth_range),
        limits=(
            f"Exact for up to {nodes} fragments of a pixel. "
            + (_BY_ENERGY if technique.by_energy else _BY_AREA),
            *((_WORDS,) if quantized else ()),
            _ORDERED,
            _EARLY,
        ),
        depth_range=depth_range,
        state=State(clears, warps=bool(warp)),
    )


def moments_in_words(
    technique: Any,
    shaded: tuple[Target, ...],
    fixed: dict[str, int],
    values: dict[str, Any],
    limits: tuple[str, ...],
) -> Recipe:
    """Of power and trigonometric moments."""
    is_circle = technique.moments_are_complex
    nodes = technique.count if is_circle else technique.count // 2
    name = f"engine/{technique.kind}{technique.count}"
    return Recipe(
        f"{name}-16.glsl",
        (),
        shaded,
        fixed
        | {"NODES": nodes, "CIRCLE": int(is_circle), "HALF_TOTAL": int(technique.b0_is_half)}
        | {"IN_WORDS": 1, "HALVES": 0},
        values,
        limits=(
            *limits,
            "Every fragment rounds all moments to words of 16 bits again, so that their last "
            "digits hang on the order of triangles: the bias is for that.",
            _ORDERED,
            _EARLY,
        ),
        made=f'#include "{name}.glsl"\n#include "engine/moment_words.glsl"\n',
        state=State((0,) * (nodes + 1), warps=True, has_factors=True),
    )


@recipe_for("mlab")
def mlab(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    if technique.buckets:
        why = "where buckets end is found in one more pass over geometry, before layers"
        raise no_kit(technique, why, f"'{technique.base_name}'")
    layers, quantized = technique.layers, int(technique.quantized)
    warp = technique.depth_warp
    clears = (NO_DEPTH, 0, 0, 0, ONE) * layers
    if quantized:
        clears = (0, NOTHING) * layers + (FULL,) * ((layers + 1) // 2)
    return Recipe(
        "engine/mlab.glsl",
        (),
        (),
        {
            **{"LAYERS": layers, "QUANTIZED": quantized, "WORDS": len(clears)},
            "BY_ENERGY": int(technique.by_energy),
        },
        {
            "LEAST_ALPHA": float(technique.min_alpha),
            **warp_constants(technique, depth_range),
        },
        limits=(
            f"Exact for up to {layers + 1} fragments of a pixel; of more the two farthest blend in "
            "the order in which they came, so pictures hang on the order of triangles.",
            *((_WORDS,) if quantized else ()),
            _ORDERED,
            _EARLY,
        ),
        depth_range=depth_range,
        state=State(clears, takes_color=True, warps=bool(warp)),
    )


@recipe_for("kbuffer")
def kbuffer(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    return _kept_layers(
        technique,
        "All others are blended in the order in which they had to go: colours hang on the order "
        "of triangles, what is covered does not.",
    )


@recipe_for("hybrid")
def hybrid(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    tail = "All others are seen in their mean colour, whatever their depths."
    if not technique.normalize:
        return _kept_layers(technique, tail)
    return _kept_layers(technique, f"{tail} What all of them cover is exact.")


def _kept_layers(technique: Any, tail: str) -> Recipe:
    found = shipped_targets_of(technique)
    assert found
    clears = (NO_DEPTH, 0, 0, 0, 0) * technique.layers
    least = float(getattr(technique, "core_alpha", 0.0))
    fixed = {"NORMALIZE": int(getattr(technique, "normalize", False)), "HAS_CORE": int(least > 0)}
    return Recipe(
        f"engine/{technique.kind}.glsl",
        found.tail,
        (),
        {"LAYERS": technique.layers, "WORDS": len(clears), **fixed},
        {"CORE_ALPHA": least} if least else {},
        limits=(
            f"Exact for up to {technique.layers + 1} fragments of a pixel. {tail}",
            *([_CORE] if least else []),
            _ORDERED,
            _EARLY,
        ),
        state=State(clears, takes_color=True),
    )
