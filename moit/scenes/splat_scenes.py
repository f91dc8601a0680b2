"""Scenes of Gaussian splats, made of our own pots and of formulas: as files of captured scenes are
made, without any."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera, Vector
from moit.geometry.splats import OF_DEGREE_0, Splats
from moit.scenes.scene_parts import teapot

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True)
class SplatScene:
    """Splats in the order of their rows, a camera, and what is behind everything."""

    splats: Splats
    camera: Camera
    background: Vector = (0.0, 0.0, 0.0)


def pot(rng: Generator, count: int) -> SplatScene:
    """A pot of discs that lie on its surface, on discs of the ground, most of them nearly opaque,
    with a gloss that depends on the view."""
    meshes = teapot((0.75, 0.32, 0.14), 1.0)
    corners = np.concatenate([mesh.points[mesh.triangles] for mesh in meshes]).astype(np.float64)
    on_pot = round(0.7 * count)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    which = rng.choice(len(area), on_pot, p=area / area.sum())
    share = np.sqrt(rng.random(on_pot))[:, None], rng.random(on_pot)[:, None]
    a, b, c = corners[which].transpose(1, 0, 2)
    places = (1 - share[0]) * a + share[0] * ((1 - share[1]) * b + share[1] * c)
    normals = cross[which] / np.maximum(2 * area[which, None], 1e-12)
    ground = np.stack(
        [
            rng.uniform(-2, 2, count - on_pot),
            np.zeros(count - on_pot),
            rng.uniform(-2, 2, count - on_pot),
        ],
        axis=1,
    )
    means = np.concatenate([places, ground])
    normals = np.concatenate([normals, np.broadcast_to((0.0, 1.0, 0.0), ground.shape)])
    # as wide as what each has to cover, and a tenth as thick
    wide = np.concatenate(
        [
            np.full(on_pot, np.sqrt(area.sum() / on_pot)),
            np.full(len(ground), np.sqrt(16 / max(len(ground), 1))),
        ]
    ) * rng.uniform(0.5, 1.1, count)
    squares = (np.floor(2 * ground[:, 0]) + np.floor(2 * ground[:, 2])) % 2
    tone = np.concatenate(
        [
            np.array([0.62, 0.27, 0.11]) * (0.75 + 0.35 * normals[:on_pot, 1:2]),
            np.where(squares[:, None] > 0, (0.55, 0.57, 0.6), (0.32, 0.34, 0.38)),
        ]
    )
    sh = np.zeros((count, 4, 3))
    sh[:, 0] = (tone * rng.uniform(0.85, 1.15, (count, 1)) - 0.5) / OF_DEGREE_0
    gloss = np.where(np.arange(count) < on_pot, 0.25, 0.0)[:, None]
    for k, axis in ((1, 1), (2, 2), (3, 0)):
        sh[:, k] = (-gloss if k == 2 else gloss) * normals[:, axis : axis + 1]
    splats = Splats(
        means,
        wide[:, None] * (1, 1, 0.1),
        turned_to(normals),
        np.clip(rng.normal(0.85, 0.15, count), 0.05, 0.99),
        sh=sh,
    )
    return SplatScene(
        splats, Camera((1.6, 1.5, 2.4), (0, 0.5, 0), near=0.3, far=20), (0.7, 0.8, 0.9)
    )


def fog(rng: Generator, count: int) -> SplatScene:
    """Banks of fog: wide, thin splats, and a few coloured balls among them."""
    banks = rng.uniform((-1.5, -0.5, -3), (1.5, 0.5, 1), (12, 3))
    means = banks[rng.integers(0, len(banks), count)] + rng.normal(0, (0.45, 0.2, 0.45), (count, 3))
    scales = 0.12 * (4000 / max(count, 1)) ** (1 / 3) * rng.uniform(0.5, 1.5, (count, 3))
    opacities = rng.uniform(0.01, 0.1, count)
    tone = np.array([0.8, 0.83, 0.88]) * rng.uniform(0.8, 1.1, (count, 1))
    balls = np.arange(count) % 400 == 0
    scales[balls], opacities[balls] = 0.08, 0.95
    tone[balls] = rng.uniform(0.1, 0.9, (int(balls.sum()), 3))
    splats = Splats(
        means, scales, rng.normal(size=(count, 4)), opacities, colors=np.maximum(tone, 0)
    )
    return SplatScene(splats, Camera((0, 0.2, 3), near=0.3, far=20), (0.25, 0.35, 0.5))


def locks(rng: Generator, count: int) -> SplatScene:
    """Hair: locks of strands, each a chain of long and thin splats."""
    links = 40
    strands = max(1, -(-count // links))
    lock = rng.integers(0, 9, strands)
    phase, curl = rng.uniform(0, 6.28, 9)[lock], rng.uniform(0.08, 0.2, 9)[lock]
    start = np.stack(
        [0.36 * (lock - 4), np.full(strands, 2.0), rng.normal(0, 0.15, 9)[lock]], axis=1
    )
    start += rng.normal(0, 0.055, (strands, 3)) * (1, 0, 1)
    own = phase + rng.normal(0, 0.3, strands)

    def along(t: Array) -> Array:
        turn = 7 * t + own[:, None]
        curled = curl[:, None] * t
        return start[:, None] + np.stack(
            [curled * np.sin(turn), np.broadcast_to(-1.95 * t, turn.shape), curled * np.cos(turn)],
            axis=2,
        )

    t = np.linspace(0, 1, links + 1)[None]
    ends = along(t)
    means = ((ends[:, 1:] + ends[:, :-1]) / 2).reshape(-1, 3)[:count]
    way = (ends[:, 1:] - ends[:, :-1]).reshape(-1, 3)[:count]
    length = np.linalg.norm(way, axis=1)
    tone = np.repeat(
        np.array([0.42, 0.20, 0.08]) * rng.uniform(0.5, 1.5, (strands, 1)), links, axis=0
    )
    splats = Splats(
        means,
        np.stack([np.full(count, 0.006), np.full(count, 0.006), 0.4 * length], axis=1),
        turned_to(way / length[:, None]),
        np.full(count, 0.6),
        colors=tone[:count],
    )
    camera = Camera((0, 1.0, 4.6), (0, 1.0, 0), fov_y=0.6, near=0.3, far=20.0)
    return SplatScene(splats, camera, (0.75, 0.78, 0.82))


def turned_to(directions: Array) -> Array:
    """(N, 4) quaternions that turn z to directions (N, 3) of length 1."""
    x, y, z = directions.T
    turned = np.stack([1 + z, -y, x, np.zeros(len(directions))], axis=1)
    turned[z < -1 + 1e-9] = (0, 1, 0, 0)
    return turned


SPLAT_SCENES: dict[str, Callable[[Generator, int], SplatScene]] = {
    "pot-splats": pot,
    "fog-splats": fog,
    "hair-splats": locks,
}
