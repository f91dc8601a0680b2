"""What scenes of triangles share: pots, ground, leaves, particles; and what such a scene is."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera, Vector
from moit.geometry.meshes import Mesh
from moit.geometry.solids import lathe, sheet, soft_discs, tube

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True)
class MeshScene:
    """Meshes in draw order, a camera, and linear radiance behind everything."""

    meshes: Sequence[Mesh]
    camera: Camera
    background: Vector = (0.0, 0.0, 0.0)


# Radii and heights of a pot of unit size, after the proportions of Newell's teapot, 1975.
BODY = (
    (0.0, 0.0), (0.30, 0.005), (0.47, 0.02), (0.50, 0.06), (0.58, 0.14), (0.67, 0.26),
    (0.72, 0.40), (0.72, 0.50), (0.69, 0.62), (0.63, 0.75), (0.56, 0.86), (0.51, 0.93),
    (0.49, 0.955), (0.47, 0.95), (0.46, 0.93),
)  # fmt: skip
LID = (
    (0.46, 0.93), (0.40, 0.965), (0.28, 1.00), (0.14, 1.03), (0.07, 1.05), (0.06, 1.08),
    (0.10, 1.13), (0.11, 1.16), (0.08, 1.19), (0.0, 1.205),
)  # fmt: skip


def teapot(color: Any, alpha: float, detail: int = 40) -> list[Mesh]:
    """A pot of radius .72 on the ground, its spout to the right: body, lid, spout and handle."""
    t = np.linspace(0, 1, detail // 2)
    spout = np.stack([0.58 + 0.55 * t + 0.10 * t**3, 0.30 + 0.62 * t**1.7, 0 * t], axis=1)
    wide = 0.17 - 0.11 * t + 0.03 * t**6
    bend = np.pi * (0.06 + 0.88 * t)
    handle = np.stack(
        [-0.60 - 0.46 * np.sin(bend) ** 0.8, 0.53 + 0.30 * np.cos(bend), 0 * t], axis=1
    )
    return [
        lathe(smooth(BODY, detail), color, alpha, detail),
        lathe(smooth(LID, detail // 2), color, alpha, detail),
        tube(spout, wide, color, alpha, detail // 2),
        tube(handle, 0.055, color, alpha, detail // 3),
    ]


def smooth(profile: Any, count: int) -> Array:
    """More points on a smooth line through a profile's (Catmull and Rom 1974)."""
    p = np.asarray(profile, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    at = np.linspace(0, len(p) - 3 - 1e-9, count)
    i = at.astype(int)
    t = (at - i)[:, None]
    a, b, c, d = (p[i + k] for k in range(4))
    line = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    return np.asarray(np.maximum(line, [0, -1]))


def ground(size: float, near: Any, far: Any, tiles: int = 24, height: float = 0.0) -> Mesh:
    """A chequered opaque square at the origin."""
    side = np.linspace(-size, size, tiles + 1)
    x, z = np.meshgrid(side, side)
    whole = np.stack([x, np.full_like(x, height), z], axis=-1)
    quads = np.stack([whole[:-1, :-1], whole[:-1, 1:], whole[1:, :-1], whole[1:, 1:]], axis=2)
    even = (np.arange(tiles)[:, None] + np.arange(tiles)) % 2
    color = np.where(even[..., None, None], np.asarray(near), np.asarray(far))
    first = np.arange(tiles * tiles)[:, None] * 4
    return Mesh(
        quads.reshape(-1, 3),
        np.concatenate([first + np.array([0, 1, 2]), first + np.array([1, 3, 2])]),
        np.broadcast_to(color, (tiles, tiles, 4, 3)).reshape(-1, 3),
        1.0,
        np.tile([0.0, 1.0, 0.0], (tiles * tiles * 4, 1)),
    )


def hue(turn: float, saturation: float = 0.8, value: float = 0.9) -> Array:
    """Linear colour of a hue in turns, red first."""
    wheel = np.clip(np.abs((turn + np.array([0, 2, 1]) / 3) % 1 * 6 - 3) - 1, 0, 1)
    return np.asarray((value * (1 - saturation * (1 - wheel))) ** 2.2)


def leaves(rng: Generator, count: int, low: Any, high: Any, size: float) -> list[Mesh]:
    """Leaves as cards: opaque in the middle, a soft edge, and all but clear outside it."""
    u, v = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13))
    half = 0.5 * (1 - v**2) * (1 + 0.35 * v)
    inside = np.clip((half - np.abs(u)) / 0.14 + 0.5, 0, 1)
    made = []
    for _ in range(count):
        yaw, pitch, roll = rng.uniform(-0.9, 0.9), rng.uniform(-0.7, 0.7), rng.uniform(-1.2, 1.2)
        right = np.array([np.cos(yaw), 0.0, np.sin(yaw)])
        up = np.array([-np.sin(yaw) * np.sin(pitch), np.cos(pitch), np.cos(yaw) * np.sin(pitch)])
        right, up = (
            np.cos(roll) * right + np.sin(roll) * up,
            np.cos(roll) * up - np.sin(roll) * right,
        )
        middle = rng.uniform(low, high)
        curl = 0.15 * size * (u**2 - 0.3 * v**2)[..., None] * np.cross(right, up)
        card = middle + size * (u[..., None] * right + v[..., None] * up) + curl
        green = hue(rng.uniform(0.20, 0.33), 0.8, rng.uniform(0.45, 0.8))
        vein = 1 - 0.35 * np.exp(-((u / 0.05) ** 2))
        made.append(sheet(card, green * vein[..., None], inside))
    return made


def puffs(
    rng: Generator,
    camera: Camera,
    middles: Array,
    spread: Any,
    count: int,
    alpha: tuple[float, float],
) -> Mesh:
    """Particles round some middles, lit from above."""
    centers = middles[rng.integers(0, len(middles), count)] + rng.normal(0, spread, (count, 3))
    radii = rng.uniform(0.15, 0.45, count)
    top, bottom = centers[:, 1].max(), centers[:, 1].min()
    lit = ((centers[:, 1] - bottom) / (top - bottom))[:, None] ** 0.8
    colors = lit * np.array([1.0, 0.96, 0.9]) + (1 - lit) * np.array([0.16, 0.18, 0.23])
    return soft_discs(centers, radii, colors, rng.uniform(*alpha, count), camera.axes)
