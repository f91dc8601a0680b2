"""Kits of techniques that the depth test sorts: depth peeling, which draws geometry again and
again, stochastic transparency, on samples of a pixel, and hashed alpha testing: recipes, passes,
calls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from moit.catalog.targets import Target, shipped_targets_of
from moit.kit.recipe import HASHED, PEELED, SAMPLED, Recipe, no_kit, recipe_for

SAMPLES = (2, 4, 8, 16)  # of a pixel, that devices have
WGSL_SAMPLES = 4  # the only number that WebGPU has
TOTAL = Target("r32f", "multiply-complement", 1.0)  # what all fragments let through
_MANY = "Targets of {0} samples a pixel have to exist on the device, and blend (RGBA16F)."


@recipe_for("depth-peeling")
def depth_peeling(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    found = shipped_targets_of(technique)
    assert found
    covers = "what all fragments cover is exact" if technique.normalize else "what they cover is"
    covers = covers if technique.normalize else f"{covers} exact"
    return Recipe(
        "engine/depth_peeling.glsl",
        (TOTAL,) if technique.normalize else (),
        found.shaded,
        {"NORMALIZE": int(technique.normalize)},
        limits=(
            f"What lies behind the {technique.layers} nearest fragments is not seen; {covers}.",
            "Of fragments at one depth one is drawn.",
            "A round compares depths with those of the round before to the bit: vertices have to "
            "come out of all rounds alike (`invariant`, `precise`), and depth targets are 32-bit "
            "floats.",
            "Where depth is reversed fragments are behind with less: swap the arguments of "
            "`moit_is_behind`.",
        ),
        shape=PEELED,
        count=technique.layers,
    )


@recipe_for("stochastic")
def stochastic(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    if technique.samples not in SAMPLES:
        raise no_kit(technique, f"pixels have {_listed(SAMPLES)} samples", "'stochastic8'")
    found = shipped_targets_of(technique)
    assert found
    return Recipe(
        "engine/stochastic.glsl",
        found.held,
        found.shaded,
        {
            "SAMPLES": technique.samples,
            "STRATIFIED": int(technique.stratified),
            "NORMALIZE": int(technique.normalize),
        },
        {"SEED": technique.seed},
        limits=(
            "Noise: right in the mean over seeds. Change MOIT_SEED from frame to frame where "
            "frames are averaged after, and leave it where they are not.",
            "Fragments at one depth do not occlude one another, and those of one depth and opacity "
            "cover the same samples.",
            "Depth, which the hash takes, has to be the same number in all passes.",
            _MANY.format(technique.samples),
        ),
        shape=SAMPLED,
        count=technique.samples,
    )


@recipe_for("hashed-alpha")
def hashed_alpha(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    found = shipped_targets_of(technique)
    assert found
    return Recipe(
        "engine/hashed_alpha.glsl",
        (),
        found.shaded,
        {"SAMPLES": 1, "STRATIFIED": 0},
        {"SEED": technique.seed},
        limits=(
            "Noise: right in the mean over seeds. Change MOIT_SEED from frame to frame where "
            "frames are averaged after, and leave it where they are not.",
            "The hash is of a fragment's depth, opacity and place on the screen, not of its place "
            "on the surface, as published: noise does not move with the surface.",
            "Of fragments at one depth that are left the first is seen.",
        ),
        shape=HASHED,
        count=1,
    )


def _listed(numbers: Sequence[int]) -> str:
    return f"{', '.join(map(str, numbers[:-1]))} or {numbers[-1]}"


def passes_of(shape: str, count: int, colours: str, has_total: bool) -> list[dict[str, Any]]:
    """All passes but the resolve, as the table has them. colours : the name of that target;
    has_total : whether another has what all fragments let through."""
    everything = "all transparent geometry, in any order"
    if shape == HASHED:
        return [
            {
                "name": "shading",
                "draws": everything,
                "targets": [colours],
                "reads": [],
                "calls": ["moit_covered_samples", "moit_accumulate_color"],
                "depth": {"test": "less", "write": True},
                "about": "The depth target is that of the opaque picture. Nothing is blended, so "
                "that the target may be that picture itself, without a resolve.",
            }
        ]
    if shape == PEELED:
        total = {
            "name": "absorbance",
            "draws": everything,
            "targets": ["target0"],
            "reads": [],
            "calls": ["moit_accumulate"],
            "depth": {"test": "less", "write": False},
            "about": "Tested against the opaque picture's depth, at any time before the resolve.",
        }
        return [
            *([total] if has_total else []),
            {
                "name": "peeling",
                "draws": everything,
                "targets": ["layer"],
                "reads": ["before"],
                "calls": [
                    "moit_is_behind",
                    "moit_shaded" if has_total else "moit_accumulate_color",
                ],
                "depth": {"test": "less", "write": True},
                "rounds": count,
                "about": "The depth target begins as the opaque picture's depth, the layer as 0. "
                "`before` is the depth target of the round before, another texture; in the first "
                "round it is 0 everywhere. The layer is not blended: the nearest stays.",
            },
            {
                "name": "under",
                "draws": "the whole picture, after each round",
                "targets": [colours],
                "reads": ["layer"],
                "calls": [],
                "depth": {"test": None, "write": False},
                "rounds": count,
                "about": "Puts the layer under those before it, by the blend function.",
            },
        ]
    return [
        {
            "name": "coverage",
            "draws": everything,
            "targets": [],
            "reads": [],
            "calls": ["moit_covered_samples"],
            "depth": {"test": "less", "write": True},
            "samples": count,
            "about": "Depth alone, 32-bit floats of so many samples that begin as the opaque "
            "picture's depth; the shader gives the mask of samples that it covers.",
        },
        {
            "name": "absorbance",
            "draws": everything,
            "targets": ["target0"],
            "reads": [],
            "calls": ["moit_accumulate"],
            "depth": {"test": "less", "write": False},
            "about": "One sample a pixel, tested against the opaque picture's depth.",
        },
        {
            "name": "shading",
            "draws": everything,
            "targets": [colours],
            "reads": [],
            "calls": ["moit_shaded"],
            "depth": {"test": "less-equal", "write": False},
            "samples": count,
            "about": "On the samples of the first pass and tested against its depth, of each "
            "sample. The mean over samples (what resolving such a target gives) is what the "
            "resolve reads.",
        },
    ]


_PLACES = {
    "glsl": ("gl_FragCoord.y", "gl_FragCoord.x", "gl_FragCoord.z"),
    **dict.fromkeys(("hlsl", "slang", "metal", "wgsl"), ("position.y", "position.x", "position.z")),
}
_TEXELS = {
    "glsl": "texelFetch({0}, ivec2(gl_FragCoord.xy), 0)",
    **dict.fromkeys(("hlsl", "slang"), "{0}.Load(int3(position.xy, 0))"),
    "metal": "{0}.read(uint2(position.xy))",
    "wgsl": "textureLoad({0}, vec2<i32>(position.xy), 0)",
}


def usage_of(
    shape: str, language: str, colours: str, resolve: list[str], has_total: bool
) -> dict[str, list[str]]:
    """What the fragment shaders of each pass have (moit.kit.usage). `before` and `layer` are
    textures that the shader has, `mask` what it gives as mask of samples."""
    row, column, depth = _PLACES[language]
    texel = _TEXELS[language].format
    discard = "discard_fragment()" if language == "metal" else "discard"
    let = "let sums" if language == "wgsl" else "moit_sums sums"
    if shape == PEELED:
        # WGSL and Metal read one number of a depth texture
        layer = [f"{let} = moit_accumulate_color(color, alpha, depth);", "layer = sums.target0;"]
        total = [f"{let} = moit_accumulate(depth, alpha);", "target0 = sums.target0;"]
        if has_total:
            layer = ["layer = moit_shaded(color, alpha, 1.0);"]
        before = texel("before") + (".x" if language in ("glsl", "hlsl", "slang") else "")
        return {
            **({"absorbance": total} if has_total else {}),
            "peeling": [f"if (!moit_is_behind({depth}, {before})) {{ {discard}; }}", *layer],
            "under": [f"{colours} = {texel('layer')};"],
            "resolve": resolve,
        }
    whole = "u32" if language == "wgsl" else "uint"
    mask = f"moit_covered_samples({whole}({row}), {whole}({column}), depth, alpha)"
    if shape == HASHED:
        return {
            "shading": [
                f"if ({mask} == 0u) {{ {discard}; }}",
                f"{let} = moit_accumulate_color(color, alpha, depth);",
                f"{colours} = sums.{colours};",
            ],
            "resolve": resolve,
        }
    return {
        "coverage": [
            f"gl_SampleMask[0] = int({mask});" if language == "glsl" else f"mask = {mask};"
        ],
        "absorbance": [f"{let} = moit_accumulate(depth, alpha);", "target0 = sums.target0;"],
        "shading": [f"{colours} = moit_shaded(color, alpha, 1.0);"],
        "resolve": resolve,
    }
