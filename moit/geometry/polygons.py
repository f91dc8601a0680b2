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
    try:
        import mapbox_earcut as earcut
    except ImportError as error:
        raise ImportError(
            "a polygon that is not convex needs mapbox_earcut: pip install 'moit[mesh]' installs it"
        ) from error
    whole = abs(_area(flat))
    best: NDArray[np.int64] = np.zeros((0, 3), np.int64)
    least = np.inf
    # outlines that touch themselves may be cut wrongly from one corner on, and rightly from another
    for turned in range(min(len(flat), MOST_TRIES)):
        ring = np.ascontiguousarray(np.roll(flat, -turned, axis=0))
        ends = np.array([len(ring)], np.uint32)
        found = earcut.triangulate_float64(ring, ends).reshape(-1, 3).astype(np.int64)
        corners = ring[found]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        off = abs(float(np.abs(areas).sum()) / 2 - whole)
        if off < least:
            found = np.where(areas[:, None] < 0, found[:, ::-1], found)
            best, least = (found + turned) % len(flat), off
        if off <= 1e-9 * whole:
            break
    return best


MOST_TRIES = 8


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
