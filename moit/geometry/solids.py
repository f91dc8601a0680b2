"""Shapes that mesh scenes are built of: sheets, lathes, tubes, balls and discs, as meshes.

y points up. A sheet is a grid of points; the others are sheets that were rolled.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.geometry.meshes import Mesh, altered

Array = NDArray[Any]
Paint = ArrayLike | Array


def sheet(
    points: Array, color: Paint, alpha: Paint, closed: bool = False, normals: Array | None = None
) -> Mesh:
    """A grid of points (rows, columns, 3), joined by triangles.

    color : (3,) or (rows, columns, 3); alpha : a number or (rows, columns).
    closed : the last column is joined to the first.
    """
    rows, columns = points.shape[:2]
    shades = np.broadcast_to(np.asarray(color, float), (rows, columns, 3)).reshape(-1, 3)
    opacity = np.broadcast_to(np.asarray(alpha, float), (rows, columns)).reshape(-1)
    here = np.arange(rows * columns).reshape(rows, columns)
    if closed:
        here = np.hstack([here, here[:, :1]])
    a, b, c, d = (
        one.reshape(-1) for one in (here[:-1, :-1], here[:-1, 1:], here[1:, :-1], here[1:, 1:])
    )
    triangles = np.stack([np.stack([a, b, c], 1), np.stack([b, d, c], 1)], 1).reshape(-1, 3)
    directions = _normals(points, closed) if normals is None else normals
    return Mesh(points.reshape(-1, 3), triangles, shades, opacity, directions.reshape(-1, 3))


def _normals(points: Array, closed: bool) -> Array:
    """Of a smooth surface through the points; not of unit length."""
    if closed:
        around = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
    else:
        around = np.gradient(points, axis=1)
    along = np.gradient(points, axis=0)
    normals = np.cross(along, around)
    # at a pole, where a row is one point, the next row knows better
    size = np.linalg.norm(normals, axis=-1, keepdims=True)
    weak = (size < 1e-9 * size.max(initial=1e-30)).all(axis=(1, 2))
    for end, inner in ((0, 1), (-1, -2)):
        if weak[end] and len(points) > 2:
            normals[end] = normals[inner].mean(axis=0)
    return np.asarray(normals)


def lathe(profile: ArrayLike, color: Paint, alpha: Paint, segments: int = 48) -> Mesh:
    """(n, 2) radii and heights, turned round the y axis."""
    radius, height = np.asarray(profile, float).T
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    points = np.stack(
        [
            radius[:, None] * np.cos(angle),
            np.broadcast_to(height[:, None], (len(height), segments)),
            radius[:, None] * np.sin(angle),
        ],
        axis=-1,
    )
    return sheet(points, color, alpha, closed=True)


def box(center: ArrayLike, size: ArrayLike, color: Paint, alpha: Paint, parts: int = 1) -> Mesh:
    """A box with sides along the axes; each of its faces in parts x parts squares."""
    half = 0.5 * np.asarray(size, float)
    side = np.linspace(-1, 1, parts + 1)
    u, v = np.meshgrid(side, side, indexing="ij")
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            face = np.empty((parts + 1, parts + 1, 3))
            face[..., axis] = sign
            face[..., (axis + 1) % 3], face[..., (axis + 2) % 3] = u, v
            normal = sign * np.eye(3)[axis]
            normals = np.broadcast_to(normal, face.shape)
            place = np.asarray(center, float) + half * face
            faces.append(sheet(place, color, alpha, normals=normals))
    count = (parts + 1) ** 2
    return Mesh(
        np.concatenate([one.vertices for one in faces]),
        np.concatenate([one.triangles + i * count for i, one in enumerate(faces)]),
        np.concatenate([one.color for one in faces]),
        np.concatenate([one.alpha for one in faces]),
        np.concatenate([one.normals for one in faces if one.normals is not None]),
    )


def tube(
    path: ArrayLike, radius: ArrayLike, color: Paint, alpha: Paint, segments: int = 12
) -> Mesh:
    """A round tube along (n, 3) points, of one radius or (n,)."""
    middle = np.asarray(path, float)
    along = np.gradient(middle, axis=0)
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    # an axis that no part of the path runs along, so that rings do not twist
    away = np.eye(3)[np.argmin(np.abs(along).max(axis=0))]
    side = np.cross(along, away)
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)[None, :, None]
    width = np.broadcast_to(np.asarray(radius, float), len(middle))[:, None, None]
    ring = np.cos(angle) * side[:, None] + np.sin(angle) * other[:, None]
    return sheet(middle[:, None] + width * ring, color, alpha, closed=True, normals=ring)


def ball(center: ArrayLike, radius: float, color: Paint, alpha: Paint, segments: int = 48) -> Mesh:
    """A sphere."""
    turn = np.linspace(0, np.pi, segments // 2 + 1)
    unit = lathe(np.stack([np.sin(turn), np.cos(turn)], 1), color, alpha, segments)
    return Mesh(
        unit.vertices * np.float32(radius) + np.asarray(center, np.float32),
        unit.triangles,
        unit.color,
        unit.alpha,
        unit.vertices,
    )


def soft_discs(
    centers: Array, radii: Array, colors: Array, alphas: Array, axes: Array, segments: int = 12
) -> Mesh:
    """Discs that face a camera, alpha falling from the middle to 0 at the rim: particles.

    centers (n, 3), radii (n,), colors (n, 3), alphas (n,) in the middle, axes (3, 3) a camera's.
    """
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    right, up, forward = axes
    around = np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * up
    # rings at half the radius and at all of it follow alpha (1 - r^2) to an eighth
    shares = np.concatenate([[0.0], np.full(segments, 0.5), np.ones(segments)])
    spokes = np.concatenate([np.zeros((1, 3)), around, around]) * shares[:, None]
    count = len(shares)
    i = np.arange(segments)
    after = (i + 1) % segments
    inner, outer = 1 + i, 1 + segments + i
    fan = np.concatenate(
        [
            np.stack([np.zeros_like(i), inner, 1 + after], 1),
            np.stack([inner, outer, 1 + after], 1),
            np.stack([outer, 1 + segments + after, 1 + after], 1),
        ]
    )
    n = len(centers)
    places = centers[:, None] + radii[:, None, None] * spokes
    normals = -forward + 0.8 * spokes
    return Mesh(
        places.reshape(-1, 3),
        (np.arange(n)[:, None, None] * count + fan).reshape(-1, 3),
        np.repeat(colors, count, axis=0),
        np.clip(alphas[:, None] * (1 - shares**2), 0, 1).reshape(-1),
        np.tile(normals, (n, 1)),
    )


def ribbon(path: Array, across: Array, width: float, color: Paint, alpha: Paint) -> Mesh:
    """A band of that width along (n, 3) points, its other side in direction (n, 3) `across`."""
    unit = across / np.linalg.norm(across, axis=-1, keepdims=True)
    points = np.stack([path - 0.5 * width * unit, path + 0.5 * width * unit], axis=1)
    shades = np.broadcast_to(np.asarray(color, float), (len(path), 3))[:, None]
    opacity = np.broadcast_to(np.asarray(alpha, float), len(path))[:, None]
    return sheet(points, np.repeat(shades, 2, 1), np.repeat(opacity, 2, 1))


def ribbons(paths: Array, across: Array, width: float, colors: Array, alpha: Paint) -> Mesh:
    """Bands as `ribbon` makes them, in one mesh, of (count, n, 3) paths, directions and colours."""
    count, n = paths.shape[:2]
    unit = across / np.linalg.norm(across, axis=-1, keepdims=True)
    points = np.stack([paths - 0.5 * width * unit, paths + 0.5 * width * unit], axis=2)
    normals = np.cross(
        np.gradient(points, axis=1),
        np.broadcast_to((points[:, :, 1:] - points[:, :, :1]), points.shape),
    )
    first = 2 * np.arange(n - 1)[:, None]
    quads = (first + np.array([0, 1, 2, 1, 3, 2])).reshape(-1, 3)
    opacity = np.broadcast_to(np.asarray(alpha, float), (count, n))
    return Mesh(
        points.reshape(-1, 3),
        (2 * n * np.arange(count)[:, None, None] + quads).reshape(-1, 3),
        np.repeat(colors, 2, axis=1).reshape(-1, 3),
        np.repeat(opacity, 2, axis=1).reshape(-1),
        normals.reshape(-1, 3),
    )


def moved(mesh: Mesh, by: ArrayLike, size: float = 1.0, turn: float = 0.0) -> Mesh:
    """Scaled, turned round the y axis by radians, then moved."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return altered(
        mesh,
        vertices=size * mesh.points @ rotation.T + np.asarray(by, float),
        normals=None if mesh.normals is None else mesh.normals @ rotation.T,
        origin=None,
    )
