"""Pictures of triangles, by a technique: rasterised and composited, or drawn by a GPU's passes."""

from __future__ import annotations

import dataclasses
import time
import warnings
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.catalog import Technique, techniques
from moit.catalog import technique as technique_named
from moit.catalog.blocks import UPSAMPLINGS
from moit.checks.arguments import one_of, truth
from moit.checks.exceptions import GpuError
from moit.checks.windows import picture_size
from moit.core.pieces import put
from moit.core.questions import background_of, overflow_text
from moit.engines import engine_of, gpu_of
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.drawing import Drawable
from moit.geometry.glass import share_through
from moit.geometry.light import Lights, light_numbers, throw_shadows
from moit.geometry.meshes import (
    Mesh,
    common_origin,
    drawables_of,
    joined,
    meshes_of,
    texture_places,
    with_normals,
)
from moit.geometry.rasterizer import MOST_SIDE, Picture, transparent_range
from moit.geometry.squares import Parts, Resolution, factors_of, parts_of
from moit.rendering.mixed_pictures import MixedPicture
from moit.rendering.rasterizing import Shot, maps_to_make, with_shadows
from moit.scenes.scene_parts import MeshScene
from moit.system.environment import thread_count
from moit.system.progress import Progress, steps

if TYPE_CHECKING:
    from moit.gpu.device import Device
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any

Image = NDArray[np.float32]
Scene = Drawable | Sequence[Drawable] | MeshScene | str
TARGETS = ("rgba16f", "rgba32f")
ORDERS = ("given", "object", "triangle")
MOST_AT_ONCE = 1 << 22  # fragments, as far as their kind is drawn in bands of rows
WAYS = ("interlock", "fetch", "replay")


