"""Meshes to fragments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.windows import picture_size
from moit.engines import gpu_of
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera, vector
from moit.geometry.light import Light
from moit.geometry.meshes import Mesh, Meshes, bounding_sphere, joined, meshes_of
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu.device import Device

Lights = Sequence[Light | tuple[ArrayLike, ArrayLike]]

MOST_SIDE = _core.numbers()["MOST_SIDE"]
MOST_LIGHTS = _core.numbers()["MOST_LIGHTS"]


def rasterize(
    scene: Meshes,
    camera: Camera,
    size: tuple[int, int],
    *,
    lights: Lights = (),
    device: str | Device = "cpu",
    threads: int | None = None,
) -> Fragments:
    """The fragments of a picture of triangles: float32, in draw order.

    scene : a Mesh, or several in the order in which they are drawn.
    size : (width, height), each from 1 to 16,384.

    lights : up to eight `moit.Light`, or pairs of where a light from far away travels, (3,) not 0,
        and its linear colour, (3,) not negative. Colour 1 is as bright as the light there is
        without any: white, from the upper left behind the eye. A quarter of it comes from
        everywhere, whatever shines; a Light's shadows take nothing of that.
    device : "cpu", "gpu", or a moit.gpu.Device; the result is the same but for what a GPU divides
        and takes roots of less exactly.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors.

    One fragment for each pixel whose middle a triangle covers, seen from either side; of an edge
    that two triangles share, one of them has what lies on it (the top-left rule, on vertices
    snapped to 1/256 pixel as GPUs do). Attributes are interpolated perspective-correctly; colour
    is lit by Lambert's law on both sides. Depth is the
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
    shining = light_numbers(lights, camera)
    chosen = gpu_of(device)
    lights = with_shadows(lights, meshes, threads)
    if chosen is not None:
        from moit.gpu.meshes import rasterized

        arrays = rasterized(chosen, meshes, camera, width, height, shining, threads, lights)
    else:
        seen = _seen(camera, width, height)
        drawn = (joined(meshes), seen, width, height, thread_count(threads), shining)
        arrays = _core.rasterize(*drawn)
        if throw_shadows(lights):
            from moit.shadows.reaching import points_of_pixels, reached

            offsets, depth, alpha, _ = arrays
            pixel = np.repeat(np.arange(width * height), np.diff(offsets))
            points = points_of_pixels(pixel, depth, camera, width, height)
            arrays = _core.rasterize(*drawn, reached(lights, points, alpha, threads))
    offsets, depth, alpha, color = arrays
    span = transparent_range(meshes, camera)
    if span is not None:
        near, far = (float(np.float32(end)) for end in span)
        inside = np.clip(depth, near, far)
        # only rounding moves transparent ones; opaque ones may be anywhere
        depth = np.where(alpha == 1, inside, np.clip(depth, *_widened(near, far)))
        span = (min(near, float(depth.min(initial=near))), max(far, float(depth.max(initial=far))))
    return Fragments(
        offsets, depth, alpha, color, shape=(height, width), depth_range=span, dtype=np.float32
    )


def throw_shadows(lights: Lights) -> bool:
    return any(isinstance(light, Light) and light.shadows is not None for light in lights)


def with_shadows(lights: Lights, meshes: list[Mesh], threads: int | None) -> Lights:
    """The same lights, those that throw shadows with maps of these meshes or their own."""
    if not throw_shadows(lights):
        return lights
    from moit.shadows.reaching import with_maps

    return with_maps(lights, meshes, threads)


def light_numbers(lights: Lights, camera: Camera) -> NDArray[np.float64]:
    """(n, 6): where each light travels as the camera sees it, of length 1, and its colour."""
    if isinstance(lights, str | bytes) or not isinstance(lights, Sequence):
        raise TypeError(f"lights: expected a sequence, got {type(lights).__name__}")
    if len(lights) > MOST_LIGHTS:
        raise ValueError(f"lights: expected at most {MOST_LIGHTS}, got {len(lights)}")
    rows = np.zeros((len(lights), 6))
    for i, light in enumerate(lights):
        try:
            direction, color = (light.direction, light.color) if isinstance(light, Light) else light
        except (TypeError, ValueError):
            raise TypeError(
                f"lights[{i}]: expected a direction and a colour, got {light!r:.80}"
            ) from None
        travels = np.array(vector(direction, f"lights[{i}][0]"))
        length = float(np.linalg.norm(travels))
        if not length > 0:
            raise ValueError(f"lights[{i}][0]: expected a direction that is not 0")
        rows[i, :3] = camera.axes @ (travels / length)
        rows[i, 3:] = vector(color, f"lights[{i}][1]")
        if (rows[i, 3:] < 0).any():
            raise ValueError(f"lights[{i}][1]: expected numbers that are not negative")
    return rows


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


def transparent_range(meshes: list[Mesh], camera: Camera) -> tuple[float, float] | None:
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
