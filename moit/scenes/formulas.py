"""Scenes of fragments to try techniques on: seeded, of any size, made without files.

Each is hard for some techniques. Objects are drawn one after the other and nothing is sorted, as
a rasteriser would do; see `moit.scenes.shapes` for the camera.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.scenes.shapes import (
    Drawn,
    Hit,
    View,
    facing_disc,
    joined,
    paint,
    rectangle,
    rotation,
    sphere,
    strands,
)
from moit.scenes.window_scene import stained_glass

if TYPE_CHECKING:
    from numpy.random import Generator  # NumPy loads it on first use, since that takes long

Array = NDArray[Any]


# x, y and z of the middle; yaw, pitch; half width and height. The first two pairs are crossed.
PANES = (
    (-0.95, 0.15, 4.0, 0.85, 0.0, 0.95, 0.95),
    (-0.95, 0.15, 4.0, -0.75, 0.0, 0.90, 0.85),
    (0.95, -0.05, 4.1, 0.0, 0.9, 0.75, 1.05),
    (0.95, -0.05, 4.1, 0.0, -0.8, 0.70, 1.05),
    (0.1, -0.45, 3.2, 0.25, 0.1, 0.75, 0.55),
    (0.0, 0.75, 5.4, -0.2, 0.15, 1.6, 0.9),
    (0.1, -0.1, 6.2, 0.1, 0.0, 2.7, 2.1),
)


def panes(view: View, rng: Generator) -> Drawn:
    """Seven panes, in part in front of an opaque frame that is drawn first."""
    parts = [_frame(view)]
    hue = rng.random()
    for x, y, z, yaw, pitch, width, height in PANES:
        hue += 0.381966  # the golden angle keeps hues apart
        right, up = rotation(yaw + 0.1 * rng.normal(), pitch + 0.1 * rng.normal())
        center = np.array([x, y, z]) + rng.normal(0, 0.08, 3)
        glass = rectangle(view, center, right * width, up * height)
        edge = np.minimum(width * (1 - np.abs(glass.p)), height * (1 - np.abs(glass.q)))
        streak = np.exp(-(((glass.p - 0.6 * glass.q + 0.3) / 0.25) ** 2))
        light = 0.6 + 0.25 * glass.q + 0.7 * streak
        light *= np.where(edge < 0.03, 0.4, 1.0)
        alpha = np.where(edge < 0.03, 0.92, rng.uniform(0.4, 0.65))
        parts.append(glass.drawn(alpha, light[:, None] * paint(hue, 0.85, 0.95)))
    return joined(parts)


def _frame(view: View) -> Drawn:
    """A wooden window frame with a cross."""
    width, height, beam = 2.1, 1.75, 0.09
    center, right, up = np.array([0, 0, 4.4]), np.array([width, 0, 0]), np.array([0, height, 0])
    window = rectangle(view, center, right, up)
    x, y = width * np.abs(window.p), height * np.abs(window.q)
    bars = (x > width - beam) | (y > height - beam) | (x < beam / 2) | (y < beam / 2)
    wood = window.where(bars)
    grain = 0.9 + 0.1 * np.sin(90 * wood.p * wood.q + 9 * np.sin(7 * wood.p + 5 * wood.q))
    return wood.drawn(1.0, grain[:, None] * np.array([0.25, 0.13, 0.06]))


PARTICLES = 900


def cloud_particles(rng: Generator) -> tuple[Array, Array, Array]:
    """Middles (n, 3), radii (n,), and alpha in the middle (n,), which falls to 0 at the rim."""
    puffs = rng.normal((0, 0, 4), (0.55, 0.2, 0.4), (14, 3))
    centers = puffs[rng.integers(0, len(puffs), PARTICLES)]
    centers = centers + rng.normal(0, (0.25, 0.2, 0.3), (PARTICLES, 3))
    return centers, rng.uniform(0.12, 0.36, PARTICLES), rng.uniform(0.04, 0.16, PARTICLES)


def cloud(view: View, rng: Generator) -> Drawn:
    """Particles in puffs, lit from above, round a red disk that is drawn among them."""
    centers, radii, alphas = cloud_particles(rng)
    lit = np.clip(0.42 + 1.1 * centers[:, 1] - 0.3 * (centers[:, 2] - 4), 0.02, 1)[:, None]
    colors = lit * np.array([1.0, 0.95, 0.87]) + (1 - lit) * np.array([0.05, 0.08, 0.15])
    parts = [_red_disk(view)]
    for center, radius, alpha, color in zip(centers, radii, alphas, colors, strict=True):
        disc = facing_disc(view, center, radius)
        soft = 1 - disc.p**2 - disc.q**2
        parts.append(disc.drawn(alpha * soft, (1 + 0.15 * disc.q)[:, None] * color))
    order = rng.permutation(len(parts))
    return joined(parts[i] for i in order)


# Of the cloud's disk: where it is, how far it reaches, its opacity.
DISK, DISK_RADIUS, DISK_ALPHA = (-0.7, 0.05, 3.5), 0.5, 0.94


def disk_axes() -> tuple[Array, Array]:
    """The directions right and up of the cloud's disk."""
    return rotation(0.3, 0.7)


