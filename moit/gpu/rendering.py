"""Pictures of triangles as a renderer makes them: a technique's real passes, timed one by one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import MomentTechnique
from moit.checks.exceptions import GpuError
from moit.gpu.bindings import (
    ALPHAS,
    ANSWERS,
    ASKED,
    BEHIND,
    BETWEEN,
    BLOCK_WALLS,
    BLOCKS,
    BUFFERS,
    CAPTURE,
    COLLECT,
    COLORS,
    COMPOSITE,
    DEPTHS,
    DRAW_ORDERED,
    DRAW_SHADES,
    DRAW_TERMS,
    EMISSIONS,
    EMPTY,
    FACTOR,
    FACTORS,
    FARTHEST_WALL,
    FETCH,
    FIRST_TARGET,
    FRAGMENTS,
    INTERLOCK,
    KEPT,
    MARKS,
    NETWORK,
    OFFSETS,
    OVER_TRIANGLES,
    RESOLVE,
    SEAL,
    SOFTWARE_TURNS,
    STATE,
    TOTALS,
    WALL_COLORS,
    WALLS,
    WIDE,
    group_counts,
)
from moit.gpu.drawn import Drawn, drawn_of, texel_bytes
from moit.gpu.meshes import Drawing
from moit.gpu.passes import Constants, Passes, passes_of

if TYPE_CHECKING:
    from moit.catalog import Technique
    from moit.gpu.guests import Guests
    from moit.gpu.mixed import SmallPicture

FETCHES = "GL_EXT_shader_framebuffer_fetch"
INTERLOCKS = "GL_ARB_fragment_shader_interlock"
WAYS = ("interlock", "fetch", "replay")
STAGE_NAMES = {CAPTURE: "capture", FACTOR: "factor"}


class NoPasses(Exception):
    """This picture has to be replayed on the CPU, or in parts."""


class Picture:
    """One picture on a device, while that is current.

    timings : seconds of each pass, in the order in which they ran.
    memory : bytes on the device, by what they are for.
    """

    def __init__(
        self,
        drawing: Drawing,
        technique: Technique,
        fields: dict[str, Any],
        span: tuple[float, float],
        target: str,
        ordered: str | None,
    ) -> None:
        if "weights" in fields:
            raise NoPasses("weights are those of a function in Python")
        self.drawing, self.device = drawing, drawing.device
        self.pixels = drawing.width * drawing.height
        self.constants = Constants.of(fields, False, span)
        self.target = target
        self.timings: dict[str, float] = {}
        self.memory: dict[str, int] = {
            "triangles": drawing.bytes,
            "opaque": self.pixels * (4 + texel_bytes(target)),
        }
        self.small: list[SmallPicture] = []
        self.depth_aware = False
        self._tickets: list[tuple[str, int]] = []
        self._programs: dict[str, Any] = {}
        try:
            self.passes: Passes = passes_of(technique, self.constants)
        except GpuError as error:
            raise NoPasses(str(error)) from None
        warps = self.constants.warp != "none"
        if self.constants.warp == "extreme" or (warps and fields.get("range_per_pixel")):
            raise NoPasses("depth is warped by the core")
        self.drawn = drawn_of(technique.kind, self.constants, target)
        self.way = self._way(ordered)
        if self.way == "add" and isinstance(technique, MomentTechnique) and technique.bias is None:
            # Sums that blending makes in float32 need the bias that was published for them: with
            # less their order of addition shows, in some pixels by a tenth.
            published = {**fields, "bias": _core.bias(fields, "published")}
            self.constants = Constants.of(published, False, span)
            self.passes = passes_of(technique, self.constants)
        self.uniforms = {
            **drawing.uniforms,
            **self.constants.uniforms(self.passes),
            "image_width": drawing.width,
            "coloured": 1,
        }

    def join(self, small: list[SmallPicture], depth_aware: bool) -> None:
        """Smaller pictures are drawn, too, and added to this one's targets; depth_aware: how they
        are read."""
        if self.way != "add":
            raise NoPasses("targets are joined, and lists of fragments are not")
        self.small, self.depth_aware = small, depth_aware
        self.memory["triangles"] += sum(one.drawing.bytes for one in small)

    def _way(self, asked: str | None) -> str:
        """How a pixel's numbers come about: they add up, or one of WAYS."""
        # what of each light comes to a fragment is known of lists
        if self.drawn is None or asked == "replay" or self.drawing.shadows is not None:
            if self.passes.block_stages:
                raise NoPasses("blocks of pixels have state of their own")
            return "replay"
        if not self.drawn.ordered:
            return "add"
        has = {
            "interlock": INTERLOCKS in self.device.info["extensions"],
            "fetch": FETCHES in self.device.info["extensions"]
            and len(self.drawn.formats) <= self.device.info["color_targets"],
            "replay": True,
        }
        if asked is None:
            return next(way for way in WAYS if has[way])
        if not has[asked]:
            name = {"interlock": INTERLOCKS, "fetch": FETCHES}[asked]
            raise GpuError(
                f"ordered: {self.device.renderer} has no {name}, which {asked!r} needs; use "
                f"{next(way for way in WAYS if has[way])!r}"
            )
        return asked

    def render(
        self, behind: NDArray[Any], guests: Guests, near: float, far: float
    ) -> NDArray[np.float32] | None:
        """(height, width, 4), over `behind` (3,) or (height, width, 3), or over what guests have
        drawn with a projection of `near` and `far`; None where they are given it."""
        with self.timed("opaque"):
            self.drawing.draw_walls(
                behind, cutouts=True, others=lambda: guests.draw_walls(self.drawing, near, far)
            )
        answers = self.buffer("image", 16 * self.pixels)
        none = self.device.buffer(16)
        buffers = {
            **dict.fromkeys(range(BUFFERS), none),  # passes name some that they have no use for
            STATE: self.buffer("state", 4 * self.pixels * self.passes.state),
            FACTORS: self.buffer("factors", 4 * self.pixels * self.passes.factors),
            TOTALS: self.buffer("totals", 32 * self.pixels),
            ANSWERS: answers,
        }
        if self.passes.network is not None:
            network = self.passes.network
            buffers[NETWORK] = self.device.buffer(network.nbytes, network)
        if self.way == "replay":
            self._replay(buffers)
        else:
            assert self.drawn is not None
            self._draw(self.drawn, buffers)
        image = None
        if guests.into is not None:
            guests.give(answers)
        else:
            image = np.empty((self.drawing.height, self.drawing.width, 4), np.float32)
            answers.read(image)
        for name, ticket in self._tickets:
            self.timings[name] = self.timings.get(name, 0.0) + self.device.seconds(ticket)
        return image

    # ---- Passes over triangles ----

    def _draw(self, drawn: Drawn, buffers: dict[int, Any]) -> None:
        if drawn.formats:
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
            if given:
                buffers = {**buffers, BLOCKS: low[STATE]}
            stages = drawn.stages
            if stages is None:
                stages = tuple(one for one in self.passes.stages if one.number != CAPTURE)
            for stage in stages:
                blocks = (
                    {
                        "block_side": drawn.block_side,
                        "block_left": 0,
                        "block_top": 0,
                        "blocks_across": given["width"],
                        "blocks_down": given["blocks_there"][1],
                        "first_pixel": 0,
                    }
                    if given
                    else {}
                )
                self.run(
                    stage.number,
                    self.pixels,
                    buffers,
                    uniforms=blocks,
                    double=stage.double,
                    name="factor",
                )
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
                    textures={WALLS: self.drawing.walls},
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
        if self.device.software and side * side > SOFTWARE_TURNS // 2:
            raise NoPasses("loops are not sure to reach all pixels of a block")
        across, down = (-(-n // side) for n in (self.drawing.width, self.drawing.height))
        given = {"block_side": side, "blocks_there": (across, down), "width": across}
        self.farthest = self.device.texture("r32f", across, down)
        with self.timed("downsample"):
            self.drawing.run(
                FARTHEST_WALL,
                across * down,
                {},
                uniforms=given,
                images={BLOCK_WALLS: self.farthest},
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
                textures={WALLS: self.farthest if blocks else self.drawing.walls},
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

    # ---- Capture and replay ----

    def _replay(self, buffers: dict[int, Any]) -> None:
        with self.timed("list"):
            lists = self.drawing.list_fragments(with_solid=False)
        count = lists.count
        self.memory["fragments"] = lists.bytes
        if self.device.software:  # its loops end early, silently
            offsets = np.empty(self.pixels + 1, np.uint32)
            lists.offsets.read(offsets)
            if np.diff(offsets).max() > SOFTWARE_TURNS // self.passes.turns:
                raise NoPasses("loops are not sure to reach all fragments")
        behind = self.buffer("behind", 24 * self.pixels)
        self.drawing.run(BEHIND, self.pixels, {ASKED: behind})
        state = self.passes.state * self.pixels + self.passes.state_of_fragment * count
        everything = {
            **buffers,
            STATE: self.buffer("state", 4 * state),
            WIDE: self.buffer("wide", 8 * self.pixels * self.passes.wide),
            MARKS: self.buffer("marks", 4 * count * self.passes.marks),
            OFFSETS: lists.offsets,
            DEPTHS: lists.depth,
            ALPHAS: lists.alpha,
            EMISSIONS: lists.alpha,
            COLORS: lists.color,
        }
        for stage in self.passes.stages:
            over_fragments = stage.number >= FRAGMENTS
            self.run(
                stage.number,
                count if over_fragments else self.pixels,
                {**everything, ASKED: lists.rays},
                double=stage.double,
            )
        self.run(
            COMPOSITE,
            self.pixels,
            {**everything, ASKED: behind},
            uniforms={"behind_of_pixel": 1},
            double=self.passes.double,
            name="composite",
        )
        self.drawing.run(SEAL, self.pixels, {ANSWERS: buffers[ANSWERS]})

    # ---- What passes are made of ----

    def defines(self, number: int, double: bool = False, **own: Any) -> dict[str, Any]:
        found: dict[str, Any] = {
            **self.passes.defines,
            "SCALAR": "float",
            "DOUBLE": int(double),
            "PASS": number,
            "SHADOWED": 0,
        }
        if self.drawn and self.way != "replay":
            found |= self.drawn.own
        if number >= OVER_TRIANGLES and self.drawn:
            found |= {**self.drawn.defines(), "ORDERED": 0}
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
                textures={WALL_COLORS: self.drawing.wall_colors, **(textures or {})},
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
        if size > self.device.storage_bytes:
            raise NoPasses(f"{name} takes {size} bytes")
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
