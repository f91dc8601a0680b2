"""Panes of glass that all examples draw, and the picture that moit makes of them."""

from __future__ import annotations

import numpy as np

import moit

WIDTH, HEIGHT = 96, 64
NEAR, FAR = 1.0, 50.0
BACKGROUND = (0.1, 0.2, 0.3)


def panes(count: int = 24, seed: int = 1) -> np.ndarray:
    """(count, 9): x and y of two corners in pixels, depth, alpha, and a colour, linear."""
    random = np.random.default_rng(seed)
    x = np.sort(random.integers(0, WIDTH + 1, (count, 2)), axis=1)
    y = np.sort(random.integers(0, HEIGHT + 1, (count, 2)), axis=1)
    depth = np.geomspace(1.2 * NEAR, FAR / 1.2, count)[random.permutation(count)]
    alpha, color = random.uniform(0.15, 0.85, count), random.uniform(0, 1, (count, 3))
    corners = [x[:, 0], y[:, 0], x[:, 1], y[:, 1]]
    return np.column_stack([*corners, depth, alpha, color]).astype(np.float32)


def vertices(found: np.ndarray) -> np.ndarray:
    """(6 a pane, 7): x and y of clip space, where y goes up, depth, alpha, colour."""
    x0, y0, x1, y1 = found[:, :4].T
    corners = [(x0, y0), (x1, y0), (x0, y1), (x0, y1), (x1, y0), (x1, y1)]
    rows = [
        np.column_stack([2 * x / WIDTH - 1, 1 - 2 * y / HEIGHT, found[:, 4:]]) for x, y in corners
    ]
    return np.stack(rows, axis=1).reshape(-1, 7).astype(np.float32)


def reference(technique: str, found: np.ndarray) -> np.ndarray:
    """What moit's core makes of the same, (HEIGHT, WIDTH, 3)."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].reshape(2, -1, 1)
    x0, y0, x1, y1, depth, alpha = found[:, :6].T
    inside = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
    pane = np.nonzero(inside)[1]
    fragments = moit.Fragments(
        np.concatenate([[0], np.cumsum(inside.sum(1))]),
        depth[pane],
        alpha[pane],
        found[pane, 6:],
        shape=(HEIGHT, WIDTH),
        depth_range=(NEAR, FAR),
    )
    picture = moit.composite(fragments, technique, background=BACKGROUND)
    return picture[..., :3]
