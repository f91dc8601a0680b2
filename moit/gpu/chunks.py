"""Parts of a question that a device's buffers hold: those buffers, and the passes over them."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.gpu.bindings import (
    ALPHAS,
    ANSWERS,
    ASKED,
    BLOCK_FIRST,
    BLOCK_READ,
    BLOCK_SECOND,
    BLOCKS,
    BUFFERS,
    CHANNELS,
    COLORS,
    COMPOSITE,
    CURVE,
    DEPTHS,
    DOUBLES,
    EMISSIONS,
    FACTORS,
    FRAGMENTS,
    INDICES,
    NETWORK,
    OFFSETS,
    STATE,
    TOTALS,
    TRANSMITTANCE,
    WEIGHTS,
    group_counts,
)
from moit.gpu.described import Passes, Stage
from moit.gpu.prepared import Prepared


@dataclasses.dataclass
class Chunk:
    """Pixels first to last of a question, and their buffers.

    blocks : the state of blocks of pixels, of a technique that has such.
    """

    question: Prepared
    first: int
    last: int
    blocks: NDArray[Any] | None

    def __post_init__(self) -> None:
        q = self.question
        self.passes: Passes = q.passes
        self.begin, self.end = int(q.offsets[self.first]), int(q.offsets[self.last])
        self.pixels, self.fragments = self.last - self.first, self.end - self.begin
        offsets = (q.offsets[self.first : self.last + 1] - self.begin).astype(np.uint32)
        # A pass may name buffers that it has no use for.
        self.buffers = dict.fromkeys(range(BUFFERS), self._room(0))
        self.buffers |= {
            OFFSETS: self._buffer(offsets),
            DEPTHS: self._buffer(self._of(q.depth)),
            STATE: self._room(
                (self.pixels * self.passes.state + self.fragments * self.passes.state_of_fragment)
                * q.dtype.itemsize
            ),
            FACTORS: self._room(self.pixels * self.passes.factors * q.dtype.itemsize),
            TOTALS: self._room(self.pixels * 32),
            DOUBLES: self._room(self.pixels * self.passes.doubles * 8),
            INDICES: self._room(self.fragments * self.passes.indices * 4),
        }
        if q.weights is not None:
            self.buffers[WEIGHTS] = self._buffer(self._of(q.weights))
        if self.passes.units:
            self.buffers[WEIGHTS] = self._buffer(q.units[self.first : self.last])
        if q.color is not None:
            self.buffers[COLORS] = self._buffer(self._of(q.color))
        self.buffers[EMISSIONS] = self._buffer(self._of(q.emission))
        if self.passes.network is not None:
            self.buffers[NETWORK] = self._buffer(self.passes.network)
        if self.passes.tables:
            self.buffers[NETWORK] = self._buffer(q.tables[0])
        if self.blocks is not None:
            self.buffers[BLOCKS] = self._buffer(self.blocks)
        self._see(q.alpha)

    def composite(self, behind: NDArray[np.float64]) -> NDArray[Any]:
        q = self.question
        if q.relative:
            behind = self._with_least_absorbed(behind)
        behind_buffer = self._buffer(behind)
        uniforms = {"behind_of_pixel": int(len(behind) > 1 or q.relative), "marks": q.marks}
        uniforms["marks_overflows"] = int(not q.relative)
        if q.opacity is not None and self.passes.coloured == "channels":
            image = np.empty((self.pixels, 4), q.dtype)
            totals = np.empty((self.pixels, 3))
            for c in range(3):
                self._see(q.opacity[:, c])
                self._make_state()
                answer = self._ask(COMPOSITE, behind_buffer, self.pixels, 4, uniforms)
                image[:, c] = answer.reshape(-1, 4)[:, c]
                totals[:, c] = self._read_totals()[:, 0]
            red, green, blue = totals.T
            image[:, 3] = 1 - (red + ((green - red) + (blue - red)) / 3)
            return image
        self._make_totals()
        return self._ask(COMPOSITE, behind_buffer, self.pixels, 4, uniforms).reshape(-1, 4)

    def _with_least_absorbed(self, behind: NDArray[np.float64]) -> NDArray[np.float64]:
        """(pixels, 4) from (pixels or 1, 3): and the least that is absorbed in front of a pixel's
        fragments that cover something."""
        q = self.question
        least = np.zeros(self.pixels)
        if self.passes.absorbs and self.fragments:
            offsets = q.offsets[self.first : self.last + 1] - self.begin
            filled = np.flatnonzero(np.diff(offsets))
            absorbed = np.where(self._of(q.alpha) > 0, self.transmittance(), np.inf)
            least[filled] = np.minimum.reduceat(absorbed, offsets[filled])
        wide = np.broadcast_to(behind, (self.pixels, 3))
        return np.column_stack([wide, np.where(np.isfinite(least), least, 0)])

    def totals(self, net: bool = False) -> NDArray[np.float64]:
        """(pixels, 4): of net coverage and of each channel; net: that one will do."""
        if net:
            return self._read_totals()
        if self.question.opacity is not None and self.passes.coloured == "channels":
            return self._own_totals()
        self._make_totals()
        return self._read_totals()

    def transmittance(self) -> NDArray[Any]:
        self._make_state()
        return self._ask(TRANSMITTANCE, self._rays, self.fragments, 1, {})

    def curve(self, asked: NDArray[Any]) -> NDArray[Any]:
        self._make_state()
        depths = asked.shape[1]
        uniforms = {"depths_asked": depths, "asked_of_pixel": int(len(asked) > 1)}
        buffer = self._buffer(asked)
        return self._ask(CURVE, buffer, self.pixels * depths, 1, uniforms).reshape(-1, depths)

    def _make_totals(self) -> None:
        """State and totals, those of channels too."""
        q = self.question
        if q.opacity is None:
            self._make_state()
        elif self.passes.coloured == "curve":
            self._make_state()
            opacities = self._buffer(self._of(q.opacity))
            self._run(CHANNELS, False, self.pixels, {}, {ASKED: opacities})
        else:
            totals = self._own_totals()
            self._see(q.alpha)
            self._make_state()
            totals[:, 0] = self._read_totals()[:, 0]
            self.buffers[TOTALS].write(totals)

    def _own_totals(self) -> NDArray[np.float64]:
        """What the technique makes of each channel's opacity."""
        q = self.question
        assert q.opacity is not None
        totals = np.empty((self.pixels, 4))
        for c in range(3):
            self._see(q.opacity[:, c])
            self._make_state()
            totals[:, 1 + c] = self._read_totals()[:, 0]
        return totals

    def _see(self, alpha: NDArray[Any]) -> None:
        """Techniques see fragments of this opacity from here on."""
        if alpha is self.question.emission:
            self.buffers[ALPHAS] = self.buffers[EMISSIONS]
        else:
            self.buffers[ALPHAS] = self._buffer(self._of(alpha))

    @functools.cached_property
    def _rays(self) -> Any:
        """A buffer of the pixel that each fragment belongs to."""
        counts = np.diff(self.question.offsets[self.first : self.last + 1])
        return self._buffer(np.repeat(np.arange(self.pixels, dtype=np.uint32), counts))

    def deposit(self, stage: Stage) -> None:
        """The pixels' fragments add to words of blocks, which are in `blocks` then."""
        if self.fragments:
            self._run(stage.number, stage.double, self.fragments, {}, {ASKED: self._rays})
        self._read_words()

    def keep(self, stage: Stage) -> None:
        """Of words that all fragments have added to, those that blocks keep, in `blocks` then."""
        self._run(stage.number, stage.double, self._given_blocks.shape[0], {}, {})
        self._read_words()

    @property
    def _given_blocks(self) -> NDArray[Any]:
        assert self.blocks is not None
        return self.blocks

    def _read_words(self) -> None:
        self.buffers[BLOCKS].read(self._given_blocks)

    def _make_state(self) -> None:
        for stage in self.passes.stages:
            if stage.number == BLOCK_READ:
                self._read_blocks(stage)
            elif stage.number < FRAGMENTS:
                self._run(stage.number, stage.double, self.pixels, {}, {})
            elif self.fragments:
                self._run(stage.number, stage.double, self.fragments, {}, {ASKED: self._rays})

    def _read_blocks(self, stage: Stage) -> None:
        guides, asked = self.question.guides, {}
        if guides:
            of_pixels, of_blocks = guides
            of_all = np.concatenate([of_pixels[self.first : self.last], of_blocks])
            asked = {ASKED: self._buffer(of_all)}
        self._run(
            stage.number, stage.double, self.pixels, {"guided": int(guides is not None)}, asked
        )

    def _read_totals(self) -> NDArray[np.float64]:
        totals = np.empty((self.pixels, 4))
        self.buffers[TOTALS].read(totals)
        return totals

    def _ask(
        self, number: int, asked: Any, threads: int, numbers: int, uniforms: dict[str, Any]
    ) -> NDArray[Any]:
        answer = np.empty(threads * numbers, self.question.dtype)
        if threads:
            buffer = self._room(answer.nbytes)
            self._run(
                number, self.passes.double, threads, uniforms, {ASKED: asked, ANSWERS: buffer}
            )
            buffer.read(answer)
        return answer

    def _run(
        self,
        number: int,
        double: bool,
        threads: int,
        uniforms: dict[str, Any],
        buffers: dict[int, Any],
    ) -> None:
        q = self.question
        top, left = q.f.origin
        given = {
            "count": threads,
            "coloured": int(q.color is not None),
            "image_top": top % 2**32,
            "image_left": left % 2**32,
            "image_width": q.f.shape[1],
            "image_height": q.f.shape[0],
            "first_pixel": self.first,
            **q.constants.uniforms(self.passes, q.warped_before),
            **uniforms,
        }
        if self.passes.block_stages:
            b = q.squares
            given |= {
                "block_side": b.side,
                "block_left": b.left,
                "block_top": b.top,
                "blocks_across": b.across,
                "blocks_down": b.down,
            }
        if self.passes.tables:
            names = ("region_side", "region_top", "region_left", "regions_across", "cells_joined")
            given |= dict(zip(names, q.tables[1:], strict=True))
        if q.record is not None:
            q.device.context.begin_time()
        q.device.context.dispatch(
            q.program(number, double),
            group_counts(threads),
            buffers={**self.buffers, **buffers},
            uniforms=given,
        )
        if q.record is not None:
            q.record.append((number, q.device.context.end_time()))

    def _of(self, array: NDArray[Any]) -> NDArray[Any]:
        return array[self.begin : self.end]

    def _buffer(self, array: NDArray[Any]) -> Any:
        held = np.ascontiguousarray(array) if array.size else None
        return self.question.device.context.buffer(max(array.nbytes, 16), held)

    def _room(self, size: int) -> Any:
        return self.question.device.context.buffer(max(size, 16))


