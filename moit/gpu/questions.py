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
from moit.gpu.bindings import (
    ALPHAS,
    ANSWERS,
    ASKED,
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
    LOOK_AGAIN,
    NETWORK,
    OFFSETS,
    SOFTWARE_ITERATIONS,
    STATE,
    TOTALS,
    TRANSMITTANCE,
    WEIGHTS,
    group_counts,
)
from moit.gpu.blocks import Blocks, blocks_of, opaque_and_net
from moit.gpu.passes import Constants, Passes, passes_of

if TYPE_CHECKING:
    from moit.gpu.device import Device


class Question:
    """Fragments and a technique on a device, ready to be asked.

    fields : as the core takes them; weights of fragments in them are (N,).
    exact : as the core computes it, to the bit where the device rounds as it does; else by texts
        for engines, where there are any.
    relative : composites weigh fragments relative to the one that weighs most. For pixels whose
        weights are lost otherwise; of the others these are other pictures.
    """

    def __init__(
        self,
        device: Device,
        f: Fragments,
        technique: Technique,
        fields: dict[str, Any],
        cull_opaque: bool,
        threads: int,
        exact: bool = True,
        relative: bool = False,
    ) -> None:
        self.device, self.f, self.fields, self.threads = device, f, fields, threads
        self.technique, self.cull_opaque, self.relative = technique, cull_opaque, relative
        self.dtype = f.depth.dtype
        self.overflows = 0
        self.record: list[tuple[int, int]] | None = None  # passes and what times them
        self.kept, self.occluder, opacity, net = _core.surviving(f, cull_opaque, threads)
        double = self.dtype == np.float64
        self.constants = Constants.of(fields, double, f.depth_range, exact or relative)
        self.passes = passes_of(technique, self.constants)
        if relative:
            self.passes = self.passes.absorbed()
        everything = bool(self.kept.all())
        kept = slice(None) if everything else self.kept
        self.offsets = f.offsets
        if not everything:
            self.offsets = np.concatenate([[0], np.cumsum(self.kept)])[f.offsets]
        self._check_loops()
        self.depth, self.emission = f.depth[kept], f.alpha[kept]
        self.color = None if f.color is None else f.color[kept]
        self.alpha = self.emission if net is None else net[kept]
        self.opacity = None if opacity is None else opacity[kept]
        self.weights = fields["weights"][kept] if "weights" in fields else None
        # Depth that is warped by other steps than the shaders': each pixel's own, or extreme ones.
        self.warped_before = self.constants.warp == "extreme" or (
            self.constants.warp != "none" and bool(fields.get("range_per_pixel"))
        )
        if self.warped_before:
            self.survivors = Fragments(
                self.offsets, self.depth, self.alpha, depth_range=f.depth_range, dtype=self.dtype
            )
            self.depth = _core.warped(self.survivors, fields, threads, None)

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

    @property
    def asks_again(self) -> bool:
        """Whether a pixel's transmittance is asked for again in double where float may have lost
        it. State of blocks is not to be had for single pixels, nor are samples."""
        return (
            self.dtype == np.float32 and not self.passes.block_stages and not self.technique.random
        )

    @property
    def marks(self) -> int:
        """Which pixels are to be looked at again; see shaders/arrays/questions.glsl."""
        if self.relative or not self.passes.normalize:
            return 0
        return 2 if self.asks_again and self.passes.absorbs else 1

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
            (depth, alpha, color, transmission, None, None),
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

    def _check_loops(self) -> None:
        """Software renderers leave loops early, silently: a thread has so many turns in all."""
        if not self.device.software or self.occluder.size == 0:
            return
        counts = np.diff(self.offsets)
        pixel, most = int(counts.argmax()), SOFTWARE_ITERATIONS // self.passes.iterations
        if counts[pixel] > most:
            raise GpuError(
                f"offsets: pixel {pixel} has {counts[pixel]} fragments, and loops of "
                f"{self.device.renderer} are sure to reach {most} of them only; use device='cpu'"
            )

    def _known_range(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """In front of what depth warps from, and behind it, a pixel's answer is known."""
        pixels = self.occluder.size
        near, far = (np.full(pixels, end) for end in self.f.depth_range)
        if self.fields.get("range_per_pixel"):
            filled = np.flatnonzero(np.diff(self.offsets))
            depth = self.survivors.depth.astype(np.float64)
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
    def blocks(self) -> Blocks:
        """Those that a technique has state of, and what they take."""
        opaque, self._net = opaque_and_net(self.f, self.threads)
        side, average = self.fields["resolution"], self.fields["average"]
        return blocks_of(self.f, side, average, opaque if self.cull_opaque else None)

    @functools.cached_property
    def block_state(self) -> NDArray[Any]:
        """What passes make of blocks; asked where the device's context is current."""
        b = self.blocks
        depth, alpha = self.f.depth[b.fragment], self._net[b.fragment]
        if self.warped_before:
            held = Fragments(
                b.offsets, depth, alpha, depth_range=self.f.depth_range, dtype=self.dtype
            )
            depth = _core.warped(held, self.fields, self.threads, None)
        state = np.empty((len(b.taken) - 1, self.passes.state), self.dtype)
        size, most = self.dtype.itemsize, self.device.storage_bytes
        if state.nbytes > most:
            raise GpuError(
                f"resolution: {len(state)} blocks have {state.nbytes} bytes, and "
                f"{self.device.renderer} can hold {most} in a buffer; use device='cpu'"
            )
        blocks = most // (size * max(self.passes.state, self.passes.factors))
        pixels, fragments = most // (8 * self.passes.state), most // size
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
            state[first:last] = _BlockChunk(self, first, last, depth, alpha).state()
            first = last
        return state

    def _check_block(self, first: int, last: int) -> None:
        """That buffers hold a block at least, and software's loops reach what blocks take."""
        b = self.blocks
        pixels = int(np.diff(b.taken).max())
        fragments = int(np.diff(b.offsets).max(initial=0))
        turns = max(8 * pixels, self.passes.iterations * fragments)
        if last <= first or (self.device.software and turns > SOFTWARE_ITERATIONS):
            raise GpuError(
                f"resolution: blocks take {pixels} pixels of up to {fragments} fragments, more "
                f"than buffers and loops of {self.device.renderer} are sure to reach; use "
                "device='cpu'"
            )

    def _chunks(self, depths: int = 0) -> Iterator[_Chunk]:
        """Runs of pixels whose buffers the device can hold, one after the other on it."""
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
            yield _Chunk(self, first, last)
            first = last


@dataclasses.dataclass(frozen=True)
class GpuEngine:
    """A device as a `moit.core.engine.Engine`; exact as `Question` has it."""

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


@dataclasses.dataclass
class _Chunk:
    """Pixels first to last of a question, and their buffers."""

    question: Question
    first: int
    last: int

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
        if q.color is not None:
            self.buffers[COLORS] = self._buffer(self._of(q.color))
        self.buffers[EMISSIONS] = self._buffer(self._of(q.emission))
        if self.passes.network is not None:
            self.buffers[NETWORK] = self._buffer(self.passes.network)
        if self.passes.block_stages:
            self.buffers[BLOCKS] = self._buffer(q.block_state)
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

    def _make_state(self) -> None:
        for stage in self.passes.stages:
            if stage.number < FRAGMENTS:
                self._run(stage.number, stage.double, self.pixels, {}, {})
            elif self.fragments:
                self._run(stage.number, stage.double, self.fragments, {}, {ASKED: self._rays})

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
        is_double = q.dtype == np.float64
        program = q.device.program(
            f"techniques/{self.passes.shader}",
            **self.passes.defines_on(q.device),
            SCALAR="double" if is_double else "float",
            DOUBLE=int(double or is_double),
            PASS=number,
        )
        given = {
            "count": threads,
            "coloured": int(q.color is not None),
            "image_top": top % 2**32,
            "image_left": left % 2**32,
            "image_width": q.f.shape[1],
            "first_pixel": self.first,
            **q.constants.uniforms(self.passes, q.warped_before),
            **uniforms,
        }
        if self.passes.block_stages:
            b = q.blocks
            given |= {
                "block_side": b.side,
                "block_left": b.left,
                "block_top": b.top,
                "blocks_across": b.across,
                "blocks_down": b.down,
            }
        if q.record is not None:
            q.device.context.begin_time()
        q.device.context.dispatch(
            program,
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
class _BlockChunk(_Chunk):
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
            STATE: self._room(self.pixels * self.passes.state * size),
            FACTORS: self._room(self.pixels * self.passes.factors * size),
            DOUBLES: self._room(self.taken * self.passes.state * 8),
        }

    def state(self) -> NDArray[Any]:
        block_of, pixel_of = self._buffer(self.block_of), self._buffer(self.pixel_of)
        stages = self.passes.block_stages
        for of_pixels, of_blocks in zip(stages[::2], stages[1::2], strict=True):
            self._run(of_pixels.number, of_pixels.double, self.taken, {}, {ASKED: block_of})
            self._run(of_blocks.number, of_blocks.double, self.pixels, {}, {ASKED: pixel_of})
        state = np.empty((self.pixels, self.passes.state), self.question.dtype)
        self.buffers[STATE].read(state)
        return state
