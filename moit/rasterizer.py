"""Meshes to fragments."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.arguments import one_of
from moit.camera import Camera
from moit.environment import thread_count
from moit.exceptions import GpuError
from moit.fragments import Fragments
from moit.meshes import Mesh, Meshes, bounding_sphere, joined, meshes_of
from moit.windows import picture_size

MOST_SIDE = 16384


def rasterize(
    scene: Meshes,
    camera: Camera,
    size: tuple[int, int],
    *,
    device: str = "cpu",
    threads: int | None = None,
) -> Fragments:
    """The fragments of a picture of triangles: float32, in draw order.

    scene : a Mesh, or several in the order in which they are drawn.
    size : (width, height), each from 1 to 16,384.

    One fragment for each pixel whose middle a triangle covers, seen from either side; of an edge
    that two triangles share, one of them has what lies on it (the top-left rule, on vertices
    snapped to 1/256 pixel as GPUs do). Attributes are interpolated perspective-correctly; colour
    is lit by Lambert's law on both sides, from the upper left behind the eye. Depth is the
    distance along the view. Of opaque triangles the nearest alone is kept, first in its pixel, and
    hides what is behind it.

    depth_range is that of the bounding sphere of the transparent triangles, as far as near and far
    leave it, so that it moves smoothly with the camera; opaque fragments beyond it are held at its
    ends, where they hide and are hidden as before.

    The result is the same bits for any number of threads. Raises TypeError and ValueError.
    """
    meshes = meshes_of(scene)
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")
    width, height = picture_size(size, MOST_SIDE)
    one_of("device", device, ("cpu", "gpu"))
    if device == "gpu":
        raise GpuError("device: the GPU path is not in this version; use device='cpu'")
    offsets, depth, alpha, color = _core.rasterize(
        joined(meshes), _seen(camera, width, height), width, height, thread_count(threads)
    )
    span = _transparent_range(meshes, camera)
    if span is not None:
        near, far = (float(np.float32(end)) for end in span)
        inside = np.clip(depth, near, far)
        # only rounding moves transparent ones; opaque ones may be anywhere
        depth = np.where(alpha == 1, inside, np.clip(depth, *_widened(near, far)))
        span = (min(near, float(depth.min(initial=near))), max(far, float(depth.max(initial=far))))
    return Fragments(
        offsets, depth, alpha, color, shape=(height, width), depth_range=span, dtype=np.float32
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


def screen_triangles(
    meshes: list[Mesh], camera: Camera, width: int, height: int, threads: int | None = None
) -> NDArray[Any]:
    """The triangles that `rasterize` draws, in draw order: (n,) SCREEN_TRIANGLE."""
    found = _core.screen_triangles(
        joined(meshes), _seen(camera, width, height), width, height, thread_count(threads)
    )
    return found.view(SCREEN_TRIANGLE)[:, 0]


def _seen(camera: Camera, width: int, height: int) -> tuple[Any, ...]:
    return (
        camera.eye,
        *(tuple(axis.tolist()) for axis in camera.axes),
        camera.scale((width, height)),
        camera.near,
        camera.far,
    )


def _transparent_range(meshes: list[Mesh], camera: Camera) -> tuple[float, float] | None:
    points = [
        mesh.vertices[np.unique(mesh.triangles[mesh.transparent])]
        for mesh in meshes
        if mesh.transparent.any()
    ]
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
