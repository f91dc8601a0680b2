"""A pond in fog: water that reflects by Fresnel's equations, leaves and plants (WBOIT's post)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.solids import ball, sheet, tube
from moit.scenes.fire_scenes import blades
from moit.scenes.scene_parts import MeshScene, ground, leaves

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]

EYE = np.array([0.4, 1.5, 6.0])
WATER = 1.33


def pond(rng: Generator) -> MeshScene:
    """Fog, leaves and water plants go through one another: no order of triangles is right."""
    camera = Camera((0.4, 1.5, 6.0), (0, 0.75, 0), fov_y=0.66, near=0.4, far=40.0)
    meshes = [ground(14.0, (0.10, 0.09, 0.05), (0.08, 0.07, 0.04), 28, -0.5)]
    for x, z in rng.uniform((-2.6, -2.4), (2.6, 2.4), (26, 2)):
        stone = rng.uniform(0.1, 0.3)
        meshes.append(ball((x, -0.45, z), stone, (0.25, 0.23, 0.2), 1.0, 14))
    meshes.append(_shore())
    for x, z in ((-2.3, -2.0), (2.4, -1.6)):
        trunk = [(x, -0.2, z), (x + 0.1, 1.2, z), (x - 0.05, 2.6, z)]
        meshes.append(tube(trunk, (0.16, 0.12, 0.06), (0.14, 0.09, 0.05), 1.0, 12))
        meshes += leaves(rng, 70, (x - 0.9, 1.3, z - 0.7), (x + 1.0, 2.9, z + 0.9), 0.2)
    meshes.append(_water(rng))
    meshes += _lilies(rng)
    for side in (-1, 1):
        low, high = sorted((side * 2.4, side * 4.0))
        meshes.append(blades(rng, (low, -2.5), (high, 3.0), 450, 0.8, 0.7))
    meshes += [_fog(rng, z) for z in rng.permutation(np.linspace(-3.2, 3.2, 9))]
    return MeshScene(meshes, camera, (0.62, 0.70, 0.74))


def _shore() -> Mesh:
    """A ring of earth that rises out of the water."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    rings = []
    for share, height in ((0.8, -0.4), (1.0, 0.02), (1.3, 0.15), (2.6, 0.2)):
        x, z = 2.6 * share * np.cos(angle), 2.5 * share * np.sin(angle)
        rings.append(np.stack([x, np.full(60, height), z], axis=1))
    return sheet(np.stack(rings), (0.13, 0.13, 0.06), 1.0, closed=True)


def _water(rng: Generator) -> Mesh:
    side = np.linspace(-2.7, 2.7, 70)
    x, z = np.meshgrid(side, side)
    wave = np.zeros_like(x)
    slope = np.zeros((*x.shape, 2))
    for _ in range(6):
        k = rng.normal(0, 4, 2)
        phase = rng.uniform(0, 2 * np.pi)
        wave += 0.006 * np.sin(k[0] * x + k[1] * z + phase)
        slope += 0.006 * np.cos(k[0] * x + k[1] * z + phase)[..., None] * k
    points = np.stack([x, wave, z], axis=-1)
    normal = np.stack([-slope[..., 0], np.ones_like(x), -slope[..., 1]], axis=-1)
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    to_eye = EYE - points
    to_eye = to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    mirrored = fresnel(np.clip((normal * to_eye).sum(axis=-1), 0, 1))
    alpha = np.clip(0.22 + mirrored, 0, 0.95)
    deep, sky = np.array([0.03, 0.10, 0.09]), np.array([0.62, 0.70, 0.74])
    color = deep + (mirrored / alpha)[..., None] * (sky - deep)
    return sheet(points, color, alpha)


def fresnel(cosine: Array) -> Array:
    """The share of unpolarised light that water reflects (Fresnel's equations)."""
    inside = np.sqrt(1 - (1 - cosine**2) / WATER**2)
    across = (cosine - WATER * inside) / (cosine + WATER * inside)
    along = (inside - WATER * cosine) / (inside + WATER * cosine)
    return np.asarray(0.5 * (across**2 + along**2))


def _lilies(rng: Generator) -> list[Mesh]:
    """Leaves on the water with soft edges, and stems below it."""
    made = []
    r, angle = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0.35, 2 * np.pi - 0.35, 30))
    for x, z in rng.uniform((-1.9, -1.5), (1.9, 2.0), (22, 2)):
        size, turn = rng.uniform(0.14, 0.32), rng.uniform(0, 2 * np.pi)
        rim = 0.03 * r**3
        points = np.stack(
            [x + size * r * np.cos(angle + turn), 0.004 + rim, z + size * r * np.sin(angle + turn)],
            axis=-1,
        )
        green = np.array([0.06, 0.22, 0.05]) * rng.uniform(0.7, 1.5)
        made.append(sheet(points, green, np.clip(6 - 6 * r, 0, 0.97)))
        bottom = (x + 0.2 * rng.normal(), -0.5, z + 0.2 * rng.normal())
        made.append(tube([(x, 0, z), (x, -0.2, z), bottom], 0.015, (0.10, 0.2, 0.06), 0.8, 6))
    return made


def _fog(rng: Generator, z: float) -> Mesh:
    """A large upright sheet whose opacity is smooth noise, thicker near the water."""
    rows, columns = 26, 60
    y, x = np.meshgrid(np.linspace(-0.1, 2.4, rows), np.linspace(-5, 5, columns), indexing="ij")
    noise = np.zeros((rows, columns))
    for octave in range(4):
        cells = (3 * 2**octave + 2, 5 * 2**octave + 2)
        noise += 0.5**octave * _smoothed(rng.random(cells), rows, columns)
    thick = np.clip(noise / 1.9 - 0.28, 0, 1) * np.exp(-((y / 1.1) ** 2))
    edge = np.clip(1 - np.abs(x) / 5, 0, 1) ** 0.5 * np.clip((y + 0.1) / 0.2, 0, 1)
    depth = z + 0.25 * np.sin(0.8 * x + z)
    points = np.stack([x, y, depth], axis=-1)
    return sheet(points, (0.75, 0.79, 0.82), np.clip(0.9 * thick * edge, 0, 0.5))


def _smoothed(cells: Array, rows: int, columns: int) -> Array:
    """Numbers on a grid, smoothly interpolated (Perlin 1985)."""

    def along(count: int, size: int) -> tuple[NDArray[np.intp], Array]:
        at = np.linspace(0, size - 1 - 1e-9, count)
        first = at.astype(np.intp)
        t = at - first
        return first, t * t * (3 - 2 * t)

    i, s = along(rows, cells.shape[0])
    j, t = along(columns, cells.shape[1])
    left = cells[i][:, j] * (1 - s)[:, None] + cells[i + 1][:, j] * s[:, None]
    right = cells[i][:, j + 1] * (1 - s)[:, None] + cells[i + 1][:, j + 1] * s[:, None]
    return np.asarray(left * (1 - t) + right * t)
