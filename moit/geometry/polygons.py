"""Polygons in space cut into triangles that cover each once: concave ones, and ones with holes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def cut(points: NDArray[np.float64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """(T, 3): triangles of polygons, polygon after polygon, each turned as its polygon is.

    points : (N, 3) corners in space, those of a polygon after those of another.
    sizes : (P,) how many corners each polygon has; those of fewer than three, and those without
        area, give nothing.

    A polygon with a hole has a bridge: its outline goes in to the hole, round it, and back. What
    is not flat is cut as its projection along its normal is. Raises ImportError where a polygon
    needs ear clipping and the package for it is missing.
    """
    start = np.cumsum(sizes) - sizes
    found = [np.zeros((0, 3), np.int64)]
    source = [np.zeros(0, np.int64)]
    for size in np.unique(sizes[sizes >= 3]).tolist():
        polygons = np.flatnonzero(sizes == size)
        corners = start[polygons][:, None] + np.arange(size)
        if size == 3:
            found.append(corners)
            source.append(polygons)
            continue
        fans, good = _fans(points[corners])
        found.append(corners[good][:, fans].reshape(-1, 3))
        source.append(np.repeat(polygons[good], size - 2))
        for i in np.flatnonzero(~good).tolist():
            triangles = _ears(points[corners[i]])
            found.append(corners[i][triangles])
            source.append(np.full(len(triangles), polygons[i]))
    order = np.argsort(np.concatenate(source), kind="stable")
    return np.concatenate(found)[order]


def _fans(polygons: NDArray[np.float64]) -> tuple[Array, NDArray[np.bool_]]:
    """The triangles (n - 2, 3) of a fan round the first corner, and for which polygons (P, n, 3)
    these cover all once: those whose first corner sees every other, in less than half a turn."""
    count = polygons.shape[1]
    i = np.arange(1, count - 1)
    fan = np.stack([np.zeros_like(i), i, i + 1], axis=1)
    spokes = polygons[:, 1:] - polygons[:, :1]
    turns = np.cross(spokes[:, :-1], spokes[:, 1:])
    normal = turns.sum(axis=1)
    length = np.linalg.norm(normal, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        areas = np.einsum("pik,pk->pi", turns, normal / length[:, None])
    along = np.einsum("pik,pik->pi", spokes[:, :-1], spokes[:, 1:])
    angle = np.arctan2(areas, along).sum(axis=1)
    good = (areas > 0).all(axis=1) & (angle < np.pi)  # false for a polygon without area
    return fan, good


def _ears(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(T, 3) triangles of one polygon (n, 3), by ear clipping of its projection."""
    flat = _projected(points)
    if flat is None:
        return np.zeros((0, 3), np.int64)
    whole = abs(_area(flat))
    best: NDArray[np.int64] = np.zeros((0, 3), np.int64)
    least = np.inf
    outline = [[np.arange(len(flat))]]
    # its rings first: bridges are a line that is neither inside nor outside
    for groups in (_with_holes(_rings(points), flat), outline):
        found = [_clipped(group, flat) for group in groups]
        triangles = np.concatenate([np.zeros((0, 3), np.int64), *found])
        off = abs(float(np.abs(_turns(flat[triangles])).sum()) / 2 - whole)
        if off < least:
            best, least = triangles, off
        if off <= 1e-9 * whole:
            break
    return np.where(_turns(flat[best])[:, None] < 0, best[:, ::-1], best)


def _clipped(rings: list[Array], flat: NDArray[np.float64]) -> NDArray[np.int64]:
    """(T, 3) of an outline and its holes."""
    try:
        import mapbox_earcut as earcut
    except ImportError as error:
        raise ImportError(
            "a polygon that is not convex needs mapbox_earcut: pip install 'moit[mesh]' installs it"
        ) from error
    corners = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    found = earcut.triangulate_float64(np.ascontiguousarray(flat[corners]), ends)
    return np.asarray(corners[found.reshape(-1, 3).astype(np.int64)])


def _rings(points: NDArray[np.float64]) -> list[Array]:
    """The corners of each simple loop of an outline that comes back to places where it was."""
    place = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1).tolist()
    rings: list[Array] = []
    walked: list[int] = []
    at: dict[int, int] = {}  # where in `walked` a place is
    for i, here in enumerate(place):
        if here in at:
            loop = walked[at[here] :]
            if len(loop) > 2:  # less is a bridge, there and back
                rings.append(np.array(loop))
            for gone in loop:
                del at[place[gone]]
            del walked[len(walked) - len(loop) :]
        at[here] = len(walked)
        walked.append(i)
    if len(walked) > 2:
        rings.append(np.array(walked))
    return rings


def _with_holes(rings: list[Array], flat: NDArray[np.float64]) -> list[list[Array]]:
    """Outlines, each with its holes: rings that turn the other way, and lie in it."""
    outlines = [[ring] for ring in rings if _area(flat[ring]) > 0]
    for ring in rings:
        if _area(flat[ring]) < 0 and outlines:
            held = [int(_inside(flat[ring], flat[one[0]]).sum()) for one in outlines]
            outlines[int(np.argmax(held))].append(ring)
    return outlines


def _inside(points: NDArray[np.float64], outline: NDArray[np.float64]) -> NDArray[np.bool_]:
    found = np.zeros(len(points), np.bool_)
    x, y = points.T
    for (x0, y0), (x1, y1) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if y0 != y1:
            found ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return found


def _turns(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the areas of triangles (T, 3, 2), negative of those that turn to the right."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _projected(points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """(n, 2): seen along the polygon's normal, turning to the left; None where it has no area."""
    away = points - points[0]
    size = float(np.abs(away).max())
    if not (np.isfinite(size) and size > 0):
        return None
    away = away / size
    turns = np.cross(away, np.roll(away, -1, axis=0))
    normal = turns.sum(axis=0)  # Newell 1972: twice the area
    if not np.linalg.norm(normal) > 1e-12:  # halves that cancel, as those of a bow tie
        normal = turns[np.argmax(np.linalg.norm(turns, axis=1))]
    length = float(np.linalg.norm(normal))
    if not length > 1e-12:
        return None
    normal = normal / length
    right = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    right /= np.linalg.norm(right)
    return np.stack([away @ right, away @ np.cross(normal, right)], axis=1)


def _area(flat: NDArray[np.float64]) -> float:
    x, y = flat.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
