"""What a light sees: where points are on its map, and the fragments of casters there."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh, joined
from moit.geometry.rasterizer import rasterize

Array = NDArray[Any]


class View:
    """How a map of (height, width) texels is seen from a light."""

    shape: tuple[int, int]

    def places(self, points: Array) -> Array:
        """(N, 3): column and row, in texels from the map's corner, and depth; NaN where none."""
        raise NotImplementedError

    def texel(self, depth: Array) -> Array:
        """The side of a texel at a depth, in units of the scene."""
        raise NotImplementedError

    def fragments(self, meshes: list[Mesh], threads: int) -> Fragments:
        """All of the meshes, nothing hidden."""
        raise NotImplementedError


@dataclasses.dataclass(frozen=True)
class Itself(View):
    """Points are given as places on the map."""

    shape: tuple[int, int]

    def places(self, points: Array) -> Array:
        return points

    def texel(self, depth: Array) -> Array:
        return np.zeros_like(depth)


@dataclasses.dataclass(frozen=True)
class FromCamera(View):
    """A light at a camera's eye."""

    camera: Camera
    shape: tuple[int, int]

    def places(self, points: Array) -> Array:
        height, width = self.shape
        x, y, z = ((points - np.array(self.camera.eye)) @ self.camera.axes.T).T
        scale_x, scale_y = self.camera.scale((width, height))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            column = width * (0.5 + 0.5 * scale_x * x / z)
            row = height * (0.5 - 0.5 * scale_y * y / z)
        column[~(z > 0)] = np.nan
        return np.stack([column, row, z], axis=1)

    def texel(self, depth: Array) -> Array:
        height, width = self.shape
        scale_x, scale_y = self.camera.scale((width, height))
        return np.maximum(2 * depth / (width * scale_x), 2 * depth / (height * scale_y))

    def fragments(self, meshes: list[Mesh], threads: int) -> Fragments:
        height, width = self.shape
        return rasterize(meshes, self.camera, (width, height), threads=threads)


@dataclasses.dataclass(frozen=True)
class FromAfar(View):
    """Parallel light on a box round its casters: beside that there is no shadow of theirs.

    axes : (3, 3) right, up and where the light travels, of length 1.
    low, high : (3,) ends of the box along these.
    """

    axes: Array
    low: Array
    high: Array
    shape: tuple[int, int]

    @classmethod
    def of(cls, direction: Array, meshes: list[Mesh], resolution: int, margin: int) -> FromAfar:
        """With room for so many texels on each side that a filter may fill."""
        forward = direction / np.linalg.norm(direction)
        up = np.eye(3)[1] if abs(forward[1]) < 0.9 else np.eye(3)[2]
        right = np.cross(forward, up)
        right = right / np.linalg.norm(right)
        axes = np.array([right, np.cross(right, forward), forward])
        points = np.concatenate(
            [mesh.vertices[np.unique(mesh.triangles)] for mesh in meshes], dtype=np.float64
        )
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        size = max(float((high - low).max()), 1e-6 * float(np.abs(seen).max()), 1e-30)
        thin = np.maximum(1e-6 * size - (high - low), 0) / 2
        low, high = low - thin, high + thin
        share = min(margin / resolution, 0.25)
        around = np.append((high - low)[:2] * share / (1 - 2 * share), 0.0)
        return cls(axes, low - around, high + around, (resolution, resolution))

    def places(self, points: Array) -> Array:
        height, width = self.shape
        share = (points @ self.axes.T - self.low) / (self.high - self.low)
        return np.stack(
            [width * share[:, 0], height * (1 - share[:, 1]), share[:, 2] * self.reach], axis=1
        )

    @property
    def reach(self) -> float:
        """How deep the box is: depth is from its front."""
        return float(np.float32(self.high[2] - self.low[2]))

    def texel(self, depth: Array) -> Array:
        height, width = self.shape
        across, along, _ = self.high - self.low
        return np.full_like(depth, max(across / width, along / height))

    def fragments(self, meshes: list[Mesh], threads: int) -> Fragments:
        """A picture without perspective is one of triangles that all lie at one distance, where
        depth is a colour."""
        height, width = self.shape
        vertices, _, _, alpha, triangles = joined(meshes)
        share = (vertices.astype(np.float64) @ self.axes.T - self.low) / (self.high - self.low)
        flat = np.ones(vertices.shape, np.float32)
        flat[:, :2] = 2 * share[:, :2] - 1
        depth = np.clip(share[:, 2], 0, 1).astype(np.float32)
        colors = np.repeat(depth[:, None], 3, axis=1)
        normals = np.zeros_like(flat)
        normals[:, 2] = 1
        # opaque triangles are to be listed as all others
        solid = (alpha == 1)[triangles].all(axis=1)
        alphas = np.where(alpha == 1, np.float32(0.5), alpha) if solid.all() else alpha
        offsets, _, opacity, color = _core.rasterize(
            (flat, normals, colors, alphas, triangles),
            ((0.0, 0.0, 0.0), *np.eye(3).tolist(), (1.0, 1.0), 0.5, 2.0),
            width,
            height,
            threads,
            np.array([[0.0, 0.0, 1.0, 1.0, 1.0, 1.0]]),
        )
        if solid.all():
            opacity = np.ones_like(opacity)
        reach = self.reach
        away = np.clip(color[:, 0].astype(np.float64) * reach, 0, reach).astype(np.float32)
        return Fragments(offsets, away, opacity, shape=(height, width), depth_range=(0.0, reach))


def split(meshes: list[Mesh]) -> tuple[list[Mesh], list[Mesh]]:
    """The triangles that let light through, and those that do not, in their order."""
    clear: list[Mesh] = []
    solid: list[Mesh] = []
    for mesh in meshes:
        transparent = mesh.transparent
        for part, chosen in ((clear, transparent), (solid, ~transparent)):
            if chosen.any():
                part.append(
                    mesh
                    if chosen.all()
                    else Mesh(
                        mesh.vertices, mesh.triangles[chosen], mesh.color, mesh.alpha, mesh.normals
                    )
                )
    return clear, solid
