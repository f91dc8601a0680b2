"""Places for names beside the markers of a plot: they cover neither each other nor markers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MARKER = 3.6  # half a marker's side
LEADER = 5.0  # farther away than this a label gets a line to its marker
GAP = 1.5  # between two labels
DISTANCES = (0.0, 3.0, 7.0, 12.0, 18.0, 25.0, 34.0, 45.0, 58.0, 74.0)  # in points
NEAR = 26.0  # what is not strong is no farther away
DIRECTIONS = 16
CROSSING = 30.0  # points of distance that are as bad as a leader across another thing


def place(
    points: Array, sizes: Array, box: Array, farthest: Array, others: Array | None = None
) -> list[tuple[float, float] | None]:
    """(x, y) of the lower left corner of each label; None where it has no room.

    points : (N, 2) what is labelled. sizes : (N, 2) width and height of the labels.
    box : (x0, y0, x1, y1) within which labels have to be.
    farthest : (N,) how far from its marker a label may be.
    others : (M, 2) markers without a label. All in points.

    Each takes the place that is nearest to its marker, right of it rather than left, among those
    that are free of markers and of earlier labels.
    """
    turns = 2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    u = np.stack([np.cos(turns), np.sin(turns)], 1)
    away = np.repeat(DISTANCES, DIRECTIONS)
    u = np.tile(u, (len(DISTANCES), 1))
    toward = np.clip(1.6 * u, -1, 1)  # which side or corner of the label is next to the marker
    preference = away + 1.5 * (1 - u[:, 0]) + 0.5 * (1 - u[:, 1])
    marked = points if others is None else np.concatenate([points, others])
    markers = np.concatenate([marked - MARKER, marked + MARKER], 1)
    taken = np.empty((0, 4))
    lines = np.empty((0, 4))
    found: list[tuple[float, float] | None] = []
    for i, (point, size) in enumerate(zip(points, sizes, strict=True)):
        middle = point + (MARKER + 1 + away)[:, None] * u + toward * size / 2
        rooms = np.concatenate([middle - size / 2, middle + size / 2], 1)
        inside = (rooms[:, :2] >= box[:2]).all(1) & (rooms[:, 2:] <= box[2:]).all(1)
        inside &= away <= farthest[i]
        grown = rooms + GAP * np.array([-1, -1, 1, 1]) / 2
        free = inside & ~_overlap(grown, markers).any(1) & ~_overlap(grown, taken).any(1)
        if not free.any():
            found.append(None)
            continue
        rooms, cost = rooms[free], preference[free]
        ends = np.clip(point, rooms[:, :2], rooms[:, 2:])
        own = np.concatenate([np.broadcast_to(point, ends.shape), ends], 1)
        things = np.concatenate([np.delete(markers, i, 0), taken])
        crossed = _touch(own, things).sum(1) + _cross(own, lines).sum(1)
        crossed = crossed + _touch(lines, rooms).sum(0)
        best = int(np.argmin(cost + CROSSING * crossed))
        found.append((float(rooms[best, 0]), float(rooms[best, 1])))
        taken = np.concatenate([taken, rooms[best : best + 1]])
        lines = np.concatenate([lines, own[best : best + 1]])
    return found


def _overlap(a: Array, b: Array) -> NDArray[np.bool_]:
    """(A, B) which boxes overlap which."""
    apart = (a[:, None, :2] >= b[None, :, 2:]) | (a[:, None, 2:] <= b[None, :, :2])
    return np.asarray(~apart.any(2))


def _touch(lines: Array, boxes: Array) -> NDArray[np.bool_]:
    """(L, B) which lines (x0, y0, x1, y1) go through which boxes."""
    start, along = lines[:, None, :2], lines[:, None, 2:] - lines[:, None, :2]
    along = np.where(np.abs(along) < 1e-9, 1e-9, along)
    one, other = (boxes[None, :, :2] - start) / along, (boxes[None, :, 2:] - start) / along
    enter, leave = np.minimum(one, other).max(2), np.maximum(one, other).min(2)
    return np.asarray(np.maximum(enter, 0) < np.minimum(leave, 1))


def _cross(a: Array, b: Array) -> NDArray[np.bool_]:
    """(A, B) which lines cross which."""

    def side(line: Array, x: Array, y: Array) -> Array:
        return (line[..., 2] - line[..., 0]) * (y - line[..., 1]) - (
            line[..., 3] - line[..., 1]
        ) * (x - line[..., 0])

    p, q = a[:, None], b[None]
    apart = side(p, q[..., 0], q[..., 1]) * side(p, q[..., 2], q[..., 3]) < 0
    apart &= side(q, p[..., 0], p[..., 1]) * side(q, p[..., 2], p[..., 3]) < 0
    return np.asarray(apart)
