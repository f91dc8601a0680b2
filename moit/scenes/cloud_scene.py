"""A cloud of particles with a red disk in it, and what of it the light meets: MBOIT, figure 9."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.solids import sheet, soft_discs
from moit.scenes.scene_parts import MeshScene, ground

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]

LIGHT = (0.12, -1.0, -0.15)  # where it travels
DISK_CENTER, DISK_RADIUS, DISK_ALPHA = np.array([-0.75, 1.45, 0.0]), 0.42, 0.94
PARTICLES, PUFFS = 1100, 34


def cloud_with_disk(rng: Generator) -> MeshScene:
    """Particles that face the eye round a red disk of 94 % opacity, over the ground."""
    camera = Camera((0, 2.2, 4.4), (0, 1.05, 0), fov_y=0.62, near=0.5, far=40.0)
    floor = ground(9.0, (0.42, 0.40, 0.36), (0.36, 0.34, 0.31), 18)
    return MeshScene([floor, *_casters(rng, camera.axes)], camera, (0.40, 0.55, 0.80))


def cloud_casters(rng: Generator) -> list[Mesh]:
    """The transparent part of the same scene as the light sees it: particles that face it."""
    forward = np.array(LIGHT) / np.linalg.norm(LIGHT)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return _casters(rng, np.array([right, np.cross(right, forward), forward]))


def _casters(rng: Generator, axes: Array) -> list[Mesh]:
    puffs = rng.uniform((-1.3, 0.95, -0.6), (1.3, 1.75, 0.6), (PUFFS, 3))
    centers = puffs[rng.integers(0, PUFFS, PARTICLES)] + rng.normal(0, 0.13, (PARTICLES, 3))
    radii = rng.uniform(0.12, 0.3, PARTICLES)
    alphas = rng.uniform(0.015, 0.06, PARTICLES)
    particles = soft_discs(centers, radii, np.full((PARTICLES, 3), 0.85), alphas, axes)
    r, angle = np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 2 * np.pi, 49))
    flat = np.stack([r * np.cos(angle), 0 * r, r * np.sin(angle)], axis=-1)
    disk = sheet(DISK_CENTER + DISK_RADIUS * flat, (0.8, 0.03, 0.02), DISK_ALPHA)
    return [disk, particles]