def _red_disk(view: View) -> Drawn:
    right, up = disk_axes()
    square = rectangle(view, np.array(DISK), DISK_RADIUS * right, DISK_RADIUS * up)
    disk = square.where(square.p**2 + square.q**2 <= 1)
    return disk.drawn(DISK_ALPHA, (0.8 + 0.2 * disk.q)[:, None] * np.array([0.85, 0.03, 0.02]))


HAIR_ALPHA = 0.05
LOCKS, CLUSTERS, WISPS, STRANDS = 6, 4, 8, 12  # in the scene, a lock, a cluster, a wisp


def hair(view: View, rng: Generator) -> Drawn:
    """Locks that fall from the top and curl, each in clusters of depth, those in wisps."""
    parts = []
    for lock in range(LOCKS):
        root = 0.3 * (lock - (LOCKS - 1) / 2) + 0.06 * rng.normal()
        sway, phase, depth = 0.2 * rng.normal(), rng.uniform(0, 6.28), rng.uniform(2.6, 4.2)
        for cluster in range(CLUSTERS):
            parts.append(_cluster(view, rng, root, sway, phase, depth + 0.25 * cluster))
    order = rng.permutation(len(parts))
    return joined(parts[i] for i in order)


def _cluster(
    view: View, rng: Generator, root: float, sway: float, phase: float, depth: float
) -> Drawn:
    fall = (1 - view.v[:, 0].astype(np.float32)) / 2  # 0 at the top, 1 at the bottom

    def varied(among_wisps: float, within: float) -> Array:
        wisps = np.repeat(rng.normal(0, among_wisps, WISPS), STRANDS)
        return (wisps + rng.normal(0, within, len(wisps))).astype(np.float32)[:, None]

    wave = np.sin(5 * fall + phase + varied(0.5, 0.1))
    center = root + varied(0.06, 0.012) * (1 + fall) + sway * fall**2
    center = center + (0.07 + varied(0.03, 0.003)) * wave
    away = depth + varied(0.02, 0.01) + 0.1 * np.sin(3 * fall + phase)
    shine = np.exp(-(((fall - 0.35 - 0.1 * np.sin(phase) - varied(0.03, 0.01)) / 0.05) ** 2))
    tone = np.clip(1 + varied(0.55, 0.2), 0.1, 2.5)[..., None]
    brown, light = np.array([0.30, 0.12, 0.04], np.float32), np.array([0.6, 0.4, 0.2], np.float32)
    color = tone * (brown + shine[..., None] * light)
    return strands(view, center, 0.03, away, HAIR_ALPHA, color)


SPHERE_RADIUS = 0.5
SPHERE_RANGE = (0.5, 6.5)  # twelve radii; the paper enlarged it to more than ten


def spheres(view: View, rng: Generator) -> Drawn:
    """Every two of the spheres intersect, and all three do; back and front of each."""
    turn = rng.uniform(0, 2 * np.pi)
    parts = []
    for i, tint in enumerate(([0.80, 0.06, 0.04], [0.07, 0.55, 0.08], [0.06, 0.16, 0.85])):
        angle = turn + 2 * np.pi * i / 3
        center = np.array([0.3 * np.cos(angle), 0.3 * np.sin(angle), 2.0 + 0.05 * i])
        for side in sphere(view, center, SPHERE_RADIUS):
            parts.append(side.drawn(0.6, _lit(side, np.array(tint))))
    return joined(parts)


def _lit(side: Hit, tint: Array) -> Array:
    """A sphere's colour under a light from the upper left; the inside is seen from behind."""
    facing = np.sqrt(np.clip(1 - side.p**2 - side.q**2, 0, 1))
    light = np.clip(-0.45 * side.p + 0.6 * side.q + 0.66 * facing, 0, 1)[:, None]
    return np.asarray((0.25 + 0.75 * light) * tint + 0.5 * light**40)


