"""What a light sees: where points are on its map, and the fragments of casters there."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh, altered, common_origin, corners_of, mesh_arrays
from moit.geometry.rasterizer import rasterized

Array = NDArray[Any]


class View(ABC):
    """How a map of (height, width) texels is seen from a light."""

    shape: tuple[int, int]

    @property
    @abstractmethod
    def matrix(self) -> Array:
        """(4, 4): from (x, y, z, 1) in the scene to column and row, in texels from the map's
        corner, both multiplied by the last, and depth."""

    @property
    @abstractmethod
    def texel(self) -> tuple[float, float]:
        """The side of a texel, in units of the scene: the first, and depth times the second."""

    def places(self, points: Array) -> Array:
        """(N, 3): column, row and depth; no column where the light has no sight of a point."""
        column, row, depth, w = self.matrix[:, :3] @ points.T + self.matrix[:, 3:]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return np.stack([np.where(w > 0, column / w, np.nan), row / w, depth], axis=1)


@dataclasses.dataclass(frozen=True)
class Itself(View):
    """Points are given as places on the map."""

    shape: tuple[int, int]

    @property
    def matrix(self) -> Array:
        return np.eye(4)

    @property
    def texel(self) -> tuple[float, float]:
        return 0.0, 0.0


@dataclasses.dataclass(frozen=True)
class FromCamera(View):
    """A light at a camera's eye."""

    camera: Camera
    shape: tuple[int, int]

    @property
    def matrix(self) -> Array:
        height, width = self.shape
        scale_x, scale_y = self.camera.scale((width, height))
        right, up, forward = self.camera.axes
        rows = np.array(
            [
                0.5 * width * (forward + scale_x * right),
                0.5 * height * (forward - scale_y * up),
                forward,
                forward,
            ]
        )
        return np.hstack([rows, -rows @ np.array(self.camera.eye)[:, None]])

    @property
    def texel(self) -> tuple[float, float]:
        height, width = self.shape
        scale_x, scale_y = self.camera.scale((width, height))
        return 0.0, max(2 / (width * scale_x), 2 / (height * scale_y))

    def fragments(self, meshes: list[Mesh], threads: int) -> Fragments:
        """All of the meshes, nothing hidden."""
        height, width = self.shape
        return rasterized(meshes, self.camera, (width, height), threads)


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
            [mesh.points[corners_of(mesh)] for mesh in meshes], dtype=np.float64
        )
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        size = max(float((high - low).max()), 1e-6 * float(np.abs(seen).max()), 1e-30)
        thin = np.maximum(1e-6 * size - (high - low), 0) / 2
        low, high = low - thin, high + thin
        share = min(margin / resolution, 0.25)
        around = np.append((high - low)[:2] * share / (1 - 2 * share), 0.0)
        return cls(axes, low - around, high + around, (resolution, resolution))

    @property
    def matrix(self) -> Array:
        height, width = self.shape
        across, along, deep = self.high - self.low
        scale = np.array([width / across, -height / along, self.reach / deep])
        from_corner = np.array([self.low[0], self.high[1], self.low[2]])
        matrix = np.eye(4)
        matrix[:3, :3] = scale[:, None] * self.axes
        matrix[:3, 3] = -scale * from_corner
        matrix[3] = 0, 0, 0, 1
        return matrix

    @property
    def reach(self) -> float:
        """How deep the box is: depth is from its front."""
        return float(np.float32(self.high[2] - self.low[2]))

    @property
    def texel(self) -> tuple[float, float]:
        height, width = self.shape
        across, along, _ = self.high - self.low
        return max(across / width, along / height), 0.0

    def fragments(self, meshes: list[Mesh], threads: int) -> Fragments:
        """A picture without perspective is one of triangles that all lie at one distance, where
        depth is a colour."""
        height, width = self.shape
        origin = common_origin(meshes, (self.low + self.high) / 2 @ self.axes)
        # of images alpha counts alone
        arrays = mesh_arrays(meshes, origin, lit=1, painted=0, listed=1)
        vertices, _, _, alpha, triangles, *worn = arrays
        low = self.low - origin @ self.axes.T
        share = (vertices.astype(np.float64) @ self.axes.T - low) / (self.high - self.low)
        flat = np.ones(vertices.shape, np.float32)
        flat[:, :2] = 2 * share[:, :2] - 1
        depth = np.clip(share[:, 2], 0, 1).astype(np.float32)
        colors = np.repeat(depth[:, None], 3, axis=1)
        normals = np.zeros_like(flat)
        normals[:, 2] = 1
        # opaque triangles are to be listed as all others: those that wear something are
        solid = not any(mesh.transparent.any() for mesh in meshes)
        alphas = np.where(alpha == 1, np.float32(0.5), alpha) if solid else alpha
        if worn:
            own = np.unique(triangles[worn[1] >= 0])
            alphas[own] = alpha[own]
        offsets, _, opacity, color = _core.rasterize(
            (flat, normals, colors, alphas, triangles, *worn),
            ((0.0, 0.0, 0.0), *np.eye(3).tolist(), (1.0, 1.0), 0.5, 2.0),
            width,
            height,
            threads,
            np.array([[0.0, 0.0, 1.0, 1.0, 1.0, 1.0]]),
        )
        if solid:
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
                    mesh if chosen.all() else altered(mesh, triangles=mesh.triangles[chosen])
                )
    return clear, solid
