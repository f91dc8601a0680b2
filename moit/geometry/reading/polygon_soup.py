"""Polygons with vertices, as PLY and OFF have them, as a Part."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.foreign import GREY, of_bytes
from moit.geometry.normals import smooth_normals
from moit.geometry.polygons import cut
from moit.geometry.reading.parts import Part
from moit.geometry.textures import Texture

Array = NDArray[Any]


def part_of_polygons(
    points: NDArray[np.float64],
    corners: Array,
    sizes: Array,
    *,
    color: Array | None = None,
    normals: Array | None = None,
    face_color: Array | None = None,
    uv: Array | None = None,
    corner_uv: Array | None = None,
    texture: Texture | None = None,
) -> Part:
    """The triangles of polygons.

    corners : (N,) vertices of all polygons, of which each has `sizes` (P,).
    color, face_color : linear, (V, 3 or 4) and (P, 3 or 4); that of faces counts where both are.
    uv, corner_uv : (V, 2) and (N, 2); that of corners counts where both are.
    """
    if corners.size and not 0 <= corners.min() <= corners.max() < len(points):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise MeshError(f"a face: found vertex {wrong}; needed one of {len(points)}, from 0")
    if not np.isfinite(points).all():
        at = int(np.argmax(~np.isfinite(points).all(axis=1)))
        raise MeshError(f"vertex {at}: found {points[at].tolist()}; needed finite numbers")
    chosen = cut(points[corners], sizes)
    triangles = corners[chosen]
    if normals is None or not np.isfinite(normals).all():
        normals = smooth_normals(points, triangles)
    shades: Array = np.full(3, GREY) if color is None else color
    if texture is not None and color is None:
        shades = np.ones(3)
    if face_color is not None or (corner_uv is not None and texture is not None):
        own = triangles.reshape(-1)
        points, normals = points[own], normals[own]
        uv = None if uv is None else uv[own]
        if color is not None:
            shades = color[own]
        if face_color is not None:
            face = np.repeat(np.arange(len(sizes)), sizes)[chosen.reshape(-1)]
            shades = face_color[face]
        if corner_uv is not None:
            uv = corner_uv[chosen.reshape(-1)]
        triangles = np.arange(len(own)).reshape(-1, 3)
    textured = texture is not None and uv is not None
    return Part(
        points=points,
        triangles=triangles,
        color=shades,
        normals=normals,
        uv=uv if textured else None,
        texture=texture if textured else None,
    )


def linear(shades: Array, most: float) -> NDArray[np.float64]:
    """Colours (n, 3 or 4) on a screen, full at `most`, as linear ones; alpha is linear already."""
    if not ((shades >= 0) & (shades <= most)).all():
        raise MeshError(f"a colour: found a number outside [0, {most:g}]")
    return of_bytes(shades, most)
