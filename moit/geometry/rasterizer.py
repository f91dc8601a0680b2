"""Scenes to fragments, on the CPU; what is given is checked already."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments.fragments import Fragments
from moit.fragments.merging import merge
from moit.geometry.camera import Camera
from moit.geometry.coplanar import by_draw_order
from moit.geometry.drawing import Drawable, Emitted, Shares, bounding_sphere
from moit.geometry.glass import emit_glass, share_through
from moit.geometry.meshes import Mesh, common_origin, joined, mesh_arrays, seen_in
from moit.geometry.textures import Texture
from moit.system.environment import thread_count

MOST_SIDE = _core.numbers()["MOST_SIDE"]


def rasterized(
    scene: Sequence[Drawable],
    camera: Camera,
    size: tuple[int, int],
    threads: int,
    lights: NDArray[np.float64] | None = None,
    shares: Shares | None = None,
    coplanar: float | None = None,
) -> Fragments:
    """The fragments of a picture, as `moit.rasterize` has them; lights and shares as a Frame's."""
    frame = camera.frame(size, threads, lights, shares, coplanar is not None)
    span = transparent_range(scene, camera)
    kinds: list[tuple[tuple[type[Drawable], float], list[Any]]] = [
        (kind, list(some))
        for kind, some in itertools.groupby(scene, lambda one: (type(one), share_through(one)))
    ]
    emitted, passed = [], []
    for (kind, share), some in kinds or [((Mesh, 0.0), [])]:
        arrays, through = emit_glass(some, frame) if share else (kind.emit(some, frame), None)
        emitted.append(arrays)
        passed.append(through)
    if coplanar is not None and len(emitted) > 1:
        emitted, passed = [_merged(emitted, size)], [None]
    parts = [
        in_range(arrays, span, size, coplanar, through)
        for arrays, through in zip(emitted, passed, strict=True)
    ]
    return parts[0] if len(parts) == 1 else merge(parts)


def _merged(emitted: Sequence[Emitted], size: tuple[int, int]) -> Emitted:
    width, height = size
    parts = [Fragments(*arrays, shape=(height, width), dtype=np.float32) for arrays in emitted]
    f = merge(parts)
    assert f.color is not None
    return f.offsets, f.depth, f.alpha, f.color


def in_range(
    arrays: Emitted,
    span: tuple[float, float] | None,
    size: tuple[int, int],
    coplanar: float | None = None,
    transmission: NDArray[np.float32] | None = None,
) -> Fragments:
    """Emitted fragments, their depths in the range of what is transparent; coplanar : as
    `moit.rasterize` takes it, of all that is emitted."""
    if coplanar is not None:
        arrays = by_draw_order(arrays, coplanar)
    offsets, depth, alpha, color = arrays
    width, height = size
    if span is not None:
        near, far = (float(np.float32(end)) for end in span)
        inside = np.clip(depth, near, far)
        # only rounding moves transparent ones; opaque ones may be anywhere
        depth = np.where(alpha == 1, inside, np.clip(depth, *_widened(near, far)))
        span = (min(near, float(depth.min(initial=near))), max(far, float(depth.max(initial=far))))
    return Fragments(
        offsets,
        depth,
        alpha,
        color,
        transmission=transmission,
        shape=(height, width),
        depth_range=span,
        dtype=np.float32,
    )


# moit_screen_triangle of csrc/moit.h, and the struct of shaders/meshes
SCREEN_TRIANGLE = np.dtype(
    [
        ("inverse_z", np.float64, 3),
        ("color", np.float64, (3, 3)),
        ("alpha", np.float64, 3),
        ("normal", np.float64, (3, 3)),
        ("x", np.int32, 3),
        ("y", np.int32, 3),
        ("opaque", np.int32),
        ("source", np.int32),
    ]
)
# moit_textured_triangle
TEXTURED_TRIANGLE = np.dtype(
    [
        *((name, SCREEN_TRIANGLE[name]) for name in SCREEN_TRIANGLE.names or ()),
        ("u", np.float64, 3),
        ("v", np.float64, 3),
        ("cutoff", np.float64),
        *(
            (name, np.int32)
            for name in (
                "first", "columns", "rows", "filtering", "wrap_u", "wrap_v", "lit", "masked"
            )
        ),
    ]
)  # fmt: skip


def screen_triangles(
    meshes: list[Mesh],
    camera: Camera,
    width: int,
    height: int,
    threads: int | None = None,
    firsts: dict[Texture, int] | None = None,
) -> NDArray[Any]:
    """The triangles that `rasterized` draws, in draw order: (n,) SCREEN_TRIANGLE.

    firsts : where the texels of each texture begin: (n,) TEXTURED_TRIANGLE; None: all meshes are
        without.
    """
    frame = camera.frame((width, height), thread_count(threads))
    origin = common_origin(meshes, frame.eye)
    arrays = joined(meshes, origin) if firsts is None else mesh_arrays(meshes, origin, firsts)
    seen = seen_in(frame, origin)
    found = _core.screen_triangles(arrays, seen, width, height, frame.threads)
    return found.view(SCREEN_TRIANGLE if firsts is None else TEXTURED_TRIANGLE)[:, 0]


def transparent_range(scene: Sequence[Drawable], camera: Camera) -> tuple[float, float] | None:
    """Depths of the bounding sphere of what lets light through; None where nothing does."""
    points = [found for found in (one.transparent_points for one in scene) if len(found)]
    if not points:
        return None
    middle, radius = bounding_sphere(points)
    distance = float(np.dot(camera.axes[2], middle - np.array(camera.eye)))
    near = min(max(distance - radius, camera.near), camera.far)
    far = max(min(distance + radius, camera.far), near)
    return near, far


def _widened(near: float, far: float) -> tuple[float, float]:
    """What float32 may make of depths of a range's ends."""
    slack = 1e-6 * far
    return near - slack, far + slack
