"""Recipe of the kit whose pixels have slices of their own extent, changed by atomics."""

from __future__ import annotations

from typing import Any

from moit.catalog.network import network_of
from moit.catalog.slices import codes_of
from moit.catalog.targets import ExtentWords, shipped_targets_of
from moit.kit.gathered import PICTURE, SHADING, THREADS, Program
from moit.kit.gathered_recipes import ATOMICS, EARLY
from moit.kit.memory import Memory
from moit.kit.recipe import Recipe, recipe_for, warp_constants


@recipe_for("neural-slices")
def neural_slices(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    found = shipped_targets_of(technique)
    assert found
    assert isinstance(found.words, ExtentWords)
    most, depth = codes_of(technique.bits)
    words = found.words.all
    return Recipe(
        "engine/neural_slices.glsl",
        found.held,
        found.shaded,
        {"NORMALIZE": int(technique.normalize)},
        {
            "SLOTS": technique.count,
            "CODE_MOST": most,
            "CODE_SCALE": most / depth,
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        arrays={"NETWORK": network_of(technique.network, technique.network_kind).packed()},
        never_negative={},
        limits=(
            "Of what the two slices around a fragment hold a network decides how much is in front "
            "of it, which was trained on pictures of many kinds, not on yours: `moit train` makes "
            "one of your own. One network reads slices of all counts and bits.",
            "A slice tells whole steps, and none beyond its most: what thin layers round to "
            "differs from pixel to pixel, and flickers as they move where slices have few bits.",
            "A fragment's depth and opacity have to be the same numbers in all passes "
            "(`invariant`, `precise`): by these it is taken out of its slices again.",
            ATOMICS,
            EARLY,
        ),
        memory=(
            Memory(
                "words",
                f"{words} * WIDTH * HEIGHT",
                "Of each pixel where it begins and ends, and what is in its slices.",
                0,
                words,
            ),
        ),
        programs=(
            Program(
                "extend",
                PICTURE,
                "extend({place}, size, {z}, alpha)",
                about="Where each pixel begins and ends.",
            ),
            Program(
                "deposit",
                PICTURE,
                "deposit({place}, size, {z}, alpha)",
                about="The same geometry again.",
            ),
            Program(
                "integrate",
                THREADS,
                "integrate({thread}, size)",
                "WIDTH * HEIGHT",
                "A thread a pixel, row by row: what slices have becomes what is in front of them.",
            ),
            Program(SHADING, PICTURE, "transmittance({place}, size, {z}, alpha)"),
        ),
    )
