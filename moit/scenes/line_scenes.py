"""Scenes of streamlines whose colour and opacity tell an attribute, as those of Kern et al., "A
Comparison of Rendering Techniques for 3D Line Sets with Transparency", 2021: flows of formulas."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera, Vector
from moit.geometry.scalar_maps import map_scalars
from moit.geometry.strokes import Lines

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]
Flow = Callable[[Array], Array]

STEPS = 160  # of a line, at most
# from what hardly matters to what does: context is faint, and what is sought is nearly opaque
SHADES = [(0.20, 0.35, 0.75), (0.55, 0.70, 0.85), (0.95, 0.85, 0.55), (0.85, 0.25, 0.10)]
OPACITIES = (0.02, 0.05, 0.25, 0.95)


@dataclasses.dataclass(frozen=True)
class LineScene:
    """Lines in the order of their seeds, a camera, and what is behind everything.

    attribute : (N,) of each point: what colour and opacity tell.
    """

    lines: Lines
    camera: Camera
    attribute: NDArray[np.float64]
    background: Vector = (1.0, 1.0, 1.0)


def turbulence(rng: Generator, count: int) -> LineScene:
    """A box of eddies of many sizes; the attribute is vorticity, so that cores of eddies stand out
    in a haze of what is slow."""
    waves = 28
    directions = rng.normal(size=(waves, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    numbers = directions * rng.uniform(2.0, 8.0, (waves, 1))
    # across the wave: then the flow has no sources
    push = np.cross(directions, rng.normal(size=(waves, 3)))
    push *= np.linalg.norm(numbers, axis=1, keepdims=True) ** (-5 / 6)
    phase = rng.uniform(0, 2 * np.pi, waves)
    turning = np.cross(numbers, push)

    def flow(x: Array) -> Array:
        return np.asarray(np.cos(x @ numbers.T + phase) @ push)

    def vorticity(x: Array) -> Array:
        return np.asarray(
            np.linalg.norm(np.sin(x @ numbers.T + phase) @ turning, axis=1), np.float64
        )

    seeds = rng.uniform(-1, 1, (count, 3))
    camera = Camera((1.9, 1.3, 3.1), (0, 0, 0), fov_y=0.7, near=0.5, far=12.0)
    return _scene(flow, vorticity, seeds, 0.02, camera, radius=0.006)


def convection(rng: Generator, count: int) -> LineScene:
    """Two rolls between a warm and a cold plate, along which lines wind as helices, layer before
    layer; the attribute is how fast things rise or sink."""

    def flow(x: Array) -> Array:
        right, along, up = x.T
        wide = 1 + 0.15 * np.sin(2.5 * along)
        across = np.cos(np.pi * up / 2) * np.pi / 2
        return np.stack(
            [
                -np.sin(np.pi * right) * np.sin(np.pi * up / 2) * np.pi / 2 * wide,
                0.18 * across + 0.05 * np.cos(np.pi * right),
                -np.pi * np.cos(np.pi * right) * np.cos(np.pi * up / 2) * wide,
            ],
            axis=1,
        )

    def rise(x: Array) -> Array:
        return np.asarray(np.abs(flow(x)[:, 2]), np.float64)

    seeds = rng.uniform((-1.5, -1.0, -0.95), (1.5, 1.0, 0.95), (count, 3))
    camera = Camera((1.2, -4.4, 1.1), (0, 0, 0), up=(0, 0, 1), fov_y=0.7, near=0.5, far=12.0)
    return _scene(flow, rise, seeds, 0.03, camera, radius=0.008)


def _scene(
    flow: Flow,
    attribute: Flow,
    seeds: Array,
    step: float,
    camera: Camera,
    radius: float,
) -> LineScene:
    """Lines of at most STEPS steps from seeds, as long as they stay near the middle."""
    places = [seeds]
    for _ in range(STEPS):
        x = places[-1]
        half = x + 0.5 * step * flow(x)
        places.append(x + step * flow(half))
    points = np.stack(places, axis=1)
    inside = np.logical_and.accumulate(np.abs(points).max(axis=2) < 1.6, axis=1)
    lengths = np.maximum(inside.sum(axis=1), 1)
    inside[:, 0] = True
    some = points[inside]
    told = attribute(some)
    limits = (0.0, float(np.quantile(told, 0.995)))
    lines = Lines(
        some,
        np.concatenate([[0], np.cumsum(lengths)]),
        radius,
        map_scalars(told, SHADES, OPACITIES, limits=limits),
        shape="tube",
    )
    return LineScene(lines, camera, told)


LINE_SCENES: dict[str, Callable[[Generator, int], LineScene]] = {
    "turbulence-lines": turbulence,
    "convection-lines": convection,
}
