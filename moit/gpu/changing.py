"""Pictures whose fragments change words of a pixel by atomics, drawn without lists of them."""

from __future__ import annotations

from typing import Any, Protocol

from moit.gpu.bindings import (
    BETWEEN,
    BLOCKS,
    DOUBLES,
    DRAW_WORDS,
    INDICES,
    INTEGRATE,
    OCCLUDERS,
    STATE,
)
from moit.gpu.drawn import Drawn
from moit.gpu.replaying import Replayed, find_slices
from moit.gpu.slice_lists import SlicedPicture


class Changed(Replayed, Protocol):
    """What passes that draw ask of moit.gpu.rendering.Picture."""

    uniforms: dict[str, Any]

    def defines(self, number: int, double: bool = False, **own: Any) -> dict[str, Any]: ...


def changed(
    picture: Changed, drawn: Drawn, buffers: dict[int, Any]
) -> tuple[dict[int, Any], dict[str, Any]]:
    """Buffers, of which some then hold what fragments make of words, and what the stages that make
    factors of these are told."""
    words = picture.buffer("words", 4 * picture.pixels * drawn.words)
    picture.device.fill(words, 0)
    buffers = {**buffers, INDICES: words}
    sliced = None
    if picture.passes.tables:
        sliced = SlicedPicture(picture.fields, picture.drawing.width, picture.drawing.height)
        buffers[DOUBLES] = picture.buffer("doubles", 8 * picture.pixels * picture.passes.doubles)
        picture.device.fill(buffers[STATE], 0)

        def mark(given: dict[int, Any], own: dict[str, Any]) -> None:
            _change(picture, 0, given, own)

        picture.uniforms |= find_slices(picture, sliced, buffers, mark) | {"block_side": 1}
        if sliced.block_side > 1:
            buffers[STATE] = buffers[BLOCKS]
    for i in range(1 if sliced else 0, drawn.rounds):
        _change(picture, i, buffers, {})
        if drawn.between and i + 1 < drawn.rounds:
            picture.run(BETWEEN, picture.pixels, buffers, name="first factor", ROUND=i)
    if sliced is None:
        return buffers, {}
    own = {"block_side": sliced.block_side}
    picture.run(INTEGRATE, sliced.blocks, buffers, uniforms=own, name="factor")
    return buffers, own


def _change(picture: Changed, i: int, buffers: dict[int, Any], own: dict[str, Any]) -> None:
    """A round over all that is transparent."""
    drawing = picture.drawing
    with picture.timed("second capture" if i else "capture"):
        drawing.draw(
            drawing.transparent,
            f"techniques/{picture.passes.shader}",
            picture.defines(DRAW_WORDS, ROUND=i),
            buffers=buffers,
            textures={OCCLUDERS: drawing.occluders},
            uniforms={**picture.uniforms, **own, "block_side": 1},
            size=(drawing.width, drawing.height),
        )
