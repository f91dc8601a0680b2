"""Recipes of kits that keep keys of fragments, found by atomic maxima: those that matter most, and
the nearest."""

from __future__ import annotations

import dataclasses
from typing import Any

from moit.catalog.network import network_of
from moit.catalog.neural import BoundedNeural
from moit.catalog.targets import shipped_targets_of
from moit.kit.gathered import PICTURE, SHADING, Program
from moit.kit.gathered_recipes import ATOMICS, EARLY, of_a_picture
from moit.kit.memory import Memory
from moit.kit.recipe import Recipe, recipe_for, warp_constants


@recipe_for("anchors")
def anchors(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    of_a_picture(technique)
    found = shipped_targets_of(technique)
    assert found
    kept, cells, large = technique.kept, technique.cells, technique.key_bits > 32
    lowers = 2 * kept + cells + 2
    words = lowers + kept * large
    return Recipe(
        "engine/anchors.glsl",
        found.held,
        found.shaded,
        {"ANCHORS": kept, "CELLS": cells, "WORDS": words, "NORMALIZE": int(technique.normalize)}
        | {"LARGE_KEYS": int(large), "LOWERS": lowers},
        {
            "DECAY": float(technique.gamma),
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        limits=(
            f"{_exact_but_for_keys(kept, large)} Of all others order within a cell is not known.",
            *_OF_KEYS,
        ),
        memory=(_words_of_pixels(words),),
        programs=(
            *_keeping(large),
            Program(
                "add", PICTURE, "add({place}, size, {z}, alpha)", about="All others, in cells."
            ),
            Program(SHADING, PICTURE, "transmittance({place}, size, {z}, alpha)"),
        ),
    )


@recipe_for("strong")
def strong(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    found = shipped_targets_of(technique)
    assert found
    kept, large = technique.kept, technique.key_bits > 32
    lowers = kept + 2
    words = lowers + kept * large
    rest = BoundedNeural("power6", storage="half", depth_range="pixel")  # as the core reads it
    return Recipe(
        "engine/strong.glsl",
        found.held,
        found.shaded,
        {"ANCHORS": kept, "CELLS": 1, "WORDS": words, "NORMALIZE": int(technique.normalize)}
        | {"LARGE_KEYS": int(large), "LOWERS": lowers}
        | {"HALVES": 1, "IN_WORDS": 0, "PLAIN": 1},
        {
            "DECAY": float(technique.gamma),
            "BIAS": float(rest.blended_bias),
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        arrays={"NETWORK": network_of(technique.network, technique.network_kind).packed()},
        never_negative={"sums": "{0}.target2", "factors": "{0}.factor0.w"},
        limits=(
            f"{_exact_but_for_keys(kept, large)} What moments leave open of all others a network "
            "decides, which was trained on pictures of many kinds, not on yours: `moit train` "
            "makes one of your own.",
            "Sums of all others are rounded to half floats as each fragment comes, so that their "
            "last digits hang on the order of fragments.",
            "Fragments with the same key as the last that is kept count as kept, too, and occlude "
            "nothing: of coincident billboards all but as many as are kept.",
            *_OF_KEYS,
        ),
        memory=(_words_of_pixels(words),),
        programs=(
            *_keeping(large),
            Program(
                "add",
                PICTURE,
                "",
                about="All others, in moments of the pixel's extent.",
                captures="accumulate({place}, size, {z}, alpha)",
            ),
            Program(SHADING, PICTURE, "transmittance_of_sums({place}, size, {sums}, {z}, alpha)"),
        ),
    )


def front(technique: Any, tail: Recipe) -> Recipe:
    """tail : of the technique that reads moments of what is behind."""
    found = shipped_targets_of(technique)
    assert found
    layers, small = technique.layers, technique.key_bits < 64
    words = layers * (1 if small else 2)
    behind = technique.behind
    renamed = ("accumulate", "factor", "transmittance", "transmittance_of_sums", "resolve")
    made = [f"#define {one} {one}_tail" for one in renamed]
    made += [f'#include "{tail.text}"', *(f"#undef {one}" for one in renamed)]
    keys = "keep({place}, size, {z}, alpha)" if small else "keep({place}, size, depth)"
    opacities = Program("know", PICTURE, "keep_rest({place}, size, depth, alpha)", about=_KNOW)
    count = behind.moment_count * (2 if behind.moments_are_complex else 1)
    bias = dataclasses.replace(behind, bias="published").blended_bias
    return dataclasses.replace(
        tail,
        text=f"{tail.text} behind the nearest",
        made="\n".join([*made, '#include "engine/front.glsl"', ""]),
        shaded=found.shaded,
        fixed={
            **tail.fixed,
            **{"LAYERS": layers, "WORDS": words, "SMALL_KEYS": int(small), "NUMBERS": count},
            "TRIGONOMETRIC": int(behind.moments_are_complex),
            "COVERING": f"{bias:.9g}",
            "NORMALIZE": int(technique.normalize),
        },
        limits=(
            *tail.limits,
            f"Exact for up to {layers} fragments of a pixel"
            + (
                ", but for the rounding of keys: depth in 1048575 steps of the depth range, the "
                "root of 1 - alpha in 4095."
                if small
                else "."
            ),
            "What the nearest have in sums of floats is taken out of these again. Where they are "
            "nearly all of a pixel little but rounding is left, which a bias makes up for: what is "
            "behind is then seen as spread over depth.",
            "Fragments alike in depth and opacity to one that is kept count as kept, too: of "
            "coincident ones beyond those that are kept colours have more weight than they cover.",
            *_OF_KEYS,
        ),
        memory=(Memory("words", f"{words} * WIDTH * HEIGHT", "What pixels keep.", 0, words),),
        programs=(
            Program("keep", PICTURE, keys, about=_NEAREST, captures="accumulate({z}, alpha)"),
            *([] if small else [opacities]),
            Program(
                SHADING,
                PICTURE,
                "transmittance_of_sums({place}, size, {sums}, depth, alpha)",
                parted=True,
            ),
        ),
    )


_NEAREST = "The nearest of a pixel, and moments of all."
_KNOW = (
    "The same geometry again: opacities of the nearest. Where atomic maxima of 64 bits are at hand "
    "the pass before can keep both words as one, and this one is not needed."
)


def _exact_but_for_keys(kept: int, large: bool) -> str:
    steps = "16777215" if large else "65535"
    return (
        f"Exact for up to {kept} fragments of a pixel, but for the rounding of keys: depth in "
        f"{steps} steps of the depth range, the root of 1 - alpha in 1023."
    )


def _keeping(large: bool) -> tuple[Program, ...]:
    about = "The greatest keys of a pixel, and where it begins and ends."
    first = Program("keep", PICTURE, "keep({place}, size, {z}, alpha)", about=about)
    rest = Program("know", PICTURE, "keep_rest({place}, size, {z}, alpha)", about=_KNOW_LOWER)
    return (first, rest) if large else (first,)


_KNOW_LOWER = (
    "The same geometry again: the lower words of keys. Where atomic maxima of 64 bits are at hand "
    "the pass before can keep both words as one, and this one is not needed."
)


def _words_of_pixels(words: int) -> Memory:
    return Memory(
        "words", f"{words} * WIDTH * HEIGHT", "What pixels keep, one after another.", 0, words
    )


_OF_KEYS = (
    "A fragment's depth and opacity have to be the same numbers in all passes (`invariant`, "
    "`precise`), which tell by its key whether it is kept.",
    ATOMICS,
    EARLY,
)
