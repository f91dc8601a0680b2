"""Scenes of fire and smoke with grass before or in them, as MT's figures 1 and 3 have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.solids import box, lathe, moved, ribbons, sheet, soft_discs
from moit.scenes.scene_parts import MeshScene, ground, hue, puffs

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]


def blades(rng: Generator, low: Any, high: Any, count: int, tall: float, tone: float) -> Mesh:
    """Thin blades of grass between two corners of the ground; their tips fade."""
    t = np.linspace(0, 1, 7)
    fade = np.clip(1.7 - 1.6 * t, 0.1, 0.95)
    spots = rng.uniform(low, high, (count, 2))
    roots = np.stack([spots[:, 0], np.zeros(count), spots[:, 1]], axis=1)
    angle, bend, height, turn, value = rng.uniform(
        (0, 0.1, 0.6, 0.16, 0.5), (2 * np.pi, 0.5, 1.0, 0.28, 1.0), (count, 5)
    ).T
    lean = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1) * bend[:, None]
    rise = height[:, None] * [0, 1, 0]
    paths = roots[:, None] + tall * (t[:, None] * rise[:, None] + t[:, None] ** 2 * lean[:, None])
    tones = np.array([hue(one, 0.7, tone * light) for one, light in zip(turn, value, strict=True)])
    shades = tones[:, None] * (0.5 + 0.5 * t[:, None])
    across = np.broadcast_to(np.cross(lean, [0, 1, 0])[:, None], paths.shape)
    return ribbons(paths, across, 0.03 * tall + 0.008, shades, fade)


def flames(rng: Generator, camera: Camera, middles: Array, count: int) -> Mesh:
    """Particles that shine by themselves: yellow and bright below, red above."""
    centers = middles[rng.integers(0, len(middles), count)]
    rise = rng.exponential(0.5, count)
    centers = centers + rng.normal(0, 0.16, (count, 3)) + rise[:, None] * [0.08, 1, 0]
    heat = np.exp(-1.3 * rise)[:, None]
    colors = heat * np.array([2.2, 1.3, 0.35]) + (1 - heat) * np.array([0.9, 0.12, 0.02])
    radii = rng.uniform(0.1, 0.3, count) * (1 - 0.5 * np.exp(-rise))
    return soft_discs(centers, radii, colors, rng.uniform(0.15, 0.45, count), camera.axes)


def bottle(color: Any, label: Any) -> list[Mesh]:
    """A glass bottle of height 1 with a label that lets little through."""
    profile = (
        (0.0, 0.0), (0.15, 0.01), (0.17, 0.04), (0.17, 0.55), (0.13, 0.66), (0.06, 0.75),
        (0.055, 0.95), (0.065, 0.96), (0.065, 1.0),
    )  # fmt: skip
    angle = np.linspace(-1.1, 1.1, 24)
    height = np.linspace(0.18, 0.48, 10)
    around, up = np.meshgrid(angle, height)
    points = np.stack([0.173 * np.sin(around), up, 0.173 * np.cos(around)], axis=-1)
    stripe = np.abs(up - 0.33) < 0.05
    paint = np.where(stripe[..., None], np.asarray(label), np.array([0.85, 0.8, 0.65]))
    return [lathe(profile, color, 0.4, 40), sheet(points, paint, 0.85)]


def burning_house(rng: Generator) -> MeshScene:
    """A house on fire in dense smoke; before it grass and three bottles of glass."""
    camera = Camera((0.2, 0.75, 5.2), (0.0, 1.05, 0.0), fov_y=0.62, near=0.4, far=40.0)
    meshes = [ground(12.0, (0.10, 0.09, 0.06), (0.08, 0.07, 0.05), 24)]
    wall = (0.22, 0.12, 0.08)
    meshes.append(box((0, 0.55, -1.6), (2.6, 1.1, 1.6), wall, 1.0))
    roof = np.array([[[-1.5, 1.0, -0.7], [1.5, 1.0, -0.7]], [[-1.4, 1.9, -1.6], [1.4, 1.9, -1.6]]])
    meshes.append(sheet(roof, (0.10, 0.04, 0.03), 1.0))
    for x in (-0.8, 0.0, 0.8):
        meshes.append(box((x, 0.6, -0.79), (0.4, 0.5, 0.02), (1.6, 0.7, 0.15), 1.0))
    fire = rng.uniform((-1.4, 0.2, -1.6), (1.4, 1.6, -0.5), (26, 3))
    top = rng.uniform((-1.6, 1.2, -2.0), (1.8, 2.9, -0.4), (40, 3))
    drift = rng.uniform((-2.4, 0.1, -0.6), (2.4, 1.0, 0.9), (22, 3))
    meshes.append(flames(rng, camera, fire, 700))
    meshes.append(puffs(rng, camera, np.concatenate([top, drift]), 0.3, 1000, (0.03, 0.2)))
    meshes.append(blades(rng, (-2.2, 1.2), (2.2, 3.6), 1500, 0.42, 0.8))
    for x, z, turn, glass, label in (
        (-0.75, 2.6, 0.3, (0.05, 0.30, 0.08), (0.6, 0.08, 0.05)),
        (0.15, 2.9, -0.2, (0.35, 0.18, 0.04), (0.05, 0.12, 0.5)),
        (0.95, 2.4, -0.5, (0.45, 0.5, 0.5), (0.05, 0.35, 0.1)),
    ):
        meshes += [moved(part, (x, 0, z), 0.7, turn) for part in bottle(glass, label)]
    return MeshScene(meshes, camera, (0.03, 0.04, 0.07))


def grass_and_smoke(rng: Generator) -> MeshScene:
    """Grass seen from within dense smoke that is before it, in it and behind it."""
    camera = Camera((0, 0.9, 4.6), (0, 0.5, 0), fov_y=0.7, near=0.2, far=30.0)
    meshes = [ground(9.0, (0.16, 0.12, 0.07), (0.14, 0.10, 0.06), 18)]
    meshes.append(blades(rng, (-2.6, -3.0), (2.6, 2.4), 2200, 0.9, 0.9))
    near = rng.uniform((-1.4, 0.1, 1.0), (1.4, 1.5, 4.2), (50, 3))
    far = rng.uniform((-3.0, 0.1, -4.0), (3.0, 1.6, 1.0), (50, 3))
    meshes.append(puffs(rng, camera, np.concatenate([near, far]), 0.3, 700, (0.03, 0.16)))
    return MeshScene(meshes, camera, (0.5, 0.6, 0.75))
