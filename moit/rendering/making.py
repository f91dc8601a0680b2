"""How a picture that `moit.render` is asked for comes about, and what it took."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.checks.exceptions import GpuError
from moit.core.engine import Engine
from moit.core.pieces import put
from moit.engines import engine_of
from moit.fragments.fragments import Fragments
from moit.geometry.drawing import Drawable
from moit.geometry.light import throw_shadows
from moit.geometry.rasterizer import Picture, transparent_range
from moit.geometry.squares import Parts
from moit.rendering.mixed_pictures import MixedPicture
from moit.rendering.rasterizing import Shot

if TYPE_CHECKING:
    from moit.gpu.device import Device
    from moit.gpu.listed import Listed
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any

Image = NDArray[np.float32]
MOST_AT_ONCE = 1 << 22  # fragments, as far as their kind is drawn in bands of rows
MOST_LISTED = 1 << 24  # by a GPU, which draws all again for each band


@dataclasses.dataclass(frozen=True, repr=False)
class Rendering:
    """A picture, and what it took.

    image : (height, width, 4) float32, as `moit.composite` gives it; None where it went `into` a
        texture.
    size : (width, height).
    timings : seconds of each pass, in the order in which they ran: of the GPU's own clock, or where
        a processor draws, of the time until it was done.
    memory : bytes on the device, by what they were for; on the CPU those of the fragments.
    way : how pixels got what they keep: "add" (additive blending), "interlock", "fetch", "replay"
        (lists of fragments on the device, that passes go over), or "arrays" (lists that the host
        reads, and gives to passes over arrays, as `moit.composite` does); where the CPU composites
        "composite", or "replay" of what a device has listed.
    bits_per_pixel : what the technique keeps, by its own account; None where it grows.
    device : who composited: "cpu", or "gpu".
    reason : where a GPU was asked for: why no passes of the technique go over what is drawn, but
        over arrays, or the CPU composited; else "". Of the latter a RuntimeWarning tells, too.
    overflows : of how many pixels more is kept than half floats hold, 65504; a RuntimeWarning says
        so. Where the picture goes into a texture nobody counts.

    >>> glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> moit.render(glass, "power4", (8, 6), report=True).size
    (8, 6)
    """

    image: Image | None
    size: tuple[int, int]
    timings: dict[str, float]
    memory: dict[str, int]
    way: str
    bits_per_pixel: float | None
    device: str = "cpu"
    reason: str = ""
    overflows: int = 0

    @property
    def seconds(self) -> float:
        """Of all passes."""
        return sum(self.timings.values())

    @property
    def bytes_per_pixel(self) -> float:
        """Of all memory."""
        return sum(self.memory.values()) / (self.size[0] * self.size[1])

    def __repr__(self) -> str:
        width, height = self.size
        passes = ", ".join(f"{name} {1e3 * spent:.2f} ms" for name, spent in self.timings.items())
        return f"Rendering({width}x{height}, {self.way}, {passes})"

    def _repr_html_(self) -> str:
        """The picture, small, and what it took; of a large one every n-th pixel is looked at."""
        from html import escape

        from moit.reports.shown_images import thinned
        from moit.showing import show

        told = f"<p><code>{escape(repr(self))}</code></p>"
        if self.image is None:
            return told
        return told + show(thinned(self.image)).html()


@dataclasses.dataclass(frozen=True)
class Mixed:
    """A scene with small parts, and how these are read."""

    parts: Parts
    depth_aware: bool


@dataclasses.dataclass(frozen=True, eq=False)
class Description:
    """What `render` is asked for, checked: nothing below looks at it again.

    parts : of the scene, as they are drawn. textures : (opaque, into).
    """

    parts: list[Drawable]
    technique: Technique
    shot: Shot
    background: NDArray[np.float64]
    target: str
    ordered: str | None
    exact: bool
    textures: tuple[Any, Any]
    mixed: Mixed | None

    @property
    def span(self) -> tuple[float, float]:
        """Of depths of what is transparent, in float32."""
        shot = self.shot
        near, far = transparent_range(self.parts, shot.camera, shot.antialias) or (1.0, 1.0)
        return float(np.float32(near)), float(np.float32(far))


def by_fragments(
    asked: Description, way: str = "composite", reason: str = "", device: Device | None = None
) -> Rendering:
    """By fragments, whoever makes them, and passes of a device over arrays of them, or the core.

    way : where the core does it.
    reason : why a device does not by passes over what is drawn.
    """
    technique, shot = asked.technique, asked.shot
    bits = technique.bits_per_pixel
    if asked.mixed is not None:
        picture = MixedPicture(asked.mixed.parts, shot, asked.span)
        image = picture.render(technique, asked.background, asked.mixed.depth_aware)
        memory = picture.memory
        return Rendering(image, shot.size, picture.timings, memory, way, bits, reason=reason)
    start = time.perf_counter()
    drawn: Picture | Listed
    drawn = shot.begin(asked.parts) if shot.gpu is None else shot.list(shot.gpu, asked.parts)
    timings = {"rasterize": time.perf_counter() - start, "composite": 0.0}
    if device is not None:
        try:
            engine, given = engine_of(technique, device, asked.exact), dict(timings)
            image, most, over = _composited(drawn, engine, asked, given)
            took = (given, {"fragments": most}, "arrays", bits, "gpu")
            return Rendering(image, shot.size, *took, reason=reason, overflows=over)
        except GpuError as error:
            reason = f"{reason}; over arrays: {error}"
    image, most, over = _composited(drawn, engine_of(technique, None), asked, timings)
    took = (timings, {"fragments": most}, way, bits, "cpu")
    return Rendering(image, shot.size, *took, reason=reason, overflows=over)


def _composited(
    drawn: Picture | Listed, engine: Engine, asked: Description, timings: dict[str, float]
) -> tuple[Image, int, int]:
    """The picture, how many bytes of fragments there were at once, and `Rendering.overflows`.

    Raises GpuError where a GPU's engine cannot.
    """
    technique, shot, behind = asked.technique, asked.shot, asked.background
    image, most, over = np.empty((*shot.size[::-1], 4), np.float32), 0, 0
    for f, top, bottom in _bands(drawn, technique, timings):
        start = time.perf_counter()
        question = put(engine, f, technique, cull_opaque=True, threads=shot.threads)
        image[top:bottom] = question.composite(behind[top:bottom] if behind.ndim == 3 else behind)
        over += question.overflows
        size_in_bytes = f.offsets.nbytes + f.depth.nbytes + f.alpha.nbytes
        most = max(most, size_in_bytes + (0 if f.color is None else f.color.nbytes))
        timings["composite"] += time.perf_counter() - start
    return image, most, over


def _bands(
    drawn: Picture | Listed, technique: Technique, timings: dict[str, float]
) -> Iterator[tuple[Fragments, int, int]]:
    """Fragments of rows [top, bottom): of all where pixels hang on one another."""
    height, most = drawn.size[1], MOST_AT_ONCE if isinstance(drawn, Picture) else MOST_LISTED
    for top, bottom in drawn.bands(most) if technique.local else [(0, height)]:
        start = time.perf_counter()
        f = drawn.rows(top, bottom)
        timings["rasterize"] += time.perf_counter() - start
        yield f, top, bottom


def on_gpu(device: Device, asked: Description) -> Rendering:
    """By passes over what is drawn; else by passes over arrays of its fragments, or the core."""
    made = _by_passes(device, asked)
    if isinstance(made, Rendering):
        return made
    if asked.textures != (None, None):
        raise GpuError(
            f"opaque, into: {asked.technique} is composited of fragments that the host reads, "
            "beside which textures have no place; draw into none, or use another technique"
        )
    from moit.gpu.primitives import lacking

    if lacking(asked.parts, asked.shot.antialias):
        shot = dataclasses.replace(asked.shot, gpu=None)
        return by_fragments(dataclasses.replace(asked, shot=shot), "composite", made, device)
    return by_fragments(asked, "replay", made, device)


def _by_passes(device: Device, asked: Description) -> Rendering | str:
    """By the technique's passes, or the reason why the device has none for this picture."""
    from moit.gpu.foreign import ForeignTextures
    from moit.gpu.meshes import Drawing
    from moit.gpu.mixed import small_pictures
    from moit.gpu.plan import plan_of
    from moit.gpu.primitives import is_thick, lacking
    from moit.gpu.rendering import Picture

    technique, shot, mixed, span = asked.technique, asked.shot, asked.mixed, asked.span
    if reason := lacking(asked.parts, shot.antialias):
        return reason
    if is_thick(asked.parts):
        return "thick Splats have no passes that draw them"
    if technique.depth_warp == "none":
        return "without a warp its range of depth is that of fragments, which have to be listed"
    empty = np.zeros(0, np.float32)
    none = Fragments([0, 0], empty, empty, np.zeros((0, 3), np.float32), depth_range=span)
    fields = technique.fields_for(none)
    with device:
        foreign = ForeignTextures(device, shot.size, *asked.textures)
        plan = plan_of(
            device,
            technique,
            fields,
            span,
            asked.target,
            asked.ordered,
            shot.size,
            listed=throw_shadows(shot.lights),
            joined=mixed is not None,
            exact=asked.exact,
        )
        if plan.reason:
            return plan.reason
        drawing = Drawing(
            device,
            asked.parts if mixed is None else mixed.parts.opaque + mixed.parts.transparent[1],
            shot.camera,
            *shot.size,
            lights=shot.light_numbers,
            threads=shot.threads,
            color_format=asked.target,
            shadowing=shot.lights,
            cutouts=() if mixed is None else mixed.parts.cutouts,
            antialias=shot.antialias,
        )
        picture = Picture(drawing, plan)
        if mixed is not None:
            small = small_pictures(
                picture, mixed.parts, shot.camera, shot.light_numbers, shot.threads
            )
            picture.join(small, mixed.depth_aware)
        reason = picture.begin(asked.background, foreign, shot.camera.near, shot.camera.far)
        if reason:
            return reason
        image = picture.finish(foreign)
    if picture.lost:
        return f"weights of {picture.lost} pixels underflow in its targets"
    bits, took = technique.bits_per_pixel, (picture.timings, picture.memory)
    over = picture.overflows
    return Rendering(image, shot.size, *took, plan.way, bits, device="gpu", overflows=over)
