"""What readers of files find: parts in float64, each of one material, not yet placed."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.meshes import Mesh, near_origin
from moit.geometry.normals import facet_normals
from moit.geometry.textures import Texture

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one material, in the scene's coordinates.

    points : (V, 3) float64; triangles (T, 3).
    color : (3,), (4,), (V, 3) or (V, 4): linear.
    normals : (V, 3); None: facets.
    """

    points: NDArray[np.float64]
    triangles: Array
    color: Array
    normals: Array | None = None
    uv: Array | None = None
    texture: Texture | None = None
    alpha_cutoff: float | None = None
    lit: bool = True
    transmission: float = 0.0

    @property
    def look(self) -> tuple[Any, ...]:
        """Parts that share it can be one mesh."""
        return (id(self.texture), self.alpha_cutoff, self.lit, self.transmission)

    @property
    def colors(self) -> Array:
        """(V, 4)."""
        color = np.broadcast_to(self.color, (len(self.points), np.shape(self.color)[-1]))
        if color.shape[1] == 4:
            return color
        return np.concatenate([color, np.ones((len(color), 1), color.dtype)], axis=1)


def meshes_of_parts(parts: Sequence[Part]) -> list[Mesh]:
    """A Mesh of each part that has triangles, all of one origin, so that seams stay closed."""
    parts = [faceted(part) for part in parts if len(part.triangles)]
    if not parts:
        return []
    least = np.min([part.points.min(axis=0) for part in parts], axis=0)
    most = np.max([part.points.max(axis=0) for part in parts], axis=0)
    origin = near_origin(least, most)
    return [
        Mesh(
            part.points - origin if origin.any() else part.points,
            part.triangles,
            part.color,
            normals=part.normals,
            uv=part.uv,
            texture=part.texture,
            alpha_cutoff=part.alpha_cutoff,
            lit=part.lit,
            transmission=part.transmission,
            origin=origin,
        )
        for part in parts
    ]


def joined_parts(parts: Sequence[Part]) -> Part:
    """All as one, in order. Raises MeshError where one material cannot have the looks of all."""
    parts = [faceted(part) for part in parts if len(part.triangles)]
    looks = {part.look for part in parts}
    if len(looks) > 1:
        textures = len({look[0] for look in looks})
        raise MeshError(
            f"found {len(parts)} parts of {len(looks)} materials with {textures} textures, which "
            "one mesh cannot have; read_meshes gives a mesh of each"
        )
    if len(parts) == 1:
        return parts[0]
    start = np.cumsum([0, *(len(part.points) for part in parts)])[:-1]
    textured = parts[0].texture is not None
    return dataclasses.replace(
        parts[0],
        points=np.concatenate([part.points for part in parts]),
        triangles=np.concatenate(
            [part.triangles + i for part, i in zip(parts, start, strict=True)]
        ),
        color=np.concatenate([part.colors for part in parts]),
        normals=np.concatenate([part.normals for part in parts if part.normals is not None]),
        uv=np.concatenate([part.uv for part in parts if part.uv is not None]) if textured else None,
    )


def faceted(part: Part) -> Part:
    """The same with normals: facets' where it has none."""
    if part.normals is not None:
        return part
    corners = part.triangles.reshape(-1)
    points = part.points[corners]
    several = np.ndim(part.color) == 2
    return dataclasses.replace(
        part,
        points=points,
        triangles=np.arange(len(corners)).reshape(-1, 3),
        color=part.color[corners] if several else part.color,
        normals=facet_normals(points.reshape(-1, 3, 3)).repeat(3, axis=0),
        uv=None if part.uv is None else part.uv[corners],
    )
