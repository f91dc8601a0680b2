"""The questions of moit.questions, answered by compute passes over arrays of fragments."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import Technique
from moit.checks.exceptions import GpuError
from moit.core.engine import Array, Depths
from moit.fragments.fragments import Fragments
from moit.gpu.bindings import LOOK_AGAIN, SOFTWARE_ITERATIONS
from moit.gpu.chunks import BlockChunk, Chunk
from moit.gpu.prepared import Prepared

if TYPE_CHECKING:
    from moit.gpu.device import Device


class Question(Prepared):
    """Fragments and a technique on a device, ready to be asked."""

    def composite(self, background: NDArray[np.float64]) -> NDArray[Any]:
        """(height, width, 4); background (3,) or (height, width, 3)."""
        behind = np.ascontiguousarray(background.reshape(-1, 3))
        opaque = self.occluder >= 0
        if opaque.any():
            assert self.f.color is not None
            behind = np.array(np.broadcast_to(behind, (self.occluder.size, 3)))
            behind[opaque] = self.f.color[self.occluder[opaque]]
        image = np.empty((self.occluder.size, 4), self.dtype)
        with self.device:
            for chunk in self._chunks():
                each = slice(chunk.first, chunk.last) if len(behind) > 1 else slice(None)
                image[chunk.first : chunk.last] = chunk.composite(behind[each])
        overflowing = np.signbit(image[:, 3])
        if overflowing.any():
            self.overflows = int(np.count_nonzero(overflowing))
            image[:, 3] = np.abs(image[:, 3])
        if self.marks:
            again = np.flatnonzero(image[:, 3] == LOOK_AGAIN)
            if len(again):
                image[again] = self._looked_at_again(again, background)
        image[opaque, 3] = 1
        return image.reshape(*self.f.shape, 4)

    def _looked_at_again(
        self, pixels: NDArray[np.intp], background: NDArray[np.float64]
    ) -> NDArray[Any]:
        """(K, 4) of pixels (K,) whose weights are lost: in double, or there with relative ones."""
        given = (self.device, self.f, self.technique, self.fields, self.cull_opaque, self.threads)
        if not self.asks_again:
            return Question(*given, relative=True).composite(background).reshape(-1, 4)[pixels]
        offsets, *arrays = _core.take_pixels(self.f, pixels, self.threads)
        depth, alpha, color, transmission = (
            None if a is None else a.astype(np.float64) for a in arrays
        )
        assert depth is not None
        assert alpha is not None
        some = Fragments._of_checked(
            offsets,
            (depth, alpha, color, transmission, None, None, None),
            (1, len(pixels)),
            self.f.depth_range,
            (0, 0),
        )
        if background.ndim == 3:
            background = background.reshape(1, -1, 3)[:, pixels]
        question = Question(
            self.device,
            some,
            self.technique,
            self.technique.fields_for(some),
            self.cull_opaque,
            self.threads,
        )
        with np.errstate(over="ignore"):
            return question.composite(background).reshape(-1, 4).astype(self.dtype)

    def total_transmittance(self) -> NDArray[Any]:
        """(height, width), with transmission (height, width, 3)."""
        totals = np.empty((self.occluder.size, 4))
        with self.device:
            for chunk in self._chunks():
                totals[chunk.first : chunk.last] = chunk.totals()
        totals[self.occluder >= 0] = 0
        answer = totals[:, 1:] if self.opacity is not None else totals[:, 0]
        return answer.astype(self.dtype).reshape(*self.f.shape, *answer.shape[1:])

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        """None: they need the core's double precision."""
        raise GpuError("device: bounds are computed on the CPU only; use device='cpu'")

    def transmittance(self, depths: Depths = None) -> Array:
        """(N,), or the curve at depths (K,)."""
        if depths is not None:
            return self.curve(depths)
        kept, totals = np.empty(self.offsets[-1], self.dtype), np.empty(self.occluder.size)
        with self.device:
            for chunk in self._chunks():
                each = slice(self.offsets[chunk.first], self.offsets[chunk.last])
                kept[each] = chunk.transmittance()
                totals[chunk.first : chunk.last] = chunk.totals(net=True)[:, 0]
        answer = np.zeros(len(self.f), self.dtype)
        answer[self.kept] = kept
        opaque = self.occluder >= 0
        answer[self.occluder[opaque]] = totals[opaque]
        return answer

    def curve(self, depth: NDArray[np.float64]) -> NDArray[Any]:
        """(height, width, K) at depths (K,): 1 before, the total behind what depth warps from, 0
        behind opaque surfaces."""
        answer = np.empty((self.occluder.size, depth.size), self.dtype)
        if depth.size == 0:
            return answer.reshape(*self.f.shape, 0)
        if self.warped_before:
            asked = _core.warped(self.survivors, self.fields, self.threads, depth)
        else:
            asked = self._asked(depth)[None]
        asked = asked.astype(np.float64)
        totals = np.empty(self.occluder.size)
        with self.device:
            for chunk in self._chunks(depth.size):
                each = slice(chunk.first, chunk.last) if len(asked) > 1 else slice(None)
                answer[chunk.first : chunk.last] = chunk.curve(asked[each])
                totals[chunk.first : chunk.last] = chunk.totals(net=True)[:, 0]
        near, far = self._known_range()
        totals = totals.astype(self.dtype)
        answer = np.where(depth > far[:, None], totals[:, None], answer)
        answer[depth < near[:, None]] = 1
        opaque = self.occluder >= 0
        behind = depth > self.f.depth[self.occluder[opaque]].astype(np.float64)[:, None]
        answer[opaque] = np.where(behind, 0, answer[opaque])
        return answer.reshape(*self.f.shape, depth.size)

    def _asked(self, depth: NDArray[np.float64]) -> NDArray[Any]:
        """The numbers that passes take for these depths; as Passes.asks has it."""
        if self.passes.asks == "exact":
            return depth
        with np.errstate(over="ignore"):
            near: NDArray[Any] = depth.astype(self.dtype)
        if self.passes.asks == "nearest":
            return near
        return np.where(near < depth, np.nextafter(near, self.dtype.type(np.inf)), near)

    def pass_times(self) -> list[tuple[int, float]]:
        """The passes of a composite over black: their numbers and seconds, chunk by chunk."""
        with self.device:
            self.record = []
            try:
                for chunk in self._chunks():
                    chunk.composite(np.zeros((1, 3)))
                return [
                    (number, self.device.context.seconds(ticket)) for number, ticket in self.record
                ]
            finally:
                self.record = None

    def _known_range(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """In front of what depth warps from, and behind it, a pixel's answer is known."""
        pixels = self.occluder.size
        near, far = (np.full(pixels, end) for end in self.f.depth_range)
        if self.fields.get("range_per_pixel"):
            filled = np.flatnonzero(np.diff(self.offsets))
            given = self.survivors.depth if self.warped_before else self.depth
            depth = given.astype(np.float64)
            near[filled] = np.minimum.reduceat(depth, self.offsets[filled])
            far[filled] = np.maximum.reduceat(depth, self.offsets[filled])
        if not self.cull_opaque and len(self.f):  # opaque fragments may lie beyond the range
            filled, depth = np.flatnonzero(self.f.counts), self.f.depth.astype(np.float64)
            begin = self.f.offsets[filled]
            near[filled] = np.minimum(near[filled], np.minimum.reduceat(depth, begin))
            far[filled] = np.maximum(far[filled], np.maximum.reduceat(depth, begin))
        if self.dtype == np.float32:
            near, far = np.minimum(near, np.float32(near)), np.maximum(far, np.float32(far))
        return near, far

    @functools.cached_property
    def block_state(self) -> NDArray[Any]:
        """What passes make of blocks; asked where the device's context is current."""
        if self.passes.block_words:
            return self._block_words()
        b = self.blocks
        depth, alpha = self.f.depth[b.fragment], self._net[b.fragment]
        if self.warped_before:
            held = Fragments(
                b.offsets, depth, alpha, depth_range=self.f.depth_range, dtype=self.dtype
            )
            depth = _core.warped(held, self.fields, self.threads, None)
        state = np.empty((len(b.taken) - 1, self.passes.state), self.dtype)
        size, most = self.dtype.itemsize, self.device.storage_bytes
        self._check_held(state)
        blocks = most // (size * max(self.passes.state, self.passes.factors))
        pixels, fragments = most // max(8 * self.passes.state, 32), most // size
        ends = b.offsets[b.taken]
        first = 0
        while first < len(state):
            last = min(
                int(np.searchsorted(b.taken, b.taken[first] + pixels, "right")) - 1,
                int(np.searchsorted(ends, ends[first] + fragments, "right")) - 1,
                first + blocks,
                len(state),
            )
            self._check_block(first, last)
            state[first:last] = BlockChunk(self, first, last, None, depth, alpha).state()
            first = last
        return state

    def _block_words(self) -> NDArray[np.uint32]:
        """Whole numbers of blocks, to which each chunk's fragments add in turn."""
        squares, (deposit, keep) = self.squares, self.passes.block_stages
        words = np.zeros((squares.across * squares.down, self.passes.block_words), np.uint32)
        self._check_held(words)
        for first, last in self._runs():
            Chunk(self, first, last, words).deposit(deposit)
        Chunk(self, 0, 0, words).keep(keep)
        return words

    def _check_held(self, state: NDArray[Any]) -> None:
        """That a buffer holds what blocks have."""
        most = self.device.storage_bytes
        if state.nbytes > most:
            raise GpuError(
                f"resolution: {len(state)} blocks have {state.nbytes} bytes, and "
                f"{self.device.renderer} can hold {most} in a buffer; use device='cpu'"
            )

    def _check_block(self, first: int, last: int) -> None:
        """That buffers hold a block at least, and software's loops reach what blocks take."""
        b = self.blocks
        pixels = int(np.diff(b.taken).max())
        fragments = int(np.diff(b.offsets).max(initial=0))
        turns = max(8, self.passes.state + 4) * pixels
        turns = max(turns, self.passes.iterations * fragments)
        if last <= first or (self.device.software and turns > SOFTWARE_ITERATIONS):
            raise GpuError(
                f"resolution: blocks take {pixels} pixels of up to {fragments} fragments, more "
                f"than buffers and loops of {self.device.renderer} are sure to reach; use "
                "device='cpu'"
            )

    def _chunks(self, depths: int = 0) -> Iterator[Chunk]:
        """Runs of pixels, one after the other on the device."""
        for first, last in self._runs(depths):
            blocks = self.block_state if self.passes.block_stages else None
            yield Chunk(self, first, last, blocks)

    def _runs(self, depths: int = 0) -> Iterator[tuple[int, int]]:
        """Pixels first to last whose buffers the device can hold."""
        size, most = self.dtype.itemsize, self.device.storage_bytes
        state, state_of_fragment = self.passes.state, self.passes.state_of_fragment
        if state_of_fragment:  # half of the room for either
            state, state_of_fragment = 2 * state, 2 * state_of_fragment
        fragments = most // (max(3, state_of_fragment) * size)
        wide = max(state, self.passes.factors, self.passes.doubles, 4, depths)
        pixels = max(1, min(most // (8 * wide), 1 << 24))
        first = 0
        while first < self.occluder.size:
            last = int(np.searchsorted(self.offsets, self.offsets[first] + fragments, "right")) - 1
            if last <= first:
                raise GpuError(
                    f"offsets: pixel {first} has {self.offsets[first + 1] - self.offsets[first]} "
                    f"fragments, and {self.device.renderer} can hold {fragments} in a buffer; use "
                    "device='cpu'"
                )
            last = min(last, first + pixels, self.occluder.size)
            yield first, last
            first = last


@dataclasses.dataclass(frozen=True)
class GpuEngine:
    """A device as a `moit.core.engine.Engine`; exact as `Prepared` has it."""

    device: Device
    exact: bool = True
    proves = False

    def question(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> Question:
        fields = (technique.fields_for if blends else technique.fields_for_totals)(f)
        return Question(self.device, f, technique, fields, cull_opaque, threads, self.exact)