@dataclasses.dataclass
class BlockChunk(Chunk):
    """Blocks first to last of a question, and their buffers.

    depth, alpha : of the fragments that blocks take.
    """

    depth: NDArray[Any]
    alpha: NDArray[Any]

    def __post_init__(self) -> None:
        q = self.question
        self.passes = q.passes
        taken = q.blocks.taken[self.first : self.last + 1]
        offsets = q.blocks.offsets[taken[0] : taken[-1] + 1]
        self.begin, self.end = int(offsets[0]), int(offsets[-1])
        self.pixels = self.last - self.first
        self.taken = len(offsets) - 1
        self.block_of = np.repeat(np.arange(self.pixels, dtype=np.uint32), np.diff(taken))
        self.pixel_of = (taken - taken[0]).astype(np.uint32)
        size = q.dtype.itemsize
        self.buffers = dict.fromkeys(range(BUFFERS), self._room(0))
        self.buffers |= {
            OFFSETS: self._buffer((offsets - self.begin).astype(np.uint32)),
            DEPTHS: self._buffer(self._of(self.depth)),
            ALPHAS: self._buffer(self._of(self.alpha)),
            STATE: self._room(self.taken * self.passes.state * size),
            BLOCKS: self._room(self.pixels * self.passes.state * size),
            FACTORS: self._room(self.pixels * self.passes.factors * size),
            TOTALS: self._room(self.taken * 32),
            INDICES: self._room((self.end - self.begin) * self.passes.indices * 4),
        }
        self.ray_of = np.repeat(np.arange(self.taken, dtype=np.uint32), np.diff(offsets))

    def state(self) -> NDArray[Any]:
        block_of, pixel_of = self._buffer(self.block_of), self._buffer(self.pixel_of)
        for stage in self.passes.block_stages:
            if stage.number in (BLOCK_FIRST, BLOCK_SECOND):
                threads, asked = self.pixels, pixel_of
            elif stage.number >= FRAGMENTS:
                threads, asked = len(self.ray_of), self._buffer(self.ray_of)
            else:
                threads, asked = self.taken, block_of
            if threads:
                self._run(stage.number, stage.double, threads, {}, {ASKED: asked})
        state = np.empty((self.pixels, self.passes.state), self.question.dtype)
        self.buffers[BLOCKS].read(state)
        return state
