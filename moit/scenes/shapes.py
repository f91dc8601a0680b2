"""Shapes that scenes are made of, as the fragments that a rasteriser would produce.

The camera looks along +z: a point (x, y, z) is seen at (u, v) = FOCAL (x, y) / z, and the shorter
side of the picture spans [-1, 1]. Everything is computed at pixel centres from formulas, so that
a picture of another size shows the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

FOCAL = 2.0
NEAR = 0.1


@dataclass(frozen=True)
class Drawn:
    """Fragments in the order in which they were drawn: arguments of Fragments.from_pixels."""

    pixel: Array
    depth: Array
    alpha: Array
    color: Array
    transmission: Array | None = None


def joined(parts: Iterable[Drawn]) -> Drawn:
    """All of the parts, at least one, one after the other; float32. Transmission that only some
    have is 0 in the others."""
    parts = list(parts)
    pixel, depth, alpha, color = zip(
        *((part.pixel, part.depth, part.alpha, part.color) for part in parts), strict=True
    )
    transmission = None
    if any(part.transmission is not None for part in parts):
        transmission = np.concatenate(
            [np.zeros_like(p.color) if p.transmission is None else p.transmission for p in parts],
            dtype=np.float32,
        )
    return Drawn(
        np.concatenate(pixel),
        np.concatenate(depth, dtype=np.float32),
        np.concatenate(alpha, dtype=np.float32),
        np.concatenate(color, dtype=np.float32),
        transmission,
    )


class View:
    """The pixels of a picture, or of the columns [left, left + width) of one.

    u (1, width) to the right and v (height, 1) up are those of pixel centres; pixel
    (height, width) are the indices.
    """

    def __init__(self, width: int, height: int, left: int = 0, stride: int | None = None) -> None:
        self.width, self.height, self.left = width, height, left
        self.stride = width if stride is None else stride
        self.side = min(width, height)
        self.u = ((2 * np.arange(width) + 1 - width) / self.side)[None, :]
        self.v = ((height - 1 - 2 * np.arange(height)) / self.side)[:, None]
        self.pixel = np.arange(height)[:, None] * self.stride + left + np.arange(width)


@dataclass(frozen=True)
class Hit:
    """Where rays of a view meet a shape: pixels, depths, and two coordinates on the shape."""

    pixel: Array
    depth: Array
    p: Array
    q: Array

    def where(self, mask: Array) -> Hit:
        return Hit(self.pixel[mask], self.depth[mask], self.p[mask], self.q[mask])

    def drawn(self, alpha: Array | float, color: Array, transmission: Array | None = None) -> Drawn:
        """With a colour (3,) or (n, 3), a transmission like it, and an alpha or one each."""
        count = len(self.pixel)
        return Drawn(
            self.pixel,
            self.depth,
            np.broadcast_to(np.asarray(alpha), count),
            np.broadcast_to(color, (count, 3)),
            None if transmission is None else np.broadcast_to(transmission, (count, 3)),
        )


def rectangle(view: View, center: Array, right: Array, up: Array) -> Hit:
    """A rectangle with the half sides right and up, along which p and q go from -1 to 1."""
    normal = np.cross(right, up)
    x, y = view.u / FOCAL, view.v / FOCAL  # the ray is z (x, y, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (normal @ center) / (normal[0] * x + normal[1] * y + normal[2])
        p = (z * (right[0] * x + right[1] * y + right[2]) - right @ center) / (right @ right)
        q = (z * (up[0] * x + up[1] * y + up[2]) - up @ center) / (up @ up)
        met = (z > NEAR) & (np.abs(p) <= 1) & (np.abs(q) <= 1)
    return Hit(view.pixel[met], z[met], p[met], q[met])


def facing_disc(view: View, center: Array, radius: float) -> Hit:
    """A disc that faces the camera; (p, q) has length 1 at its edge."""
    x, y, z = center
    scale = FOCAL / z
    rows = _within(-view.v[:, 0], -scale * (y + radius), -scale * (y - radius))
    columns = _within(view.u[0], scale * (x - radius), scale * (x + radius))
    p, q = np.broadcast_arrays(
        (view.u[:, columns] / scale - x) / radius, (view.v[rows] / scale - y) / radius
    )
    met = p * p + q * q < 1
    p, q = p[met], q[met]
    return Hit(view.pixel[rows, columns][met], np.full(len(p), z), p, q)


def _within(increasing: Array, low: float, high: float) -> slice:
    return slice(*np.searchsorted(increasing, (low, high)).tolist())


def sphere(view: View, center: Array, radius: float) -> tuple[Hit, Hit]:
    """A sphere's back and front; (p, q) are x and y of the normal that points outwards."""
    x, y = view.u / FOCAL, view.v / FOCAL
    a = x * x + y * y + 1
    b = x * center[0] + y * center[1] + center[2]
    discriminant = b * b - a * (center @ center - radius**2)
    met = discriminant > 0
    x, y = (np.broadcast_to(c, met.shape)[met] for c in (x, y))
    root, a, b = np.sqrt(discriminant[met]), a[met], b[met]
    far, near = (
        Hit(view.pixel[met], z, (z * x - center[0]) / radius, (z * y - center[1]) / radius)
        for z in ((b + root) / a, (b - root) / a)
    )
    return far, near


def strands(
    view: View, center: Array, width: float, depth: Array, alpha: float, color: Array
) -> Drawn:
    """Ribbons of one width and alpha that are curves u(v).

    center, depth : (strands, height), where each row meets the middle of each strand.
    color : (strands, height, 3).
    """
    edges = np.stack([center - width / 2, center + width / 2])
    columns = np.ceil((edges * view.side + view.width - 1) / 2)
    first, last = np.clip(columns, 0, view.width).astype(np.int64).reshape(2, -1)
    counts = last - first
    ends = np.cumsum(counts)
    begin = np.tile(np.arange(view.height) * view.stride, len(center)) + view.left + first
    pixel = np.repeat(begin - (ends - counts), counts) + np.arange(ends[-1])
    return Drawn(
        pixel,
        np.repeat(depth.ravel(), counts),
        np.full(len(pixel), alpha, np.float32),
        np.repeat(color.reshape(-1, 3), counts, axis=0),
    )


def paint(hue: float, saturation: float, value: float) -> Array:
    """(3,) linear RGB of a hue in turns, red first, and of saturation and value in [0, 1]."""
    wheel = np.clip(np.abs((hue + np.array([0, 2, 1]) / 3) % 1 * 6 - 3) - 1, 0, 1)
    return np.asarray((value * (1 - saturation * (1 - wheel))) ** 2.2)


def rotation(yaw: float, pitch: float) -> tuple[Array, Array]:
    """The directions right and up of what is turned to the right, then leans back; radians."""
    right = np.array([np.cos(yaw), 0, np.sin(yaw)])
    up = np.array([-np.sin(yaw) * np.sin(pitch), np.cos(pitch), np.cos(yaw) * np.sin(pitch)])
    return right, up
