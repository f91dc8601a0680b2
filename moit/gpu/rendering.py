"""Pictures of triangles as a renderer makes them: a technique's real passes, timed one by one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from moit.catalog.targets import texel_bytes
from moit.gpu.bindings import (
    ANSWERS,
    BETWEEN,
    BLOCK_OCCLUDERS,
    BLOCKS,
    BUFFERS,
    CAPTURE,
    COLLECT,
    DRAW_ORDERED,
    DRAW_SHADES,
    DRAW_TERMS,
    EMPTY,
    FACTOR,
    FACTORS,
    FARTHEST_OCCLUDER,
    FETCH,
    FIRST_TARGET,
    INTERLOCK,
    KEPT,
    LOOK_AGAIN,
    NETWORK,
    OCCLUDER_COLORS,
    OCCLUDERS,
    OVER_TRIANGLES,
    RESOLVE,
    SOFTWARE_ITERATIONS,
    STATE,
    TOTALS,
    group_counts,
)
from moit.gpu.changing import changed
from moit.gpu.described import Passes
from moit.gpu.drawn import Drawn
from moit.gpu.meshes import Drawing, Lists
from moit.gpu.plan import Plan, picture_sizes, replay_sizes, too_large
from moit.gpu.replaying import replay

if TYPE_CHECKING:
    from moit.gpu.foreign import ForeignTextures

STAGE_NAMES = {CAPTURE: "capture", FACTOR: "factor"}


class SmallPicture(Protocol):
    """What `Picture.join` adds: see moit.gpu.mixed."""

    drawing: Drawing

    def add_to(self, picture: Picture, shaded: list[Any], buffers: dict[int, Any]) -> None: ...


class Picture:
    """One picture on a device, while that is current.

    timings : seconds of each pass, in the order in which they ran.
    memory : bytes on the device, by what they are for.
    overflows : how many pixels keep more than half floats hold.
    lost : how many have lost their weights, so that the picture is not to be used.
    """

    overflows = 0
    lost = 0

    def __init__(self, drawing: Drawing, plan: Plan) -> None:
        assert plan.passes is not None
        assert plan.constants is not None
        self.drawing, self.device = drawing, drawing.device
        self.pixels = drawing.width * drawing.height
        self.passes: Passes = plan.passes
        self.drawn, self.way, self.fields = plan.drawn, plan.way, plan.constants.fields
        self.target = plan.target
        self.timings: dict[str, float] = {}
        self.memory: dict[str, int] = {
            "triangles": drawing.bytes,
            "opaque": self.pixels * (4 + texel_bytes(plan.target)),
        }
        self.small: list[SmallPicture] = []
        self.depth_aware = False
        self._lists: Lists | None = None
        self._tickets: list[tuple[str, int]] = []
        self.uniforms = {
            **drawing.uniforms,
            **plan.constants.uniforms(self.passes),
            "image_width": drawing.width,
            "coloured": 1,
        }

    def join(self, small: Sequence[SmallPicture], depth_aware: bool) -> None:
        """Smaller pictures are drawn, too, and added to this one's targets; depth_aware: how they
        are read."""
        self.small, self.depth_aware = list(small), depth_aware
        self.memory["triangles"] += sum(one.drawing.bytes for one in small)

    def begin(self, behind: NDArray[Any], foreign: ForeignTextures, near: float, far: float) -> str:
        """Opaque surfaces, over `behind` (3,) or (height, width, 3), or over what others have drawn
        with a projection of `near` and `far`; and lists of fragments, where passes go over these.

        Returns why these are too long for the passes, or "".
        """
        with self.timed("opaque"):
            self.drawing.draw_occluders(
                behind, cutouts=True, others=lambda: foreign.draw_occluders(self.drawing, near, far)
            )
        if self.way != "replay":
            return ""
        with self.timed("list"):
            counted = self.drawing.count_fragments(with_solid=False)
            count = self.drawing.offsets_of(counted)
            if count > (most := self.drawing.most_fragments):
                return f"of {count} fragments or more a list holds {most}"
            lists = self._lists = self.drawing.list_fragments(
                with_solid=False, begun=(counted, count)
            )
        self.memory["fragments"] = lists.bytes
        if self.device.software:  # its loops end early, silently
            offsets = np.empty(self.pixels + 1, np.uint32)
            lists.offsets.read(offsets)
            if np.diff(offsets).max() > SOFTWARE_ITERATIONS // self.passes.iterations:
                return "loops are not sure to reach all fragments"
        return too_large(self.device, replay_sizes(self.passes, self.pixels, lists.count))

    def finish(self, foreign: ForeignTextures) -> NDArray[np.float32] | None:
        """(height, width, 4); None where a foreign texture gets it."""
        if foreign.into is None:  # what is read back can be marked
            self.uniforms["marks"] = 2 if self.passes.absorbs else 1
            shades = self.drawn is not None and self.drawn.shades
            self.uniforms["marks_overflows"] = 2 if shades and self.target == "rgba16f" else 1
        needed = picture_sizes(self.passes, self.pixels)
        made = {name: self.buffer(name, size) for name, size in needed.items()}
        none = self.device.buffer(16)
        buffers = {
            **dict.fromkeys(range(BUFFERS), none),  # passes name some that they have no use for
            STATE: made["state"],
            FACTORS: made["factors"],
            TOTALS: made["totals"],
            ANSWERS: made["image"],
        }
        if self.passes.network is not None:
            network = self.passes.network
            buffers[NETWORK] = self.device.buffer(network.nbytes, network)
        if self._lists is not None:
            replay(self, self._lists, buffers)
        else:
            assert self.drawn is not None
            self._draw(self.drawn, buffers)
        image = None
        if foreign.into is not None:
            foreign.give(made["image"])
        else:
            image = np.empty((self.drawing.height, self.drawing.width, 4), np.float32)
            made["image"].read(image)
            self._read_marks(image[..., 3])
        for name, ticket in self._tickets:
            self.timings[name] = self.timings.get(name, 0.0) + self.device.seconds(ticket)
        return image

    def _read_marks(self, opacity: NDArray[np.float32]) -> None:
        """What shaders say by the opacity (height, width) of pixels; see arrays/questions.glsl."""
        if opacity.min(initial=0) < 0:
            self.overflows = int(np.count_nonzero(opacity < 0))
            np.abs(opacity, out=opacity)
        if self.passes.normalize:
            self.lost = int(np.count_nonzero(opacity == LOOK_AGAIN))

    # ---- Passes over triangles ----

    def _draw(self, drawn: Drawn, buffers: dict[int, Any]) -> None:
        if drawn.words or drawn.formats:
            fill = changed if drawn.words else Picture._captured
            buffers, told = fill(self, drawn, buffers)
            self._make_factors(drawn, buffers, told)
        self._shade(drawn, buffers)

    def _make_factors(self, drawn: Drawn, buffers: dict[int, Any], told: dict[str, Any]) -> None:
        """Of what pixels keep, or blocks that stages are told of."""
        stages = drawn.stages
        if stages is None:
            stages = tuple(one for one in self.passes.stages if one.number != CAPTURE)
        for stage in stages:
            self.run(
                stage.number,
                self.pixels,
                buffers,
                uniforms=told,
                double=stage.double,
                name="factor",
            )

    def _captured(
        self, drawn: Drawn, buffers: dict[int, Any]
    ) -> tuple[dict[int, Any], dict[str, Any]]:
        """Buffers, of which some then hold what pixels keep, and what the stages that make factors
        of it are told."""
        low, given = self._blocks(drawn, buffers)
        for i in range(drawn.rounds):
            own: dict[str, Any] = {"ROUND": i} if drawn.rounds > 1 else {}
            self._capture(drawn, low, given, own)
            if i + 1 < drawn.rounds or given:
                self.run(
                    BETWEEN,
                    self._captured_pixels(given),
                    low,
                    uniforms=given,
                    double=True,
                    name="first factor" if i == 0 else "convert",
                    **own,
                )
        if not given:
            return buffers, {}
        return {**buffers, BLOCKS: low[STATE]}, {
            "block_side": drawn.block_side,
            "block_left": 0,
            "block_top": 0,
            "blocks_across": given["width"],
            "blocks_down": given["blocks_there"][1],
            "first_pixel": 0,
        }

    def _shade(self, drawn: Drawn, buffers: dict[int, Any]) -> None:
        formats = [self.target] if drawn.shades else []
        shaded = self.targets("colour", formats, (0.0,) * 4)
        if drawn.second:
            second = drawn.second
            shaded += self.targets("colour", [second.format], (second.clear,) * 4)
        if drawn.shades:
            with self.timed("shade"):
                self.drawing.draw(
                    self.drawing.transparent,
                    f"techniques/{self.passes.shader}",
                    self.defines(DRAW_SHADES),
                    buffers=buffers,
                    textures={OCCLUDERS: self.drawing.occluders},
                    uniforms=self.uniforms,
                    targets=shaded,
                    blend=[drawn.blend, *([drawn.second.blend] if drawn.second else [])],
                )
        for one in self.small:
            one.add_to(self, shaded, buffers)
        textures = dict(enumerate(shaded, FIRST_TARGET))
        self.run(RESOLVE, self.pixels, buffers, textures, double=True, name="resolve")

    def _blocks(
        self, drawn: Drawn, buffers: dict[int, Any]
    ) -> tuple[dict[int, Any], dict[str, Any]]:
        """Buffers of what is captured, and what passes over blocks of pixels are told; {}: of
        pixels. The farthest opaque surfaces of blocks are found, too."""
        side = drawn.block_side
        if side == 1:
            return buffers, {}
        across, down = (-(-n // side) for n in (self.drawing.width, self.drawing.height))
        given = {"block_side": side, "blocks_there": (across, down), "width": across}
        self.farthest = self.device.texture("r32f", across, down)
        with self.timed("downsample"):
            self.drawing.run(
                FARTHEST_OCCLUDER,
                across * down,
                {},
                uniforms=given,
                images={BLOCK_OCCLUDERS: self.farthest},
            )
        low = {
            **buffers,
            STATE: self.buffer("blocks", 4 * across * down * self.passes.state),
            FACTORS: self.buffer("blocks", 4 * across * down * self.passes.factors),
        }
        return low, given

    def _captured_pixels(self, given: dict[str, Any]) -> int:
        across, down = given.get("blocks_there", (self.drawing.width, self.drawing.height))
        return int(across * down)

    def _capture(
        self,
        drawn: Drawn,
        buffers: dict[int, Any],
        blocks: dict[str, Any],
        own: dict[str, Any],
    ) -> None:
        """What CAPTURE would make of the fragments."""
        size = blocks.get("blocks_there", (self.drawing.width, self.drawing.height))
        interlock, number = self.way == "interlock", DRAW_ORDERED if drawn.ordered else DRAW_TERMS
        order = {"interlock": INTERLOCK, "fetch": FETCH}.get(self.way, 0)
        given: dict[str, Any] = {"buffers": buffers, "uniforms": {**self.uniforms, **blocks}}
        if interlock:
            kept = self.buffer("targets", 4 * self.pixels * drawn.numbers)
            given["buffers"] = {**buffers, KEPT: kept}
            given["size"] = (self.drawing.width, self.drawing.height)
            self.run(
                EMPTY,
                self.pixels,
                given["buffers"],
                uniforms={"empty": drawn.first_numbers},
                name="capture",
            )
            targets = []
        else:
            targets = self.targets("targets", drawn.formats, drawn.first_numbers, size)
            given["targets"] = targets
            if not drawn.ordered:
                given["blend"] = drawn.blends
        with self.timed("second capture" if own.get("ROUND") else "capture"):
            self.drawing.draw(
                self.drawing.transparent,
                f"techniques/{self.passes.shader}",
                self.defines(number, ORDERED=order, **own),
                textures={OCCLUDERS: self.farthest if blocks else self.drawing.occluders},
                **given,
            )
        self.run(
            COLLECT,
            self._captured_pixels(blocks),
            given["buffers"],
            dict(enumerate(targets, FIRST_TARGET)),
            uniforms=blocks,
            name="collect",
            ORDERED=order,
            **own,
        )

    # ---- What passes are made of ----

    def defines(self, number: int, double: bool = False, **own: Any) -> dict[str, Any]:
        found: dict[str, Any] = {
            **self.passes.defines_on(self.device),
            "SCALAR": "float",
            "DOUBLE": int(double),
            "PASS": number,
            "SHADOWED": 0,
        }
        if self.drawn and self.way != "replay":
            found |= self.drawn.own
        if number >= OVER_TRIANGLES and self.drawn:
            found |= {**self.drawn.defines(), "ORDERED": 0}
            if not self.drawn.shades:
                found["UNSHADED"] = 1
        return {**found, **own}

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
    ) -> None:
        """A compute pass of the technique."""
        if not threads:
            return
        program = self.device.program(
            f"techniques/{self.passes.shader}", **self.defines(number, double, **own)
        )
        with self.timed(name or STAGE_NAMES.get(number, "prepare")):
            self.device.dispatch(
                program,
                group_counts(threads),
                buffers=buffers,
                textures={OCCLUDER_COLORS: self.drawing.occluder_colors, **(textures or {})},
                uniforms={**self.uniforms, "count": threads, **(uniforms or {})},
            )

    @contextlib.contextmanager
    def timed(self, name: str) -> Iterator[None]:
        self.device.begin_time()
        try:
            yield
        finally:
            self._tickets.append((name, self.device.end_time()))

    def buffer(self, name: str, size: int) -> Any:
        self.memory[name] = self.memory.get(name, 0) + size
        return self.device.buffer(max(size, 16))

    def targets(
        self,
        name: str,
        formats: Any,
        cleared: tuple[float, ...],
        size: tuple[int, int] | None = None,
    ) -> list[Any]:
        """Textures, cleared to numbers that they hold in turn."""
        made, first = [], 0
        for format in formats:
            width, height = size or (self.drawing.width, self.drawing.height)
            texture = self.device.texture(format, width, height)
            values = tuple(cleared[first : first + texture.channels])
            first += texture.channels
            self.device.clear(texture, values)
            self.memory[name] = self.memory.get(name, 0) + width * height * texel_bytes(format)
            made.append(texture)
        return made