NEURAL_RANGE = (1.0, 2.0)


def neural_training(view: View, rng: Generator) -> Drawn:
    """2 to 32 fragments a pixel; their depths are uniform in an interval that they fill."""
    pixels = view.width * view.height
    counts = rng.integers(2, 33, pixels)
    begin = np.cumsum(counts) - counts
    n = int(counts.sum())
    depth = rng.random(n)
    least, most = np.minimum.reduceat(depth, begin), np.maximum.reduceat(depth, begin)
    length = rng.uniform(0.3, 1.0, pixels)
    start = rng.uniform(0.0, 1.0 - length)
    depth = (depth - np.repeat(least, counts)) / np.repeat(most - least, counts)
    depth = NEURAL_RANGE[0] + np.repeat(start, counts) + np.repeat(length, counts) * depth
    return Drawn(
        np.repeat(view.pixel.ravel(), counts),
        np.clip(depth, *NEURAL_RANGE),
        rng.uniform(0.1, 0.5, n).astype(np.float32),
        rng.random((n, 3), np.float32),
    )


# x, y and z of the middle, half a side, colour and alpha. Blue is that of McGuire's post.
SQUARES = (
    (-0.35, 0.25, 2.6, 0.62, (0.0, 0.0, 1.0), 0.75),
    (0.40, 0.05, 2.0, 0.48, (1.0, 0.0, 0.0), 0.75),
    (-0.05, -0.40, 3.4, 0.85, (1.0, 1.0, 0.0), 0.5),
    (0.25, 0.45, 4.2, 0.95, (0.0, 1.0, 0.0), 0.9),
)


def squares(view: View, rng: Generator) -> Drawn:
    """Overlapping squares of pure colours before a light wall."""
    wall = rectangle(view, np.array([0, 0, 6.0]), np.array([40.0, 0, 0]), np.array([0, 40.0, 0]))
    parts = [wall.drawn(1.0, np.array([0.8, 0.8, 0.8]))]
    for x, y, z, half, color, alpha in SQUARES:
        center = np.array([x, y, z]) + rng.normal(0, 0.04, 3)
        square = rectangle(view, center, np.array([half, 0, 0]), np.array([0, half, 0]))
        parts.append(square.drawn(alpha, np.array(color)))
    return joined(parts)


# What part of the width each scene has in the mixed one: less, where it has more fragments.
SHARES = {"panes": 0.36, "spheres": 0.26, "cloud": 0.18, "hair": 0.12, "neural-training": 0.08}


def mixed(view: View, rng: Generator) -> Drawn:
    """The scenes of SHARES, each in its columns, over an opaque floor that is drawn first."""
    edges = np.rint(np.cumsum([0.0, *SHARES.values()]) * view.width).astype(int)
    parts = [_floor(view)]
    for name, (left, right) in zip(SHARES, pairwise(edges.tolist()), strict=True):
        own = np.random.default_rng(rng.integers(2**63))
        if left < right:
            columns = View(right - left, view.height, left, view.width)
            parts.append(SCENES[name].draw(columns, own))
    return joined(parts)


def _floor(view: View) -> Drawn:
    """Tiles that get darker with distance."""
    near, far, wide = 3.0, 9.0, 30.0
    middle, half = np.array([0, -1.6, (near + far) / 2]), (far - near) / 2
    floor = rectangle(view, middle, np.array([wide, 0, 0]), np.array([0, 0, half]))
    even = (np.floor(2 * wide * floor.p) + np.floor(2 * floor.depth)) % 2
    shade = (0.10 + 0.12 * even) * ((far - floor.depth) / (far - near)) ** 1.5
    return floor.drawn(1.0, shade[:, None] * np.array([1.0, 0.95, 0.9]))


@dataclass(frozen=True)
class Scene:
    draw: Callable[[View, Generator], Drawn]
    depth_range: tuple[float, float] | None = None


SCENES = {
    "panes": Scene(panes),
    "cloud": Scene(cloud),
    "hair": Scene(hair),
    "spheres": Scene(spheres, SPHERE_RANGE),
    "neural-training": Scene(neural_training, NEURAL_RANGE),
    "stained-glass": Scene(stained_glass),
    "squares": Scene(squares),
    "mixed": Scene(mixed),
}
