"""Which text of shaders/engine a technique goes home as, what its options decide there, and why
others have none."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from moit.catalog import Technique
from moit.catalog.blocks import InBlocks
from moit.catalog.moment_transparency import STORAGES
from moit.catalog.network import network_of
from moit.catalog.renormalised import Renormalised
from moit.catalog.targets import Target, shipped_targets_of
from moit.kit import gathered_recipes, keyed_recipes, ordered_recipes, own_slice_recipes, rounds
from moit.kit.block_means import check_blocks, in_blocks, with_totals
from moit.kit.fourier_text import MOST, fourier_text
from moit.kit.keyed_recipes import front
from moit.kit.networks import rows_of_moments
from moit.kit.ordered_recipes import moments_in_words
from moit.kit.own_range import LIMITS, WORDS, in_own_range, is_in_own_range
from moit.kit.recipe import Recipe, recipe_for, warp_constants
from moit.kit.recipe import no_kit as _no_kit
from moit.kit.refusals import nearest_kit, why_not

# Files that have recipes, beside those below.
FILES = (gathered_recipes, keyed_recipes, ordered_recipes, own_slice_recipes, rounds)


def recipe_of(technique: Technique, depth_range: tuple[float, float]) -> Recipe:
    """Raises ValueError where there is none, which says why and what is nearest."""
    make = recipe_for.get(technique.kind)
    if make is None:
        raise _no_kit(technique, why_not(technique), nearest_kit(technique))
    own = is_in_own_range(technique)
    recipe = replace(make(technique, depth_range), depth_range=depth_range)
    if isinstance(technique, Renormalised) and technique.normalize:
        published: dict[str, Any] = {"normalize": False}
        plain = make(replace(technique, **published), depth_range)
        if all(getattr(plain, one) == getattr(recipe, one) for one in ("text", "made", "fixed")):
            why = "its text leaves colours as they come out"
            raise _no_kit(technique, why, f"'{technique.base_name}'")
    return _with_blending(_as_asked(technique, recipe, own))


def _as_asked(technique: Technique, recipe: Recipe, own: bool) -> Recipe:
    if isinstance(technique, InBlocks) and technique.block_side > 1:
        return in_blocks(technique, recipe)
    return in_own_range(recipe, technique.kind == "neural-bounded") if own else recipe


def _with_blending(recipe: Recipe) -> Recipe:
    """What is asked of a device whose targets of floats blend is told once."""
    drawn = (*recipe.held, *recipe.second, *recipe.shaded, *recipe.extents)
    blends = any(one.format.endswith("32f") and one.blend in _BLENDED for one in drawn)
    others = tuple(one for one in recipe.limits if one != _FLOAT_BLENDING)
    return replace(recipe, limits=(*others, *((_FLOAT_BLENDING,) if blends else ())))


_BLENDED = ("add", "max", "multiply-complement", "over", "under")


def names_with_kits(language: str = "glsl") -> tuple[str, ...]:
    """Of techniques without options, in a language."""
    return (
        "weighted-sum",
        "weighted-average",
        "wboit",
        "fourier7",
        "fourier15",
        *_WAVELETS,
        "moment-transparency",
        "moment-transparency-nlqm",
        "two-moments-pass",
        "moment-transparency-lr8",
        "two-moments-pass-lr8",
        *_MOMENTS,
        "power4(resolution=4,total='full')",
        "neural-bounded",
        "neural-bounded6",
        "neural(depth_range='image')",
        "depth-peeling4",
        *(("stochastic4",) if language == "wgsl" else ("stochastic4", "stochastic8")),
        "hashed-alpha",
        "avboit",
        "slices64",
        "slices32(resolution=4,total='full')",
        "neural-slices8",
        "anchors4",
        "strong5",
        "front2",
        *(_ORDERED_ONES if language != "wgsl" else ()),
    )


def _targets(technique: Technique) -> tuple[tuple[Target, ...], tuple[Target, ...]]:
    found = shipped_targets_of(technique)
    assert found
    return found.held, found.shaded


_LARGE_SUMS = (
    "Sums of half floats stay finite up to 65504: with the weights of weighted blending, which "
    "reach 3000, some twenty bright fragments close to the eye are at their end."
)
_MOMENTS_LIMIT = (
    "What moments cannot tell apart is seen alike: many surfaces at different depths fade into one "
    "another, and light leaks through where there are more of them than moments tell apart. What "
    "lies beyond the depth range counts as at its ends."
)
_ORDER = (
    "How a pixel's fragments are rounded as they add up shows in the last digits of sums, which a "
    "bias makes up for. With less than the default pictures are sharper, and may flicker: lone "
    "surfaces are then seen wrongly at some depths."
)
_FLOAT_BLENDING = (
    "Targets of 32-bit floats have to blend: WebGPU needs the feature float32-blendable, Vulkan "
    "says so by VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT, Direct3D by "
    "D3D12_FORMAT_SUPPORT1_BLENDABLE, Metal in its feature set tables (not all GPUs blend "
    "RGBA32Float), and OpenGL ES needs EXT_float_blend."
)

_HALVES = (
    "Sums are rounded to half floats as each fragment comes, so that their last digits hang on the "
    "order of fragments: the bias is for that, and less lets pictures flicker. Of surfaces close "
    "together few digits are left, as the whole depth range shares them: give the tightest one.",
    "Sums of half floats stay finite up to 65504.",
)


@recipe_for("wboit")
def _weighted_blended(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    if not isinstance(technique.weight, str):
        raise _no_kit(technique, "its weight is a Python function", "'wboit'")
    near, far = depth_range
    _, shaded = _targets(technique)
    half = (shaded[0], replace(shaded[1], format="r8"))
    return Recipe(
        "engine/weighted_blended.glsl",
        (),
        half,
        {"WEIGHT": _WEIGHTS[technique.weight]},
        {"DEPTH_SCALE": technique.depth_scale, "DEPTH_NEAR": near, "DEPTH_FAR": far},
        limits=(
            "Coverage is exact; how colours share it is a guess by depth and opacity, and wrong "
            "where a near surface is nearly opaque.",
            "A target of one byte loses fragments of alpha below 1/510.",
            _LARGE_SUMS,
        ),
    )


_WEIGHTS = {"blog": 0, "phenomenological": 1, "eq7": 7, "eq8": 8, "eq9": 9, "eq10": 10}


@recipe_for("weighted-average")
def _weighted_average(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    _, shaded = _targets(technique)
    return Recipe(
        "engine/weighted_average.glsl",
        (),
        shaded,
        limits=("Depth has no part in it: what is behind counts as what is in front.",),
    )


def _weighted_scaled(shaded: tuple[Target, ...]) -> Recipe:
    return Recipe(
        "engine/weighted_scaled.glsl",
        (),
        shaded,
        limits=("Coverage is exact; depth has no part in how colours share it.",),
    )


@recipe_for("weighted-sum")
def _weighted_sum(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    _, shaded = _targets(technique)
    if technique.normalize:
        return _weighted_scaled(shaded)
    return Recipe(
        "engine/weighted_sum.glsl",
        (),
        shaded[:1],
        limits=(
            "Depth has no part in it. Where opacities sum to more than 1 the background counts "
            "with a negative weight: clamp, or choose another technique.",
        ),
    )


@recipe_for("fourier")
def _fourier(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    count = technique.coefficients
    check_blocks(technique, technique.base_name)
    held, shaded = _targets(technique)
    if count == MOST:  # two and one as four, of which one number is spared: eight targets, not nine
        held = (*held[:-2], held[0])
    recipe = Recipe(
        f"engine/fourier{count}.glsl",
        held,
        shaded,
        _fixed(technique, technique.excludes_self),
        {"MAX_ALPHA": technique.max_alpha, **warp_constants(technique, depth_range)},
        limits=(
            "Surfaces are seen as waves: what lies close behind or before a solid surface is too "
            "dark or too bright.",
        ),
        made="" if count in (7, 15) else fourier_text(count),
    )
    if technique.total != "full":
        return recipe
    return with_totals(technique, recipe, f"r{technique.bits}f")


@recipe_for("wavelet")
def _wavelet(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    check_blocks(technique, technique.base_name)
    held, shaded = _targets(technique)
    levels = technique.coefficients.bit_length() - 1
    recipe = Recipe(
        "engine/wavelet.glsl",
        held,
        shaded,
        {
            **_fixed(technique, technique.exclude_self),
            "LEVELS": levels,
            "DENSITY": int(technique.projected == "density"),
        },
        {"MAX_ALPHA": technique.max_alpha, **warp_constants(technique, depth_range)},
        limits=(
            f"Absorbance is known at {technique.coefficients} places of the depth range, and runs "
            "straight between them: give the tightest range of depth that holds.",
            "A fragment adds 0 to most coefficients: blending writes all targets, which costs "
            "bandwidth; an engine that has atomics of floats adds to one wavelet of each level.",
            _FLOAT_BLENDING,
        ),
    )
    return with_totals(technique, recipe, "r32f") if technique.total == "full" else recipe


def _fixed(technique: Any, exclude_self: bool) -> dict[str, int]:
    """What is decided of a technique that passes twice over geometry."""
    return {"EXCLUDE_SELF": int(exclude_self), "NORMALIZE": int(technique.normalize)}


def _of_moments(technique: Any, warp: dict[str, float | int]) -> dict[str, Any]:
    """What an engine may tune of moments between whose bounds a share is taken."""
    return {
        "BIAS": _bias(technique),
        "BETA": technique.overestimation,
        "MAX_ALPHA": technique.max_alpha,
        **warp,
    }


@recipe_for("power", "trig")
def _moments(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    name = f"{technique.kind}{technique.count}"
    check_blocks(technique, name)
    zone = getattr(technique, "wrapping_zone", MBOIT_ZONE)
    if zone != MBOIT_ZONE:
        raise _no_kit(technique, "its text has a wrapping zone of pi / 10", f"'{name}'")
    held, shaded = _targets(technique)
    fixed = _fixed(technique, technique.exclude_self)
    values = _of_moments(technique, warp_constants(technique, depth_range))
    if technique.bits == 16:
        return moments_in_words(technique, shaded, fixed, values, (_MOMENTS_LIMIT,))
    return Recipe(
        f"engine/{name}.glsl",
        held,
        shaded,
        fixed | _storage(technique),
        values,
        never_negative={"sums": f"{{0}}.target{len(held) - 1}", "factors": _MOMENTS[name]},
        limits=(_MOMENTS_LIMIT, *_rounding_limits(technique)),
    )


def _in_halves(technique: Any) -> bool:
    return bool(getattr(technique, "in_halves", False))


def _storage(technique: Any) -> dict[str, int]:
    """What a text knows of its targets."""
    return {"HALVES": int(_in_halves(technique)), "IN_WORDS": 0}


def _rounding_limits(technique: Any) -> tuple[str, ...]:
    return _HALVES if _in_halves(technique) else (_ORDER, _FLOAT_BLENDING)


@recipe_for("neural-bounded")
def _bounded(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    check_blocks(technique, technique.base_name)
    six = technique.moment_count == 6
    shipped = technique.network is None
    network = network_of(technique.network, technique.network_kind).packed()
    held, shaded = _targets(technique)
    return Recipe(
        f"engine/bounded{'6' * six}.glsl",
        held,
        shaded,
        {"NORMALIZE": int(technique.normalize), **_storage(technique)}
        | ({} if shipped else {"NETWORK_GIVEN": 1}),
        {
            "BIAS": _bias(technique),
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        arrays={} if shipped else {"NETWORK": network},
        never_negative={
            "sums": f"{{0}}.target{len(held) - 1}",
            "factors": f"{{0}}.factor{int(not six)}.w",
        },
        limits=(
            "What moments leave open a network decides, which was trained on pictures of many "
            "kinds, not on yours: `moit train` makes one of your own.",
            *_rounding_limits(technique),
        ),
    )


@recipe_for("neural")
def _neural(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    held, shaded = _targets(technique)
    own = technique.range_per_pixel
    return Recipe(
        "engine/neural.glsl",
        held[:2] if own else held,
        shaded,
        _fixed(technique, False) | {"OWN_RANGE": int(own)},
        {"MAX_ALPHA": technique.max_alpha, **warp_constants(technique, depth_range)},
        buffers={"NETWORK": rows_of_moments(network_of(technique.network, technique.network_kind))},
        limits=(
            "A network guesses: a lone surface is off by up to 0.03, two anywhere in the depth "
            "range by 0.07 on average, and transmittance need not fall with depth. `moit train` "
            "makes a network of your own.",
            "It knows nothing of a fragment's own opacity.",
            *((_WORDS, *LIMITS) if own else (_IN_HALVES,)),
            _FLOAT_BLENDING,
        ),
        extents=WORDS if own else (),
    )


_IN_HALVES = (
    "The extent of a pixel is of half floats: what is nearer to its ends than 5e-4 of half the "
    "depth range counts as inside."
)
_WORDS = (
    "The extent of a pixel is of words, which the network was trained with: of surfaces closer "
    "together than a 65536th of the depth range it knows no order. WebGPU has targets of 16-bit "
    "words (rg16unorm) as a feature, texture-formats-tier1."
)


@recipe_for("moment-transparency")
def _moment_transparency(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    twice = technique.passes == 2
    check_blocks(technique, "two-moments-pass" if twice else "moment-transparency")
    if twice and technique.storage != "float32":
        why = "the text packs one set of moments into words, and it has two"
        raise _no_kit(technique, why, "'two-moments-pass'")
    side = technique.resolution
    if side > 1 and technique.storage != "float32":
        why = (
            "words of blocks are what a pass over these would make, whose texels pixels then lie "
            "between; the text packs words once a pixel"
        )
        raise _no_kit(technique, why, f"'{technique.base_name}'")
    found = shipped_targets_of(technique)
    assert found
    packed = technique.storage != "float32"
    warp = warp_constants(technique, depth_range)
    return Recipe(
        "engine/moment_transparency.glsl",
        found.held,
        found.shaded,
        _fixed(technique, technique.exclude_self)
        | {"SYMMETRIC": int(technique.interval == "symmetric"), **_storage(technique)}
        | {"STORAGE": STORAGES.index(technique.storage), "PASSES": technique.passes}
        | {"LOW_RESOLUTION": int(side > 1)},
        _of_moments(technique, warp) | ({"RESOLUTION": side} if side > 1 else {}),
        never_negative={
            **{"sums": "{0}.target1", "factors": "{0}.factor1" + ".w" * (not packed)},
            **({"seconds": f"{{0}}.target{4 if side == 1 else 3}"} if twice else {}),
        },
        factor_formats=("rgba16", "r16f") if packed else (),
        limits=(
            _MOMENTS_LIMIT,
            _ORDER,
            _FLOAT_BLENDING,
            *([_PACKED] if packed else []),
            *([_BLOCKS] if side > 1 else []),
        ),
        second=found.second,
        side=side,
    )


_BLOCKS = (
    "Small targets know one place of each block: what is smaller than a block flickers as it "
    "moves, and shades its surroundings; edges of shadows in transparent geometry are as wide as a "
    "block. A fragment that its block's moments hide altogether keeps 2.4e-4 of its light, so that "
    "pixels that nothing else covers are not black."
)
_PACKED = (
    "Words are what the pass for factors writes, and its targets round: without that pass numbers "
    "are read as they are. WebGPU has targets of 16-bit words (rgba16unorm) as a feature, "
    "texture-formats-tier1."
)


# Of these, what a fragment adds is rounded, too, and needs more bias than `blended_bias`: with
# that, of 60,000 lone surfaces near both ends of depth a dozen (power6) are seen as opaque or not
# at all; with these none is (tests/test_kit_run.py). Trigonometric ones need no more, as angles
# are added up that are read again.
# Of eight moments in words floats lose what pivots are made of: with 2.5e-3, as published, 154.
_ROUNDED_TERMS_BIAS = {
    "power6": 4e-6,
    "moment-transparency": 1e-6,
    "two-moments-pass": 1e-6,
    "power8-16": 6e-3,
}

# Where pixels read moments between four blocks their mixing rounds, too: of 60,000 lone surfaces
# the biases of blending leave 135 (power4), 53 (trig2) and one (trig4) that are seen wrongly.
_MIXED_BIAS = {"power4": 1e-6, "trig2": 1.2e-6, "trig4": 4e-6}


def _bias(technique: Any) -> float:
    if technique.bias is not None:
        return float(technique.bias_for(np.float32))
    if _in_halves(technique):
        return float(technique.blended_bias)
    if getattr(technique, "storage", None) == "unorm16":
        return float(technique.blended_bias)  # of words that are made of sums
    if technique.block_side > 1 and technique.base_name in _MIXED_BIAS:
        return _MIXED_BIAS[technique.base_name]
    name = technique.base_name.removesuffix("-nlqm").removesuffix("-lr8")
    return float(_ROUNDED_TERMS_BIAS.get(name, technique.blended_bias))


_ORDERED_ONES = (
    *("adaptive4", "adaptive8", "adaptive16"),
    *("mlab2", "mlab4", "mlab6", "kbuffer4", "hybrid4"),
    *("power4-16", "power6-16", "power8-16", "trig2-16", "trig3-16", "trig4-16"),
)
_WAVELETS = ("wavelet4", "wavelet8", "wavelet16")
MBOIT_ZONE = math.pi / 10

# Techniques of moments that have a text, and what factors have there of the total absorbance.
_MOMENTS = {
    "power2": "-{0}.factor0.w",
    "power4": "{0}.factor1.w",
    "power6": "-{0}.factor0.w",
    "power8": "-{0}.factor2.y",
    "trig2": "-{0}.factor1.z",
    "trig3": "-{0}.factor0.w",
    "trig4": "-{0}.factor2.y",
}


@recipe_for("front")
def _front(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    if technique.range_per_pixel:
        why = (
            "each pixel's own extent needs one more pass over geometry, and a warp that reads it; "
            "the text warps by two constants"
        )
        raise _no_kit(technique, why, f"'{technique.base_name}'")
    return front(technique, recipe_of(technique.behind, depth_range))
