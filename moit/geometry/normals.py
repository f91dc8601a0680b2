"""Normals of triangles, and of vertices that have none of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def facet_normals(corners: Array) -> NDArray[np.float64]:
    """(T, 3) normals of triangles (T, 3, 3), as long as twice their areas."""
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def smooth_normals(vertices: Array, triangles: Array) -> NDArray[np.float64]:
    """(V, 3), of length 1 or 0: means of the facets round each vertex by the angles they have
    there (Thuermer and Wuethrich 1998), so that no cut into triangles changes them.
    """
    corners = vertices[triangles].astype(np.float64)
    facets = facet_normals(corners)
    length = np.linalg.norm(facets, axis=1, keepdims=True)
    facets = np.divide(facets, length, out=np.zeros_like(facets), where=length > 0)
    sums = np.zeros((len(vertices), 3))
    for k in range(3):
        a = corners[:, (k + 1) % 3] - corners[:, k]
        b = corners[:, (k + 2) % 3] - corners[:, k]
        size = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        cosine = np.einsum("ij,ij->i", a, b) / np.where(size > 0, size, 1)
        angle = np.arccos(np.clip(cosine, -1, 1))
        for axis in range(3):
            sums[:, axis] += np.bincount(triangles[:, k], angle * facets[:, axis], len(vertices))
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    found: NDArray[np.float64] = np.divide(sums, length, out=np.zeros_like(sums), where=length > 0)
    return found
