"""Recipes of kits whose passes change arrays of words by atomics, in any order."""

from __future__ import annotations

from typing import Any

import numpy as np

from moit.catalog.slices import PUBLISHED_BIAS, codes_of
from moit.catalog.targets import shipped_targets_of
from moit.kit.gathered import PICTURE, SHADING, SMALL, THREADS, Program
from moit.kit.memory import Memory
from moit.kit.recipe import Recipe, no_kit, recipe_for, warp_constants

ATOMICS = (
    "Fragment shaders change words of a buffer by 32-bit atomics, in any order: Vulkan needs "
    "fragmentStoresAndAtomics, Direct3D 11.1 and up, Metal, OpenGL 4.3 and WebGPU have them."
)
EARLY = (
    "Depth has to be tested before fragments change words (early fragment tests), or hidden ones "
    "count."
)
_SAME = (
    "A fragment's depth has to be the same number in the pass that marks and in that which adds "
    "(`invariant`, `precise`): in a cell that nothing has marked it adds nothing."
)


@recipe_for("avboit")
def avboit(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    of_a_picture(technique)
    found = shipped_targets_of(technique)
    assert found
    most, depth = codes_of(technique.bits)
    side, bias = technique.resolution, technique.slice_bias
    middle = technique.low_resolution == "raster" and side > 1
    blocks = _sides(side)
    places = _Places(technique.cells, runs=False, eighths=False)
    return Recipe(
        "engine/avboit.glsl",
        (),
        found.shaded,
        places.fixed
        | {"GUARD": 1, "RUNS": 0, "EIGHTHS": 0, "SQUARE": 0, "OF_MIDDLE": int(middle or side == 1)}
        | {"CODE_MOST": float(most), "CODE_SCALE": f"{most / depth:.9g}"}
        | {"CUBIC": int(technique.filter == "cubic"), "MANY": int(side > 1)}
        | {"NORMALIZE": int(technique.normalize)},
        {
            "SLOTS": technique.count,
            "SLICE_BIAS": float(PUBLISHED_BIAS[technique.filter] if bias is None else bias),
            "RESOLUTION": side,
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        limits=(
            "What adds less than half a step to a slice is lost: half a step of 8 bits is 0.011 of "
            "optical depth, and a surface of 4 % opacity may lie between two slices.",
            "Light is read some slices nearer than a fragment is, so that it does not dim itself: "
            "neighbours that are closer are passed over, and what is tilted across a block dims "
            "itself all the same.",
            _SAME,
            ATOMICS,
            EARLY,
            "A target of one byte loses fragments of alpha below 1/510.",
        ),
        memory=_memory(places, "1", blocks, technique.count, technique.count / side**2),
        programs=(
            Program(
                "mark", SMALL if middle else PICTURE, "mark({place}, size, {z}, alpha)", about=_MARK
            ),
            *_placing("1", places),
            Program(
                "deposit",
                SMALL if middle else PICTURE,
                "deposit({place}, size, {z}, alpha)",
                about="The same geometry again.",
            ),
            Program("integrate", THREADS, "integrate({thread}, size)", blocks, _INTEGRATE),
            Program(SHADING, PICTURE, "transmittance({place}, size, {z})"),
        ),
    )


@recipe_for("slices")
def slices(technique: Any, depth_range: tuple[float, float]) -> Recipe:
    of_a_picture(technique)
    name = f"slices{technique.count}"
    if technique.inside:
        why = "the text has no bounds of moments, between which slices are held there"
        raise no_kit(technique, why, f"'{name}'")
    if technique.upsampling != "bilinear":
        why = "the text reads blocks by their totals alone, not by the depth of what is opaque"
        raise no_kit(technique, why, f"\"{name}(resolution={technique.resolution},total='full')\"")
    if technique.total == "byte":
        why = (
            "a byte of a pixel's total is its share of the block's, which a pass over pixels would "
            "have to write; the text reads totals as they are added up"
        )
        raise no_kit(technique, why, f"\"{name}(resolution={technique.resolution},total='half')\"")
    found = shipped_targets_of(technique)
    assert found
    most, depth = codes_of(technique.bits)
    fields = technique.fields_for_core(np.dtype(np.float32))
    side, own = technique.resolution, technique.total != "block"
    square = {"image": 0, "tile": technique.tile, "pixel": side}[technique.table]
    squares = "1" if not square else _sides(square)
    places = _Places(fields["cells"], runs=True, eighths=True)
    fixed = {"RESOLUTION": 1} if side == 1 else {}
    sums = ", {sums}" if own else ""
    return Recipe(
        "engine/slices.glsl",
        found.held,
        found.shaded,
        places.fixed
        | {"GUARD": 0, "RUNS": 1, "EIGHTHS": 1, "SQUARE": square}
        | {"CODE_MOST": float(most), "CODE_SCALE": f"{most / depth:.9g}"}
        | {"OF_BLOCKS": int(side > 1), "OWN_TOTAL": int(own)}
        | {"NORMALIZE": int(technique.normalize), **fixed},
        {
            "SLOTS": technique.count,
            **({"RESOLUTION": side} if side > 1 else {}),
            "MAX_ALPHA": technique.max_alpha,
            **warp_constants(technique, depth_range),
        },
        never_negative={},
        limits=(
            "Within a cell of depth, which joined ones may be of many, order is not known: there "
            "half of what others absorb counts as in front.",
            *([_SHARES] if side > 1 else []),
            *([_OPAQUE] if own else []),
            _SAME,
            ATOMICS,
            EARLY,
        ),
        memory=_memory(
            places, squares, _sides(side), technique.count, technique.count / side**2, square
        ),
        programs=(
            Program("mark", PICTURE, "mark({place}, size, {z}, alpha)", about=_MARK),
            *_placing(squares, places),
            Program(
                "deposit",
                PICTURE,
                "deposit({place}, size, {z}, alpha)",
                about="The same geometry again.",
                captures="accumulate({z}, alpha)" if own else "",
            ),
            Program("integrate", THREADS, "integrate({thread}, size)", _sides(side), _INTEGRATE),
            Program(SHADING, PICTURE, f"transmittance({{place}}, size, {{z}}, alpha{sums})"),
        ),
    )


def _sides(side: int) -> str:
    """How many squares of so many pixels a side a picture has."""
    return f"ceil(WIDTH / {side}) * ceil(HEIGHT / {side})" if side > 1 else "WIDTH * HEIGHT"


_SHARES = (
    "Blocks share slices: what is thin or small within one is seen in the mean of its pixels, and "
    "light runs straight from the middle of a block to the next."
)
_OPAQUE = "Coverage is of opacities up to MOIT_MAX_ALPHA."
_MARK = "Which cells of depth have anything."
_INTEGRATE = "A thread a block, row by row: what slices have becomes what is in front of them."


def of_a_picture(technique: Any) -> None:
    if technique.range_per_pixel:
        why = (
            "each pixel's own extent needs one more pass over geometry, and a warp that reads it; "
            "the text warps by two constants"
        )
        raise no_kit(technique, why, f"'{technique.base_name}'")


class _Places:
    """Numbers of the table of where slices stand (shaders/engine/slice_places.glsl)."""

    def __init__(self, cells: int, runs: bool, eighths: bool) -> None:
        self.shift, self.marks = cells.bit_length() - 1, cells // 32
        self.trials = 8 * self.shift + 1 if eighths else self.shift + 1
        per_word = 3 if runs else 2
        self.row = self.trials + 1 + per_word * self.marks
        self.fixed: dict[str, object] = {
            **{"CELLS": cells, "SHIFT": self.shift, "MARKS": self.marks},
            **{"TRIALS": self.trials, "PER_WORD": per_word, "ROW": self.row},
        }


def _times(squares: str, count: int) -> str:
    return str(count) if squares == "1" else f"{count} * {squares}"


def _memory(
    places: _Places, squares: str, blocks: str, slots: int, words: float, square: int = 0
) -> tuple[Memory, ...]:
    each = 1 / square**2 if square else 0.0
    marks, row = places.marks * each, places.row * each
    return (
        Memory(
            "marks",
            _times(squares, places.marks),
            "A bit for each cell of depth.",
            words_a_pixel=marks,
        ),
        Memory("places", _times(squares, places.row), "Where slices stand.", None, row),
        Memory("words", f"{slots} * {blocks}", "What is in slices.", words_a_pixel=words),
    )


def _placing(squares: str, places: _Places) -> tuple[Program, Program]:
    return (
        Program(
            "count",
            THREADS,
            "count_slices({thread}, size)",
            _times(squares, places.trials),
            "How many slices there would be, for each number of cells that may be joined.",
        ),
        Program(
            "place",
            THREADS,
            "place_slices({thread}, size)",
            _times(squares, places.marks),
            "Where slices stand.",
        ),
    )
