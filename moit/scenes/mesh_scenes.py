"""Scenes of triangles: seeded, generated, with the camera they are meant to be seen from."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.solids import ball, lathe, moved, ribbon, ribbons, sheet, tube
from moit.scenes.cloud_scene import cloud_with_disk
from moit.scenes.fire_scenes import burning_house, grass_and_smoke
from moit.scenes.glass_scenes import chess, engine
from moit.scenes.pond_scene import pond
from moit.scenes.scene_parts import MeshScene, ground, hue, leaves, puffs, teapot

if TYPE_CHECKING:
    from numpy.random import Generator


POTS = 17


def teapots(rng: Generator) -> MeshScene:
    """Seventeen glass pots in a row that runs away from the eye, between curtains, in a hall."""
    meshes = [ground(16.0, (0.32, 0.28, 0.22), (0.16, 0.13, 0.10), 32)]
    for side in (-1, 1):
        for z in np.arange(-14, 5, 3.5):
            column = lathe(
                [(0.34, 0), (0.30, 0.3), (0.26, 3.6), (0.36, 4.0)], (0.5, 0.46, 0.4), 1.0, 20
            )
            meshes.append(moved(column, (side * 3.1, 0, z)))
    for side in (-1, 1):
        for i, z in enumerate((-10.5, -7.0, -3.5)):
            t, h = np.meshgrid(np.linspace(-1.2, 1.2, 60), np.linspace(3.6, 0.15, 24))
            fold = 0.12 * np.sin(9 * t + rng.uniform(0, 6)) * (1.15 - 0.25 * h)
            curtain = np.stack([side * 2.6 + fold, h, z + t], axis=-1)
            meshes.append(sheet(curtain, hue(0.02 + 0.33 * ((i + (side > 0)) % 3), 0.75), 0.45))
    order = rng.permutation(POTS)
    for i in order:
        turn = rng.uniform(0, 2 * np.pi)
        paint = hue(i * 0.381966 + 0.05, 0.75, 0.95)
        place = (0.12 * rng.normal(), 0, 2.2 - 0.95 * i)
        meshes += [moved(part, place, 0.9, turn) for part in teapot(paint, 0.3)]
    camera = Camera((0.85, 1.75, 5.9), (0.0, 0.55, 0.0), fov_y=0.62, near=0.5, far=60.0)
    return MeshScene(meshes, camera, (0.55, 0.62, 0.72))


def spheres_mesh(rng: Generator) -> MeshScene:
    """Three spheres that intersect; around them a depth range of some twelve radii."""
    turn = rng.uniform(0, 2 * np.pi)
    meshes = []
    for i, paint in enumerate(([0.80, 0.06, 0.04], [0.07, 0.55, 0.08], [0.06, 0.16, 0.85])):
        angle = turn + 2 * np.pi * i / 3
        center = (0.3 * np.cos(angle), 0.3 * np.sin(angle), -0.05 * i)
        meshes.append(ball(center, 0.5, paint, 0.6, 96))
    # a speck at either end of the range, as the figure's depth range is wider than the spheres
    for z in (1.4, -4.4):
        meshes.append(ball((0.9, 0.9, z), 0.004, (0.5, 0.5, 0.5), 0.5, 6))
    return MeshScene(meshes, Camera((0, 0, 2.0), fov_y=0.95, near=0.1, far=20.0), (0.8, 0.82, 0.85))


def foliage(rng: Generator) -> MeshScene:
    """Leaves on cards round a red glass pot: alpha goes from 0 to 1 within a pixel or two."""
    meshes = [ground(8.0, (0.30, 0.28, 0.24), (0.20, 0.18, 0.15), 16)]
    meshes += leaves(rng, 160, (-2.4, 0.1, -2.4), (2.4, 2.6, -1.0), 0.24)
    meshes += [moved(part, (0, 0, 0), 1.15, -0.4) for part in teapot((0.75, 0.03, 0.02), 0.55, 56)]
    meshes += leaves(rng, 14, (-1.7, 0.2, 1.2), (1.7, 0.7, 1.6), 0.2)
    camera = Camera((0.3, 1.35, 4.6), (0, 0.85, -0.4), fov_y=0.65, near=0.3, far=30.0)
    return MeshScene(meshes, camera, (0.70, 0.78, 0.9))


def smoke(rng: Generator) -> MeshScene:
    """Columns of smoke from three chimneys, of particles that are drawn in no order."""
    camera = Camera((0, 1.6, 6.5), (0, 1.3, 0), fov_y=0.62, near=0.5, far=30.0)
    meshes = [ground(10.0, (0.28, 0.27, 0.25), (0.2, 0.19, 0.18), 20)]
    middles = []
    for x, z, lean in ((-1.3, -0.6, 0.5), (0.1, 0.4, 0.15), (1.3, -1.0, -0.3)):
        chimney = lathe([(0.22, 0), (0.19, 0.5), (0.21, 0.55)], (0.45, 0.18, 0.12), 1.0, 24)
        meshes.append(moved(chimney, (x, 0, z)))
        t = np.linspace(0, 1, 9)
        middles.append(np.stack([x + lean * t**1.5, 0.6 + 2.0 * t, z + 0.2 * np.sin(4 * t)], 1))
    meshes.append(
        puffs(rng, camera, np.concatenate(middles), (0.16, 0.12, 0.16), 700, (0.05, 0.22))
    )
    return MeshScene(meshes, camera, (0.45, 0.58, 0.78))


BLADES = 2600


def grass(rng: Generator) -> MeshScene:
    """A meadow of thin blades whose tips fade."""
    meshes = [ground(9.0, (0.16, 0.12, 0.07), (0.14, 0.10, 0.06), 18)]
    t = np.linspace(0, 1, 7)
    fade = np.clip(1.6 - 1.6 * t, 0.05, 0.9)
    roots = np.stack(
        [rng.uniform(-3.2, 3.2, BLADES), np.zeros(BLADES), rng.uniform(-4.5, 2.6, BLADES)], axis=1
    )
    angle, bend, height, turn, value = rng.uniform(
        (0, 0.1, 0.45, 0.18, 0.4), (2 * np.pi, 0.5, 0.95, 0.31, 0.85), (BLADES, 5)
    ).T
    lean = np.stack([np.cos(angle), np.zeros(BLADES), np.sin(angle)], axis=1) * bend[:, None]
    rise = height[:, None] * [0, 1, 0]
    paths = roots[:, None] + t[:, None] * rise[:, None] + t[:, None] ** 2 * lean[:, None]
    tones = np.array([hue(*paint) for paint in zip(turn, [0.75] * BLADES, value, strict=True)])
    shades = tones[:, None] * (0.45 + 0.55 * t[:, None])
    across = np.broadcast_to(np.cross(lean, [0, 1, 0])[:, None], paths.shape)
    meshes.append(ribbons(paths, across, 0.045, shades, fade))
    camera = Camera((0, 1.15, 4.4), (0, 0.45, 0), fov_y=0.7, near=0.3, far=30.0)
    return MeshScene(meshes, camera, (0.5, 0.65, 0.85))


def strands(rng: Generator) -> MeshScene:
    """Hair: locks of thin ribbons that hang from a bar and curl."""
    meshes = [tube([(-1.6, 2.02, 0), (0, 2.05, 0), (1.6, 2.02, 0)], 0.06, (0.2, 0.15, 0.1), 1.0)]
    t = np.linspace(0, 1, 28)
    camera = Camera((0, 1.0, 4.6), (0, 1.0, 0), fov_y=0.6, near=0.3, far=20.0)
    for lock in range(9):
        x, z = 0.36 * (lock - 4), 0.15 * rng.normal()
        phase, curl = rng.uniform(0, 6.28), rng.uniform(0.08, 0.2)
        for _ in range(70):
            dx, dz = rng.normal(0, 0.055, 2)
            own = phase + rng.normal(0, 0.3)
            path = np.stack(
                [
                    x + dx * (1 + t) + curl * t * np.sin(7 * t + own),
                    2.0 - 1.95 * t,
                    z + dz * (1 + t) + curl * t * np.cos(7 * t + own),
                ],
                axis=1,
            )
            tone = np.array([0.42, 0.20, 0.08]) * rng.uniform(0.5, 1.5)
            across = np.broadcast_to(camera.axes[0], (len(t), 3))
            meshes.append(ribbon(path, across, 0.012, tone, 0.45))
    return MeshScene(meshes, camera, (0.75, 0.78, 0.82))


def ship_like(rng: Generator) -> MeshScene:
    """A glass ship with masts, sails and rigging, in clouds of smoke."""
    return _ship(rng, 26, 6, 620)


def ship_in_clouds(rng: Generator) -> MeshScene:
    """The same ship in clouds of several times as many particles. MBOIT, figures 1 and 5."""
    return _ship(rng, 60, 24, 2600)


def _ship(rng: Generator, clouds: int, high: int, particles: int) -> MeshScene:
    meshes = [ground(20.0, (0.06, 0.14, 0.20), (0.05, 0.11, 0.17), 40, -0.02)]
    meshes += _hull() + _masts()
    camera = Camera((3.6, 2.3, 6.2), (-0.1, 1.35, 0), fov_y=0.7, near=0.5, far=60.0)
    middles = rng.uniform((-3.0, 0.2, -1.6), (3.0, 0.9, 1.6), (clouds, 3))
    middles[:high, 1] += 1.2
    meshes.append(puffs(rng, camera, middles, (0.35, 0.2, 0.35), particles, (0.04, 0.16)))
    return MeshScene(meshes, camera, (0.62, 0.68, 0.75))


WOOD, PLANKS, TIMBER, ROPE = (
    (0.40, 0.22, 0.09),
    (0.55, 0.30, 0.12),
    (0.30, 0.15, 0.06),
    (0.12, 0.08, 0.05),
)


def _hull() -> list[Mesh]:
    along = np.linspace(-1, 1, 60)
    beam = 0.62 * (1 - np.abs(along) ** 2.6) ** 0.5 * np.clip(1.6 - 1.6 * along, 0, 1) ** 0.6
    keel = 0.02 + 0.25 * np.abs(along) ** 4 + 0.5 * np.clip(along, 0, 1) ** 7
    deck = 0.75 + 0.35 * along**2
    angle = np.linspace(-np.pi / 2, np.pi / 2, 25)
    x = np.broadcast_to(2.4 * along[:, None], (60, 25))
    y = deck[:, None] - (deck - keel)[:, None] * np.cos(angle) ** 0.75
    z = beam[:, None] * np.sin(angle)
    parts = [sheet(np.stack([x, y, z], axis=-1), PLANKS, 0.5)]
    floor = np.stack(
        [
            np.broadcast_to(2.35 * along[:, None], (60, 2)),
            np.broadcast_to(deck[:, None] - 0.12, (60, 2)),
            0.93 * beam[:, None] * np.array([-1, 1]),
        ],
        axis=-1,
    )
    parts.append(sheet(floor, (0.62, 0.42, 0.2), 0.6))
    for i in range(4, 56, 4):
        parts.append(tube(np.stack([x[i], y[i], z[i]], axis=1), 0.025, TIMBER, 0.8, 6))
    for side in (0, -1):
        rail = np.stack([x[:, side], y[:, side] + 0.02, z[:, side]], axis=1)
        parts.append(tube(rail[1:-1], 0.03, PLANKS, 0.8, 8))
    bowsprit = [(2.3, 1.05, 0), (2.9, 1.3, 0), (3.4, 1.5, 0)]
    parts.append(tube(bowsprit, (0.05, 0.04, 0.02), PLANKS, 0.9, 8))
    return parts


def _masts() -> list[Mesh]:
    parts = []
    for x, height in ((-1.35, 2.5), (0.05, 3.1), (1.35, 2.6)):
        mast = [(x, 0.6, 0), (x, 1.9, 0), (x, height + 0.5, 0)]
        parts.append(tube(mast, (0.06, 0.05, 0.02), WOOD, 0.9, 10))
        for level, width in ((0.45, 1.0), (0.72, 0.8), (0.93, 0.55)):
            y = 0.5 + height * level
            parts.append(tube([(x, y, -width), (x, y, 0), (x, y, width)], 0.025, WOOD, 0.9, 6))
            parts.append(_sail(x, y, width, 0.24 * height))
        parts += _shrouds(x, 0.5 + 0.9 * height)
    tops = np.array([(3.4, 1.5, 0), (1.35, 3.0, 0), (0.05, 3.5, 0), (-1.35, 2.9, 0)])
    for low, high in pairwise(tops):
        parts.append(tube(np.linspace(low, high, 8), 0.008, ROPE, 0.9, 5))
    return parts


def _sail(x: float, y: float, width: float, drop: float) -> Mesh:
    u, v = np.meshgrid(np.linspace(-1, 1, 18), np.linspace(0, 1, 14))
    belly = 0.32 * (1 - u**2) * np.sin(np.pi * v) ** 0.8
    cloth = np.stack([x + 0.03 + belly, y - drop * v, width * (1 - 0.08 * v) * u], axis=-1)
    return sheet(cloth, (0.85, 0.8, 0.68), 0.55)


def _shrouds(x: float, top: float) -> list[Mesh]:
    """Ropes from both rails to a mast, with rungs."""
    parts = []
    feet = np.linspace(-0.45, 0.45, 5)
    for side in (-1, 1):
        low, high = np.array([x, 0.85, 0.55 * side]), np.array([x, top, 0])
        for foot in feet:
            rope = np.linspace(low + np.array([foot, 0, 0]), high, 6)
            parts.append(tube(rope, 0.008, ROPE, 0.9, 5))
        for share in np.linspace(0.15, 0.85, 9):
            middle = low + share * (high - low)
            rung = middle + (1 - share) * feet[[0, 2, 4], None] * np.array([1, 0, 0])
            parts.append(tube(rung, 0.005, ROPE, 0.9, 4))
    return parts


MESH_SCENES: dict[str, Callable[[Generator], MeshScene]] = {
    "teapots": teapots,
    "spheres-mesh": spheres_mesh,
    "foliage": foliage,
    "smoke": smoke,
    "grass": grass,
    "strands": strands,
    "ship-like": ship_like,
    "ship-in-clouds": ship_in_clouds,
    "burning-house": burning_house,
    "grass-and-smoke": grass_and_smoke,
    "engine": engine,
    "chess": chess,
    "pond": pond,
    "cloud-with-disk": cloud_with_disk,
}
