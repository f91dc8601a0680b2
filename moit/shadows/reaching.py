"""What of a picture's lights reaches its fragments."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.geometry.camera import Camera
from moit.geometry.drawing import Shares
from moit.geometry.light import Light
from moit.geometry.meshes import Mesh
from moit.shadows.shadow_map import ShadowMap
from moit.system.progress import Steps

Array = NDArray[Any]


def lacks_map(light: Any) -> bool:
    """Whether a light names the technique of a map, which is still to be made."""
    return isinstance(light, Light) and isinstance(light.shadows, str | Technique)


def with_maps(
    lights: Sequence[Any], parts: Sequence[Any], threads: int | None, done: Steps
) -> list[Any]:
    """The same lights; those that name a technique have a map by it of the meshes
    among these parts of a scene.

    done : called after each map.
    """
    meshes = [part for part in parts if isinstance(part, Mesh)]
    found = []
    for i, light in enumerate(lights):
        if lacks_map(light):
            done.now(f"the shadow map of light {i + 1}")
            shadows = ShadowMap(
                meshes, light.shadows, light=light.direction, threads=threads, progress=False
            )
            light = dataclasses.replace(light, shadows=shadows)
            done(f"the shadow map of light {i + 1}")
        found.append(light)
    return found


def reached(
    lights: Sequence[Any], points: Array, alpha: Array, threads: int | None
) -> NDArray[np.float64]:
    """(N, lights): the share of each that comes to points (N, 3) of surfaces of these opacities.

    lights : as `with_maps` gives them.
    """
    shares = np.ones((len(points), len(lights)))
    for k, light in enumerate(lights):
        if not isinstance(light, Light) or not isinstance(light.shadows, ShadowMap):
            continue
        own = alpha if light.shadows.technique.excludes_self else None
        shares[:, k] = light.shadows.transmittance(points, own, threads=threads)
    return shares


def reached_in_picture(
    lights: Sequence[Any], camera: Camera, size: tuple[int, int], threads: int
) -> Shares:
    """What a Frame asks of a picture's fragments."""

    def shares(offsets: Array, depth: Array, alpha: Array) -> NDArray[np.float64]:
        pixel = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        points = points_of_pixels(pixel, depth, camera, *size)
        return reached(lights, points, alpha, threads)

    return shares


def points_of_pixels(
    pixel: NDArray[np.int64], depth: Array, camera: Camera, width: int, height: int
) -> NDArray[np.float64]:
    """(N, 3): what middles of pixels (N,) show at depths (N,), in the scene."""
    scale_x, scale_y = camera.scale((width, height))
    z = depth.astype(np.float64)
    x = ((pixel % width + 0.5) * (2 / width) - 1) / scale_x * z
    y = (1 - (pixel // width + 0.5) * (2 / height)) / scale_y * z
    right, up, forward = camera.axes
    return np.asarray(
        np.array(camera.eye) + x[:, None] * right + y[:, None] * up + z[:, None] * forward
    )
