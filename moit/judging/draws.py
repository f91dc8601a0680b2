"""What techniques are judged on: rays and scenes by kind of draw and seed.

A technique, its constants and its networks are tuned on draws of the kind "tune" (or on the rays of
`moit.neural.data`), a choice between a few is checked on "check", and the table that is published
comes from "final". The kind is part of what random numbers grow from, so that no seed of one kind
gives what a seed of another gives; the seed of the final draw is a digest of the version, so that
nobody chooses it and each release has its own.
"""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import scenes
from moit.checks.arguments import one_of, whole
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.neural import data
from moit.rendering.rasterizing import rasterize
from moit.scenes.mesh_scenes import MESH_SCENES
from moit.scenes.scene_parts import MeshScene
from moit.system.version import VERSION

Array = NDArray[Any]

KINDS = {"tune": 1, "check": 2, "final": 3}
#: Rays by letter: which of moit.neural.data's generators makes them.
SETS = dict(zip("ABCDEFG", data.SETS, strict=True))
#: All but that of coloured transmission, which not every technique takes; and of these those of
#: triangles, which a camera can go past.
SCENES = tuple(name for name in scenes.names() if name != "stained-glass")
PANNED = tuple(name for name in SCENES if name in MESH_SCENES)
MOST_SEEDS = 1_000_000  # of a kind
SPARE = 1e-5  # of the range at its far end, where depths that are too near one another may go
STEP = 1e-3  # of the range, by which each fragment moves from frame to frame
PAN = 0.25  # of a pixel, by which what the camera looks at goes sideways from frame to frame


@dataclass(frozen=True)
class Draw:
    """One draw of rays and scenes.

    kind : "tune", "check" or "final". seed : 0 to 999,999; of "final" that of the version.
    """

    kind: str
    seed: int

    def __str__(self) -> str:
        return f"{self.kind}-{self.seed}"

    def generator(self, *more: int) -> np.random.Generator:
        """Random numbers that no other draw, and no training, has."""
        return np.random.default_rng((KINDS[self.kind], self.seed, *more))

    @property
    def scene_seed(self) -> int:
        return KINDS[self.kind] * MOST_SEEDS + self.seed

    def rays(self, letter: str, pixels: int) -> Rays:
        """So many rays of a set, in float32, of random colours and in random order."""
        index = list(SETS).index(letter)
        rng = self.generator(index)
        generate = data.SETS[SETS[letter]][0]
        made = generate(pixels, rng)
        order = rng.permutation(len(made.pixel))
        return Rays(
            pixels,
            made.pixel[order],
            made.u[order],
            made.alpha[order],
            rng.random((len(order), 3), np.float32),
            rng.choice((-STEP, STEP), len(order)),
        )

    def scene(self, name: str, size: tuple[int, int]) -> tuple[Fragments, tuple[float, ...]]:
        """A scene's fragments and what is behind them."""
        if name not in MESH_SCENES:
            return scenes.load(name, size, self.scene_seed), (0.0, 0.0, 0.0)
        made = _made(name, self.scene_seed)
        return rasterize(made.meshes, made.camera, size, progress=False), made.background

    def panned(self, name: str, size: tuple[int, int], frames: int) -> list[Fragments]:
        """A scene of triangles, whose camera goes sideways and as far forward in each frame."""
        made = _made(name, self.scene_seed)
        seen = []
        for frame in range(frames):
            camera = moved(made.camera, frame * PAN, size[1])
            seen.append(rasterize(made.meshes, camera, size, progress=False))
        return seen


@functools.lru_cache(1)
def _made(name: str, seed: int) -> MeshScene:
    return scenes.meshes(name, seed)


def moved(camera: Camera, pixels: float, height: int) -> Camera:
    """It so far to the right, and as far forward, that what it looks at moves so many pixels."""
    right, _, forward = camera.axes
    distance = float(np.linalg.norm(np.subtract(camera.target, camera.eye)))
    step = pixels * 2 * math.tan(camera.fov_y / 2) / height * distance * (right + forward)
    eye, target = (tuple((np.array(at) + step).tolist()) for at in (camera.eye, camera.target))
    return replace(camera, eye=eye, target=target)


def draw_named(kind: str, seed: int = 0) -> Draw:
    """The draw of that kind and seed; of "final" there is one, whose seed is the version's."""
    one_of("draw", kind, tuple(KINDS))
    number = whole("seed", seed, 0, MOST_SEEDS - 1)
    if kind != "final":
        return Draw(kind, number)
    if number:
        raise ValueError(
            f"seed: expected none with draw='final', whose is the version's, got {seed}"
        )
    digest = hashlib.blake2b(VERSION.encode(), digest_size=8).digest()
    return Draw(kind, int.from_bytes(digest) % MOST_SEEDS)


@dataclass(frozen=True)
class Rays:
    """Fragments of pixels, in order of arrival, that may move in depth.

    u : where in the warped range; what leaves [0, 1] is folded back. speed : by frame.
    """

    pixels: int
    pixel: Array
    u: Array
    alpha: Array
    color: Array
    speed: Array

    def at(self, frame: int = 0) -> Fragments:
        """As they are in that frame. No two fragments of a pixel are at one depth: what comes of
        these is a matter of taste, and there are none where nothing was clipped."""
        depth = untied(self.pixel, self.u + frame * self.speed)
        return Fragments.from_pixels(
            self.pixel,
            depth,
            self.alpha,
            self.color,
            shape=(1, self.pixels),
            depth_range=(1.0, math.e),
            dtype=np.float32,
        )

    def frames(self, count: int) -> Sequence[Fragments]:
        return [self.at(frame) for frame in range(count)]


def untied(pixel: Array, u: Array) -> Array:
    """(N,) float32 depths in [1, e] for places in the warped range, distinct within a pixel."""
    folded = (1 - np.abs(1 - np.mod(u, 2))) * (1 - SPARE)
    depth = np.maximum(np.exp(folded).astype(np.float32), np.float32(1))
    while True:
        order = np.lexsort((depth, pixel))
        here, held = pixel[order], depth[order]
        same = np.flatnonzero((here[1:] == here[:-1]) & (held[1:] == held[:-1]))
        if not len(same):
            return np.asarray(depth)
        later = order[same + 1]
        depth[later] = np.nextafter(depth[later], np.float32(3))