@dataclasses.dataclass(frozen=True, repr=False)
class Rendering:
    """A picture, and what it took.

    image : (height, width, 4) float32, as `moit.composite` gives it; None where it went `into` a
        texture.
    size : (width, height).
    timings : seconds of each pass, in the order in which they ran: of the GPU's own clock, or where
        a processor draws, of the time until it was done.
    memory : bytes on the device, by what they were for; on the CPU those of the fragments.
    way : how pixels got what they keep: "add" (additive blending), "interlock", "fetch", or
        "replay" (lists of fragments, that passes go over, or where they cannot the core does); on
        the CPU "composite".
    bits_per_pixel : what the technique keeps, by its own account; None where it grows.
    device : who composited: "cpu", or "gpu".
    reason : why the CPU did where a GPU was asked for; else "".
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


class _Options(TypedDict, total=False):
    """What all calls of `render` may have."""

    device: str | Device
    camera: Camera | None
    lights: Lights
    background: ArrayLike | None
    target: str
    order: str
    ordered: str | None
    exact: bool
    opaque: tuple[Any, Any] | None
    resolution: Resolution
    upsampling: str
    antialias: bool
    threads: int | None
    progress: Progress


@overload
def render(
    scene: Scene,
    technique: str | Technique,
    size: tuple[int, int],
    *,
    into: None = ...,
    report: Literal[False] = ...,
    **options: Unpack[_Options],
) -> Image: ...
@overload
def render(
    scene: Scene,
    technique: str | Technique,
    size: tuple[int, int],
    *,
    into: Any,
    report: Literal[False] = ...,
    **options: Unpack[_Options],
) -> None: ...
@overload
def render(
    scene: Scene,
    technique: str | Technique,
    size: tuple[int, int],
    *,
    into: Any = ...,
    report: Literal[True],
    **options: Unpack[_Options],
) -> Rendering: ...
def render(
    scene: Scene,
    technique: str | Technique,
    size: tuple[int, int],
    *,
    device: str | Device = "cpu",
    camera: Camera | None = None,
    lights: Lights = (),
    background: ArrayLike | None = None,
    target: str = "rgba16f",
    order: str = "given",
    ordered: str | None = None,
    exact: bool = False,
    opaque: tuple[Any, Any] | None = None,
    into: Any = None,
    resolution: Resolution = 1,
    upsampling: str = "bilinear",
    antialias: bool = False,
    threads: int | None = None,
    progress: Progress = True,
    report: bool = False,
) -> Image | Rendering | None:
    """The picture that a technique makes of triangles.

    scene : a Mesh, several in draw order, the name of a scene of triangles, or a
        `moit.scenes.meshes(name)`.
    size : (width, height), each from 1 to 16,384.
    device : "cpu": `moit.rasterize` and `moit.composite`. "gpu" or a `moit.gpu.Device`: an opaque
        pass, which cut-outs (alpha 1 where triangles are not opaque) are part of, and the passes of
        the technique: capture, one that makes factors of what was captured, shading, and one that
        resolves. Techniques that have none are captured as lists of fragments, and replayed. What
        a device cannot composite the CPU does, and a RuntimeWarning says why.
    camera : None: that of the scene, or one that has all of it in the picture.
    lights : as `moit.rasterize`. With shadows a GPU lists fragments, and technique's passes go over
        the lists ("replay").
    background : (3,) or (height, width, 3) linear radiance; None: that of the scene, or black.
    target : what a GPU's colour targets hold: "rgba16f", as published, or "rgba32f".
    order : of transparent triangles. "given"; "object": meshes from back to front, by the middle of
        the box that holds each; "triangle": all triangles from back to front by their middles.
    ordered : how a GPU lets the fragments of a pixel change what it keeps one after the other, for
        techniques that need it: "interlock" and "fetch" are extensions of OpenGL
        (ARB_fragment_shader_interlock, EXT_shader_framebuffer_fetch); "replay" always can, and is
        taken for any technique that is asked for it. None: the first of these that the device has.
    exact : of a GPU, as `moit.composite` has it: True: passes with the CPU's kernels, much of it in
        double, and their bits; False: texts for engines, in floats alone, where there are any.
    opaque : (color, depth), textures of the device's context (a GL name each, or what has it as
        `glo`, such as moderngl's) of this size: what others have drawn with
        `camera.matrices(size)`; it is behind, or in front of, what is drawn here, and background
        where its depth is 1. Colour is linear, and rows start at the bottom, as GL has them.
    into : such a texture, which gets the picture; nothing is returned then.
    resolution : 1, 2, 4 or 8, the side in pixels of the squares in which transparent triangles are
        drawn: one for all meshes, one for each, or {number of a mesh: its own}, 1 for others. For
        techniques whose targets add up ("weighted-sum", "weighted-average", "wboit"): each size has
        targets of its own, joined when the picture is composited, whatever lies in front of what
        (McGuire, "Weighted Blended Order-Independent Transparency", 2015). What is opaque, cut-outs
        too, is drawn in full; the farthest of it in a square hides what is behind.
    upsampling : how pixels read smaller targets. "bilinear", as published; or "depth-aware": in
        every other square the nearest opaque surface hides what is behind, and of the four squares
        round a pixel those count more whose surface is as far away as the pixel's, so that what is
        small does not run over the edges of what is opaque.
    antialias : as `moit.rasterize`; not with resolution.
    threads : of the core; None: MOIT_THREADS, or as many as this process has processors.
    progress : True, False, or a callable (done, total, label) of shadow maps and the picture.
    report : give a `Rendering`, with the seconds of each pass and the bytes that they took.

    Returns (height, width, 4) float32, as `moit.composite`. A GPU adds up floats where the CPU adds
    up doubles, and rounds to the target's format; else they agree. Moments that blending adds up
    have the published bias unless one is given, for rounding's sake.

    Raises TypeError and ValueError for arguments that do not fit; GpuError where there is no
    device, or it cannot do what is asked.

    >>> glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> moit.render(glass, "power4", (8, 6)).shape
    (6, 8, 4)
    """
    technique = technique_named(technique)
    parts, camera, behind = checked_scene(scene, camera, background)
    size = picture_size(size, MOST_SIDE)
    behind = background_of(behind, size[::-1], np.float32)
    one_of("target", target, TARGETS)
    one_of("order", order, ORDERS)
    one_of("ordered", ordered, (None, *WAYS))
    truth("exact", exact)
    truth("report", report)
    numbers = light_numbers(lights, camera)
    workers = thread_count(threads)
    one_of("upsampling", upsampling, UPSAMPLINGS)
    mixed = _mixed(parts, technique, resolution, camera, order, upsampling)
    truth("antialias", antialias)
    if antialias and mixed is not None:
        raise ValueError("resolution: expected 1 with antialias")
    gpu = gpu_of(device)
    if gpu is None and not (opaque is None and into is None):
        raise ValueError("opaque, into: textures are on a device; found device='cpu'")
    with steps(progress, maps_to_make(lights) + 1, "render", patient=True) as done:
        shadowed = with_shadows(lights, parts, workers, done)
        shot = Shot(camera, size, shadowed, numbers, gpu, workers, antialias=antialias)
        done.now(str(technique))
        parts = in_order(parts, camera, order)
        textures = (opaque, into)
        asked = Description(parts, technique, shot, behind, target, ordered, exact, textures, mixed)
        made = _by_fragments(asked) if gpu is None else _on_gpu(gpu, asked)
        done(str(technique))
    if made.reason:
        on = "" if gpu is None else gpu.renderer
        text = f"device: {technique} is composited on the CPU, not by {on}: {made.reason}"
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    if made.overflows:
        warnings.warn(overflow_text(made.overflows), RuntimeWarning, stacklevel=2)
    return made if report else made.image


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


def check_adds_up(technique: Technique) -> None:
    """Raises ValueError for a technique whose state is no sum over pictures."""
    if not technique.adds_targets:
        able = dict.fromkeys(one.kind for one in techniques() if one.adds_targets)
        raise ValueError(
            f"resolution: expected one of {', '.join(able)}, whose colours and weights add up "
            f"whatever picture they come from, got {technique}; moments and series have states of "
            "low resolution by an option of their own, as power4(resolution=4)"
        )


def _mixed(
    scene: list[Drawable],
    technique: Technique,
    resolution: Resolution,
    camera: Camera,
    order: str,
    upsampling: str,
) -> Mixed | None:
    """None where nothing is drawn small."""
    factors = factors_of(resolution, len(scene))
    if max(factors, default=1) == 1:
        return None
    check_adds_up(technique)
    if any(map(share_through, scene)):
        raise ValueError("resolution: expected 1 for scenes of meshes with transmission")
    parts = parts_of(meshes_of(scene), factors)
    if not parts.small:
        return None
    ordered = {side: in_order(some, camera, order) for side, some in parts.transparent.items()}
    return Mixed(dataclasses.replace(parts, transparent=ordered), upsampling == "depth-aware")


def _by_fragments(asked: Description, way: str = "composite", reason: str = "") -> Rendering:
    """By fragments, whoever makes them, and the core."""
    technique, shot = asked.technique, asked.shot
    bits = technique.bits_per_pixel
    if asked.mixed is not None:
        picture = MixedPicture(asked.mixed.parts, shot, asked.span)
        image = picture.render(technique, asked.background, asked.mixed.depth_aware)
        memory = picture.memory
        return Rendering(image, shot.size, picture.timings, memory, way, bits, reason=reason)
    start = time.perf_counter()
    drawn: Fragments | Picture
    drawn = shot.begin(asked.parts) if shot.gpu is None else shot.take(asked.parts)
    timings = {"rasterize": time.perf_counter() - start, "composite": 0.0}
    image, most, over = np.empty((*shot.size[::-1], 4), np.float32), 0, 0
    engine, behind = engine_of(technique, None), asked.background
    for f, top, bottom in _bands(drawn, technique, timings):
        start = time.perf_counter()
        question = put(engine, f, technique, cull_opaque=True, threads=shot.threads)
        image[top:bottom] = question.composite(behind[top:bottom] if behind.ndim == 3 else behind)
        over += question.overflows
        size_in_bytes = f.offsets.nbytes + f.depth.nbytes + f.alpha.nbytes
        most = max(most, size_in_bytes + (0 if f.color is None else f.color.nbytes))
        timings["composite"] += time.perf_counter() - start
    memory = {"fragments": most}
    return Rendering(image, shot.size, timings, memory, way, bits, reason=reason, overflows=over)


def _bands(
    drawn: Fragments | Picture, technique: Technique, timings: dict[str, float]
) -> Iterator[tuple[Fragments, int, int]]:
    """Fragments of rows [top, bottom): of all where pixels hang on one another."""
    if isinstance(drawn, Fragments):
        yield drawn, 0, drawn.shape[0]
        return
    height = drawn.size[1]
    for top, bottom in drawn.bands(MOST_AT_ONCE) if technique.local else [(0, height)]:
        start = time.perf_counter()
        f = drawn.rows(top, bottom)
        timings["rasterize"] += time.perf_counter() - start
        yield f, top, bottom


def _on_gpu(device: Device, asked: Description) -> Rendering:
    made = _by_passes(device, asked)
    if isinstance(made, Rendering):
        return made
    if asked.textures != (None, None):
        raise GpuError(
            f"opaque, into: {asked.technique} is composited by the core, which takes no textures; "
            "draw into none, or use another technique"
        )
    from moit.gpu.primitives import lacking

    if lacking(asked.parts, asked.shot.antialias):
        shot = dataclasses.replace(asked.shot, gpu=None)
        return _by_fragments(dataclasses.replace(asked, shot=shot), reason=made)
    return _by_fragments(asked, "replay", made)


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
        return "fragments of thick Splats are composited by the core"
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


def in_order(scene: Sequence[Any], camera: Camera, order: str) -> list[Any]:
    """Parts of a scene, or Meshes of all its triangles, from back to front: one where all wear the
    same."""
    if order == "given" or not scene:
        return list(scene)
    away, eye = camera.axes[2], np.array(camera.eye)
    if order == "object":
        middles = [
            (one.points.min(axis=0, initial=np.inf) + one.points.max(axis=0, initial=-np.inf)) / 2
            for one in scene
        ]
        distance = np.array([(middle - eye) @ away for middle in middles])
        return [scene[i] for i in np.argsort(-distance, kind="stable")]
    meshes = with_normals(meshes_of(scene))
    origin = common_origin(meshes, eye)
    vertices, normals, color, alpha, triangles = joined(meshes, origin)
    distance = ((vertices - (eye - origin)) @ away)[triangles].mean(axis=1)
    places = np.argsort(-distance, kind="stable")
    triangles = triangles[places]
    if not len(triangles) or not any(mesh.wears_something for mesh in meshes):
        return [Mesh(vertices, triangles, color, alpha, normals, origin=origin)]
    uv = np.concatenate([texture_places(mesh) for mesh in meshes])
    kinds: dict[tuple[Any, ...], int] = {}
    of_mesh = [kinds.setdefault(mesh.worn, len(kinds)) for mesh in meshes]
    kind = np.repeat(of_mesh, [len(mesh.triangles) for mesh in meshes])[places]
    found = []
    for run in np.split(np.arange(len(kind)), np.flatnonzero(np.diff(kind)) + 1):
        texture, cutoff, lit, share = list(kinds)[kind[run[0]]]
        used, corners = np.unique(triangles[run], return_inverse=True)
        found.append(
            Mesh(
                vertices[used],
                corners.reshape(-1, 3),
                color[used],
                alpha[used],
                None if normals is None else normals[used],
                uv=uv[used],
                texture=texture,
                alpha_cutoff=cutoff,
                lit=lit,
                transmission=share,
                origin=origin,
            )
        )
    return found


def checked_scene(
    scene: Scene, camera: Camera | None, background: ArrayLike | None
) -> tuple[list[Drawable], Camera, ArrayLike]:
    if isinstance(scene, str):
        from moit.scenes import meshes as scene_named

        scene = scene_named(scene)
    own_camera, behind = None, (0.0, 0.0, 0.0)
    if isinstance(scene, MeshScene):
        own_camera, behind = scene.camera, scene.background
        scene = scene.meshes
    parts = drawables_of(scene)
    if camera is not None and not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera or None, got {type(camera).__name__}")
    chosen = camera or own_camera or Camera(eye=(0.6, 0.5, 1.0)).fit(parts)
    return parts, chosen, behind if background is None else background
