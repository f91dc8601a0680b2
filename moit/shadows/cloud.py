"""The scene "cloud" as triangles, to be lit: particles round a red disk. MBOIT, fig. 9.

Particles face whoever looks, a light or an eye, so that there are meshes for each. The scene's
camera looks along +z from the origin; here it is at (0, 0, 4) and looks along -z, as cameras do.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.geometry.camera import Camera, vector
from moit.geometry.meshes import Mesh
from moit.geometry.solids import soft_discs
from moit.scenes import formulas as scenes
from moit.scenes.shapes import FOCAL

Array = NDArray[Any]

AWAY = 4.0
SUN = (0.25, -1.0, -0.35)  # where light travels
WHITE, RED = (0.9, 0.9, 0.9), (0.85, 0.03, 0.02)


def camera() -> Camera:
    """Sees what the scene "cloud" shows."""
    return Camera(
        (0.0, 0.0, AWAY), (0.0, 0.0, 0.0), fov_y=2 * math.atan(1 / FOCAL), near=0.5, far=20.0
    )


def meshes(toward: ArrayLike, seed: int = 0) -> list[Mesh]:
    """The disk, and particles that face light or sight which travels toward (3,)."""
    forward = np.array(vector(toward, "toward"))
    forward = forward / np.linalg.norm(forward)
    up = np.eye(3)[1] if abs(forward[1]) < 0.9 else np.eye(3)[2]
    right = np.cross(forward, up)
    right = right / np.linalg.norm(right)
    axes = np.array([right, np.cross(right, forward), forward])
    centers, radii, alphas = scenes.cloud_particles(np.random.default_rng(seed))
    colors = np.broadcast_to(np.array(WHITE), (len(radii), 3))
    return [disk(), soft_discs(turned(centers), radii, colors, alphas, axes)]


def disk(segments: int = 64) -> Mesh:
    """The red one, of 94 % opacity."""
    right, up = (turned(axis, 0.0) for axis in scenes.disk_axes())
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rim = np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * up
    points = turned(np.array(scenes.DISK)) + scenes.DISK_RADIUS * np.vstack([np.zeros(3), rim])
    i = np.arange(segments)
    fan = np.stack([np.zeros_like(i), 1 + i, 1 + (i + 1) % segments], axis=1)
    return Mesh(points, fan, RED, scenes.DISK_ALPHA)


def turned(points: Array, away: float = AWAY) -> Array:
    """From the scene's coordinates, where z is away from the eye."""
    return np.asarray(points * [1, 1, -1] + np.array([0, 0, away]))


def through_disk(count: int, reach: float, seed: int = 0) -> tuple[Array, Array]:
    """Points (count, 3) on rays of SUN through the disk, within `reach` of it, and how far behind
    it they are (count,)."""
    rng = np.random.default_rng(seed)
    radius = 0.85 * scenes.DISK_RADIUS * np.sqrt(rng.random(count))
    angle = rng.uniform(0, 2 * np.pi, count)
    right, up = (turned(axis, 0.0) for axis in scenes.disk_axes())
    on = turned(np.array(scenes.DISK)) + radius[:, None] * (
        np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * up
    )
    behind = rng.uniform(-reach, reach, count)
    sun = np.array(SUN) / np.linalg.norm(SUN)
    return on + behind[:, None] * sun, behind
