"""Triangles drawn by a GPU: opaque surfaces, and lists of fragments as moit.rasterize has them.

The core projects, clips and snaps (`_core.screen_triangles`); passes of shaders/meshes/ draw just
what it would. So a picture has the same fragments, and on llvmpipe their bits, whoever draws it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import GpuError
from moit.geometry.light import MOST_LIGHTS, Lights, throw_shadows
from moit.gpu.bindings import (
    ADD,
    ALPHAS,
    ANSWERS,
    BEGIN,
    COLORS,
    COUNT,
    DEPTHS,
    DEVIATIONS,
    FILL,
    GROUP,
    KEYS,
    MOST_SIDE,
    OCCLUDER_COLORS,
    OCCLUDER_DEPTHS,
    OCCLUDER_FRAGMENTS,
    OCCLUDERS,
    OFFSETS,
    PLACE,
    PLACES,
    RAYS,
    REACHED,
    RUN,
    RUN_NUMBERS,
    RUN_SUMS,
    SCAN,
    SHADE,
    SOFTWARE_ITERATIONS,
    TEXELS,
    TRIANGLES,
    group_counts,
)
from moit.gpu.primitives import Primitive, may_be_solid, recorded, texture_firsts
from moit.gpu.strokes import looks_along

if TYPE_CHECKING:
    from moit.geometry.camera import Camera
    from moit.geometry.drawing import Drawable
    from moit.geometry.textures import Texture
    from moit.gpu.device import Device
    from moit.gpu.shadows import Shadows

Array = NDArray[Any]

BYTES_OF_A_FRAGMENT = 12  # in the largest of its buffers


@dataclasses.dataclass
class Part:
    """Records of one kind in one buffer: `count` of them from `first` on, in draw order.

    buffers : what their text reads besides, by number.
    """

    primitive: Primitive
    buffer: Any
    first: int
    count: int
    buffers: dict[int, Any]


@dataclasses.dataclass
class Lists:
    """Fragments on the device, as shaders/arrays/ has them."""

    count: int
    offsets: Any
    depth: Any
    alpha: Any
    color: Any
    rays: Any  # the pixel of each
    deviation: Any  # None: none is thick
    bytes: int  # of all that was made for it


class Drawing:
    """A scene on a device, seen by a camera; use it while the device is current.

    shadowing : the same lights, as moit.shadows.reaching.with_maps gives them, with shadows.
    cutouts : other meshes, of which what is opaque is drawn alone.
    lists_opaque : what is opaque is listed as all else, and hides nothing.
    antialias : of points and lines, alpha counts by what of a pixel they cover.

    Raises GpuError where the device cannot hold them.
    """

    def __init__(
        self,
        device: Device,
        scene: Sequence[Drawable],
        camera: Camera,
        width: int,
        height: int,
        *,
        lights: Array,
        threads: int | None = None,
        color_format: str = "rgba32f",
        shadowing: Lights = (),
        cutouts: Sequence[Drawable] = (),
        lists_opaque: bool = False,
        antialias: bool = False,
    ) -> None:
        self.device, self.width, self.height, self.threads = device, width, height, threads
        self.opaque: list[Part] = []
        self.transparent: list[Part] = []
        self.may_be_solid: list[Part] = []
        self.bytes = 0
        firsts, texels = texture_firsts([*scene, *cutouts])
        self.textures = {TEXELS: self._texels(firsts, texels)} if firsts else {}
        seen = (camera, width, height, threads, firsts)
        for kind, records in recorded(scene, *seen, antialias):
            opaque = (records["opaque"] == 1) & (not lists_opaque)
            clear = records[~opaque]
            self._upload(kind, records[opaque], self.opaque)
            self._upload(kind, clear, self.transparent)
            self._upload(kind, may_be_solid(clear), self.may_be_solid)
            self.bytes += records.nbytes
        for kind, records in recorded(cutouts, *seen):
            self._upload(kind, may_be_solid(records), self.may_be_solid)
        scale_x, scale_y = camera.scale((width, height))
        self.occluder_scale = 2.0 ** -(math.frexp(camera.far)[1] + 1)
        self.uniforms: dict[str, Any] = {
            "picture": (width, height),
            "listed_rows": (0, height),
            "block_side": 1,
            "blocks_there": (width, height),
            "before": (0, 0),
            "alternates": 0,
            "width": width,
            "reach": tuple(
                128 * side if device.software else _reach(side) for side in (width, height)
            ),
            "nearest": camera.near * (1.0 - 1e-12),
            "farthest": camera.far,
            "view": (
                2.0 / (width * scale_x),
                -1.0 / scale_x,
                -2.0 / (height * scale_y),
                1.0 / scale_y,
            ),
            **looks_along(camera, width, height),
            "occluder_scale": self.occluder_scale,
            "lights": len(lights),
            "light_numbers": np.resize(np.append(lights.reshape(-1), 0.0), 6 * MOST_LIGHTS),
        }
        self.shadows: Shadows | None = None
        if throw_shadows(shadowing):
            from moit.gpu.shadows import Shadows

            self.shadows = Shadows(
                device, shadowing, camera, (width, height), self.uniforms["view"], threads
            )
        self.occluders = device.texture("depth32f", width, height)
        self.occluder_colors = device.texture(color_format, width, height)

    def _texels(self, firsts: dict[Texture, int], count: int) -> Any:
        """All texels in one texture, in rows of MOST_SIDE."""
        rows = -(-count // MOST_SIDE)
        if rows > MOST_SIDE:
            raise GpuError(
                f"scene: its textures have {count} texels with smaller levels, and a device holds "
                f"{MOST_SIDE**2}; use smaller images or device='cpu'"
            )
        texels = np.zeros((rows * MOST_SIDE, 4), np.float32)
        for texture, first in firsts.items():
            texels[first : first + len(texture.levels)] = texture.levels
        held = self.device.texture("rgba32f", MOST_SIDE, rows)
        held.write(texels.reshape(rows, MOST_SIDE, 4))
        self.bytes += texels.nbytes
        return held

    def _upload(self, primitive: Primitive, records: Array, to: list[Part]) -> None:
        size = records.dtype.itemsize
        before = to[-1].first + to[-1].count if to else 0
        most = min(self.device.storage_bytes // size, (2**31 - 1) // primitive.corners)
        more = getattr(primitive, "buffers", None)
        if more and len(records) > most:
            named = getattr(primitive, "named", "records")
            raise GpuError(
                f"scene: {len(records)} {named} are seen, and a buffer of "
                f"{self.device.renderer} holds {most}; use device='cpu'"
            )
        for first in range(0, len(records), most):
            some = np.ascontiguousarray(records[first : first + most]).view(np.uint8)
            buffer = self.device.buffer(some.nbytes, some)
            own = more(self.device, buffer, self.width, self.height) if more else {}
            to.append(Part(primitive, buffer, before + first, some.nbytes // size, own))

    def draw(
        self,
        parts: list[Part],
        shader: str,
        defines: dict[str, Any],
        *,
        buffers: dict[int, Any] | None = None,
        textures: dict[int, Any] | None = None,
        uniforms: dict[str, Any] | None = None,
        **options: Any,
    ) -> None:
        """Every record through a fragment shader; options as the driver's draw."""
        for part in parts:
            kind = part.primitive
            program = self.device.drawing(kind.vertex, shader, PRIMITIVE=kind.surface, **defines)
            self.device.draw(
                program,
                kind.corners * part.count,
                buffers={**(buffers or {}), TRIANGLES: part.buffer, **part.buffers},
                textures={**self.textures, **(textures or {})},
                uniforms={**self.uniforms, **(uniforms or {}), "first": part.first},
                **options,
            )

    def draw_occluders(
        self, background: Array, cutouts: bool, others: Callable[[], None] | None = None
    ) -> None:
        """The opaque pass; with cut-outs what has alpha 1 is opaque wherever it is.

        background : (3,) or (height, width, 3).
        others : draws what is opaque besides.

        Where lights throw shadows all is drawn twice: what shadows leave of light hangs on which
        surface is the nearest.
        """
        self._draw_walls(background, cutouts, others, None)
        if self.shadows is not None:
            pixels = self.width * self.height
            depths = self._numbers(pixels)
            self.run(OCCLUDER_DEPTHS, pixels, {ANSWERS: depths})
            self._draw_walls(background, cutouts, others, self.shadows.reached(pixels, depths))

    def _draw_walls(
        self,
        background: Array,
        cutouts: bool,
        others: Callable[[], None] | None,
        reached: Any,
    ) -> None:
        self.device.clear(self.occluders, (1.0,))
        if background.ndim == 1:
            self.device.clear(self.occluder_colors, (*background.tolist(), 0.0))
        else:
            blank = np.zeros((self.height, self.width, 1))
            self.occluder_colors.write(
                np.concatenate([background, blank], axis=2, dtype=np.float32)
            )
        if others:
            others()
        for parts, cutout in ((self.opaque, 0), (self.may_be_solid if cutouts else [], 1)):
            self.draw(
                parts,
                "meshes/occluders.frag.glsl",
                {"DOUBLE": 0, "CUTOUT": cutout, "SHADOWED": int(reached is not None)},
                buffers={} if reached is None else {REACHED: reached},
                targets=[self.occluder_colors],
                depth=self.occluders,
                depth_test="less",
                depth_write=True,
            )

    @property
    def most_fragments(self) -> int:
        """That can be listed at once."""
        return int(self.device.storage_bytes // BYTES_OF_A_FRAGMENT)

    def count_fragments(self, with_solid: bool, rows: tuple[int, int] | None = None) -> Any:
        """(pixels + 1,), of each pixel how many fragments there are to list, and 0; rows : as
        `list_fragments` has them."""
        self.uniforms["listed_rows"] = rows or (0, self.height)
        pixels, solid = self.width * self.height, int(with_solid)
        counts = self._numbers(pixels + 1)
        self.run(BEGIN, pixels + 1, {OFFSETS: counts}, solid)
        self._draw_listed(COUNT, solid, {PLACES: counts})
        return counts

    def offsets_of(self, counted: Any) -> int:
        """Turns what `count_fragments` gives into where each pixel's fragments begin. Returns how
        many there are, or 2^32 - 1 where that is less."""
        pixels = self.width * self.height
        self._sum(counted, pixels + 1)
        end = np.empty(1, np.uint32)
        counted.read(end, 4 * pixels)
        return int(end[0])

    def list_fragments(
        self,
        with_solid: bool,
        rows: tuple[int, int] | None = None,
        begun: tuple[Any, int] | None = None,
    ) -> Lists:
        """Transparent fragments that opaque surfaces (`draw_occluders`) do not hide; of what is
        thick all, as some of it is in front of a surface that hides its middle.

        They are counted first and then listed, so none is lost.

        with_solid : opaque surfaces are listed too, a pixel's first, and cut-outs are as others.
        rows : of pixels, from the first of these to before the second; None: all. The others have
            none.
        begun : where pixels' fragments begin, and how many there are, if that is known.

        Raises GpuError where there are more than can be listed at once.
        """
        pixels = self.width * self.height
        solid = int(with_solid)
        if begun is None:
            counted = self.count_fragments(with_solid, rows)
            begun = counted, self.offsets_of(counted)
        offsets, count = begun
        most = self.most_fragments
        if count > most:
            found = str(count) if count < 2**32 - 1 else "over 4,294,967,294"
            some = f"{self.width} x {self.height} pixels"
            some = some if rows is None else f"row {rows[0]} of {some}"
            raise GpuError(
                f"size: {some} has {found} fragments, and a buffer of {self.device.renderer} "
                f"holds {most}; use a smaller size or device='cpu'"
            )
        if self.device.software and count > SOFTWARE_ITERATIONS:
            self._check_loops(offsets)
        places, keys = self._numbers(pixels), self._numbers(2 * count)
        self.device.fill(keys, 2**32 - 1)
        arrays = [self._numbers(n * count) for n in (1, 1, 3, 1)]
        depth, alpha, color, rays = arrays
        size = 4 * (2 * pixels + 1) + 4 * 8 * count
        deviation = None
        if any(map(_is_thick, self.transparent)):
            deviation = self._numbers(count)
            self.device.fill(deviation, 0)
            size += 4 * count
        lists = Lists(count, offsets, depth, alpha, color, rays, deviation, size)
        to = {OFFSETS: offsets, **dict(zip((DEPTHS, ALPHAS, COLORS, RAYS), arrays, strict=True))}
        self.run(PLACE, pixels, {OFFSETS: offsets, PLACES: places}, solid)
        self._draw_listed(FILL, solid, {PLACES: places, KEYS: keys})
        self._shade(lists, {**to, KEYS: keys}, solid)
        if self.shadows is not None and count:
            if with_solid:  # what stands for opaque surfaces is no fragment yet
                self.device.fill(rays, 0)
                self.device.fill(depth, 0)
                self.device.fill(alpha, 0)
                self._shade(lists, {**to, KEYS: keys}, solid)
            reached = self.shadows.reached(count, depth, alpha, rays)
            self._shade(lists, {**to, KEYS: keys, REACHED: reached}, solid)
        if with_solid:
            self.run(OCCLUDER_FRAGMENTS, pixels, to, solid)
        return lists

    def _shade(self, lists: Lists, buffers: dict[int, Any], solid: int) -> None:
        for part in self.transparent:
            held = {"first": part.first, "held": part.count}
            own = {**buffers, TRIANGLES: part.buffer, **part.buffers}
            thick = _is_thick(part)
            if thick:
                own[DEVIATIONS] = lists.deviation
            surface = part.primitive.surface
            self.run(SHADE, lists.count, own, solid, held, PRIMITIVE=surface, THICK=thick)

    def _check_loops(self, offsets: Any) -> None:
        """Software renderers leave loops early, silently; one goes over a pixel's fragments."""
        found = np.empty(self.width * self.height + 1, np.uint32)
        offsets.read(found)
        most = int(np.diff(found).max())
        if most > SOFTWARE_ITERATIONS:
            raise GpuError(
                f"scene: a pixel has {most} fragments, and loops of {self.device.renderer} are "
                f"sure to reach {SOFTWARE_ITERATIONS} of them only; use device='cpu'"
            )

    def _draw_listed(self, number: int, solid: int, buffers: dict[int, Any]) -> None:
        defines = {"DOUBLE": 0, "PASS": number, "WITH_SOLID": solid, "SHADOWED": 0}
        for part in self.transparent:
            self.draw(
                [part],
                "meshes/listed.frag.glsl",
                {**defines, "THICK": _is_thick(part)},
                buffers=buffers,
                textures={OCCLUDERS: self.occluders},
                size=(self.width, self.height),
            )

    def _sum(self, numbers: Any, count: int) -> None:
        """In place, what comes before each."""
        runs = -(-count // RUN)
        sums = self._numbers(runs)
        self.run(SCAN, runs * GROUP, {RUN_NUMBERS: numbers, RUN_SUMS: sums}, 0, {"count": count})
        if runs > 1:
            self._sum(sums, runs)
            self.run(ADD, count, {RUN_NUMBERS: numbers, RUN_SUMS: sums}, 0)

    def _numbers(self, count: int) -> Any:
        return self.device.buffer(max(4 * count, 16))

    def run(
        self,
        number: int,
        threads: int,
        buffers: dict[int, Any],
        solid: int = 0,
        uniforms: dict[str, Any] | None = None,
        images: dict[int, Any] | None = None,
        **defines: Any,
    ) -> None:
        if not threads:
            return
        shadowed = int(number == SHADE and REACHED in buffers)
        program = self.device.program(
            "meshes/lists.comp.glsl",
            DOUBLE=0,
            PASS=number,
            WITH_SOLID=solid,
            SHADOWED=shadowed,
            **defines,
        )
        self.device.dispatch(
            program,
            group_counts(threads),
            buffers=buffers,
            textures={
                OCCLUDERS: self.occluders,
                OCCLUDER_COLORS: self.occluder_colors,
                **self.textures,
            },
            images=images or {},
            uniforms={**self.uniforms, "count": threads, **(uniforms or {})},
        )


def _reach(side: int) -> int:
    """How far from the middle a GPU does not clip, and finds corners to 1/256 pixel, in these.

    Of floats of 24 bits: beyond 4096 pixels the two roundings on the way there come near half of
    that, and guard bands are some 32,768 pixels wide. llvmpipe has none.
    """
    return 256 * min(side, max(side // 2, 4096))


def _is_thick(part: Part) -> int:
    return int(getattr(part.primitive, "thick", False))
