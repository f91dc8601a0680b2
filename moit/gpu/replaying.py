"""Pictures by passes over lists of fragments that stay on the device."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from moit.gpu.bindings import (
    ALPHAS,
    ANSWERS,
    ASKED,
    BEHIND,
    BLOCKS,
    COLORS,
    COMPOSITE,
    DEPTHS,
    DOUBLES,
    EMISSIONS,
    FRAGMENTS,
    INDICES,
    MARK,
    NETWORK,
    OFFSETS,
    SEAL,
    STATE,
)
from moit.gpu.meshes import Lists
from moit.gpu.plan import replay_sizes
from moit.gpu.slice_lists import SlicedPicture
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu.described import Passes
    from moit.gpu.device import Device
    from moit.gpu.meshes import Drawing


class Replayed(Protocol):
    """What passes over lists ask of moit.gpu.rendering.Picture."""

    drawing: Drawing
    device: Device
    passes: Passes
    fields: Mapping[str, Any]
    pixels: int
    memory: dict[str, int]

    def buffer(self, name: str, size: int) -> Any: ...

    def timed(self, name: str) -> AbstractContextManager[None]: ...

    def run(
        self,
        number: int,
        threads: int,
        buffers: dict[int, Any],
        textures: dict[int, Any] | None = None,
        uniforms: dict[str, Any] | None = None,
        double: bool = False,
        name: str | None = None,
        **own: Any,
    ) -> None: ...


def replay(picture: Replayed, lists: Lists, buffers: dict[int, Any]) -> None:
    """Passes over the lists, from what pixels keep to their colours in `buffers`."""
    count = lists.count
    needed = replay_sizes(picture.passes, picture.pixels, count)
    made = {name: picture.buffer(name, size) for name, size in needed.items()}
    behind = made["behind"]
    picture.drawing.run(BEHIND, picture.pixels, {ASKED: behind})
    everything = {
        **buffers,
        STATE: made["state"],
        DOUBLES: made["doubles"],
        INDICES: made["indices"],
        OFFSETS: lists.offsets,
        DEPTHS: lists.depth,
        ALPHAS: lists.alpha,
        EMISSIONS: lists.alpha,
        COLORS: lists.color,
    }
    own: dict[str, Any] = {}
    stages = [(stage, picture.pixels) for stage in picture.passes.stages]
    if picture.passes.tables:
        sliced = SlicedPicture(picture.fields, picture.drawing.width, picture.drawing.height)

        def mark(given: dict[int, Any], own: dict[str, Any]) -> None:
            given = {**given, ASKED: lists.rays}
            picture.run(MARK, count, given, uniforms=own, name="mark")

        own = find_slices(picture, sliced, everything, mark)
        stages = [(stage, sliced.blocks) for stage in picture.passes.block_stages] + stages
    for stage, threads in stages:
        picture.run(
            stage.number,
            count if stage.number >= FRAGMENTS else threads,
            {**everything, ASKED: lists.rays},
            uniforms=own,
            double=stage.double,
        )
    picture.run(
        COMPOSITE,
        picture.pixels,
        {**everything, ASKED: behind},
        uniforms={"behind_of_pixel": 1, **own},
        double=picture.passes.double,
        name="composite",
    )
    picture.drawing.run(SEAL, picture.pixels, {ANSWERS: buffers[ANSWERS]})


def find_slices(
    picture: Replayed,
    sliced: SlicedPicture,
    buffers: dict[int, Any],
    mark: Callable[[dict[int, Any], dict[str, Any]], None],
) -> dict[str, Any]:
    """Where slices stand, and room for blocks, into `buffers`; what passes are told of both.

    mark : goes over fragments, given buffers and uniforms.
    """
    own, size = sliced.uniforms(), sliced.sizes(picture.passes)
    buffers[BLOCKS] = picture.buffer("blocks", size["blocks"])
    picture.device.fill(buffers[BLOCKS], 0)
    marked = picture.buffer("marks", 4 * sliced.mark_words)
    picture.device.fill(marked, 0)
    mark({**buffers, INDICES: marked}, own)
    marks = np.empty(sliced.mark_words, np.uint32)
    marked.read(marks)
    with picture.timed("tables"):
        tables, joined = sliced.tables(marks, thread_count(picture.drawing.threads))
        buffers[NETWORK] = picture.device.buffer(size["tables"], tables)
    picture.memory["tables"] = size["tables"]
    return {**own, "cells_joined": joined}
