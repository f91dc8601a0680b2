"""Pictures of triangles, by a technique: rasterised and composited, or drawn by a GPU's passes."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from moit.catalog import Technique, techniques
from moit.catalog import technique as technique_named
from moit.catalog.blocks import UPSAMPLINGS
from moit.checks.arguments import one_of, truth
from moit.checks.windows import picture_size
from moit.core.questions import background_of, overflow_text
from moit.engines import gpu_of
from moit.geometry.camera import Camera
from moit.geometry.drawing import Drawable
from moit.geometry.glass import share_through
from moit.geometry.light import Lights, light_numbers
from moit.geometry.meshes import (
    Mesh,
    common_origin,
    drawables_of,
    joined,
    meshes_of,
    texture_places,
    with_normals,
)
from moit.geometry.rasterizer import MOST_SIDE
from moit.geometry.squares import Resolution, factors_of, parts_of
from moit.rendering.making import Description, Image, Mixed, Rendering, by_fragments, on_gpu
from moit.rendering.rasterizing import Shot, maps_to_make, with_shadows
from moit.scenes.scene_parts import MeshScene
from moit.system.environment import thread_count
from moit.system.progress import Progress, steps

if TYPE_CHECKING:
    from moit.gpu.device import Device
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any

Scene = Drawable | Sequence[Drawable] | MeshScene | str
TARGETS = ("rgba16f", "rgba32f")
ORDERS = ("given", "object", "triangle")
WAYS = ("interlock", "fetch", "replay")


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
        cannot be drawn so (depth that the core warps or rounds, thick splats, more than buffers
        hold) is listed, read, and composited as `moit.composite` does on that device, in bands of
        rows where there is much. What a device cannot composite the CPU does, and a RuntimeWarning
        says why.
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
        made = by_fragments(asked) if gpu is None else on_gpu(gpu, asked)
        done(str(technique))
    if made.reason and made.device == "cpu":
        on = "" if gpu is None else gpu.renderer
        text = f"device: {technique} is composited on the CPU, not by {on}: {made.reason}"
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    if made.overflows:
        warnings.warn(overflow_text(made.overflows), RuntimeWarning, stacklevel=2)
    return made if report else made.image


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
