"""From what images have at places back to their texels: csrc/kernels/texture.h and
csrc/core/textures.c read backwards."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.textures import Texture

Array = NDArray[Any]


def white(texture: Texture) -> Texture:
    """The same in white, of the same alpha."""
    texels = texture.texels.copy()
    texels[..., :3] = 1
    return Texture(texels, wrap=texture.wrap, filter=texture.filter)


def telling_levels(texture: Texture) -> Texture:
    """One whose colour is the level that it is read at, between two the share; alpha as it is."""
    told = dataclasses.replace(texture)
    levels = texture.levels.copy()
    sizes = _sizes(texture)
    levels[:, :3] = np.repeat(np.arange(len(sizes)), [h * w for h, w in sizes])[:, None]
    told.__dict__["levels"] = levels  # where the property keeps what it has computed
    return told


def to_texels(texture: Texture, place: Array, level: Array, by: Array) -> NDArray[np.float32]:
    """From derivatives by the image's colour and alpha at places, (N, 4), to those by its texels,
    (H, W, 4).

    place : (N, 2) u and v; level : (N,) as `telling_levels` tells it.
    """
    sizes = _sizes(texture)
    below = np.clip(np.floor(level), 0, len(sizes) - 1).astype(np.int64)
    share = level - below
    sums = []
    for k, size in enumerate(sizes):
        weight = np.where(below == k, 1 - share, np.where(below + 1 == k, share, 0))
        some = np.flatnonzero(weight)
        sums.append(_scattered(texture, size, place[some], by[some] * weight[some, None]))
    found = sums[-1]
    starts = np.cumsum([0, *(h * w for h, w in sizes)])
    for k in range(len(sizes) - 1, 0, -1):
        larger, smaller = (
            texture.levels[starts[i] : starts[i + 1]].reshape(*sizes[i], 4).astype(np.float64)
            for i in (k - 1, k)
        )
        found = sums[k - 1] + _to_larger(larger, smaller, found)
    return found.astype(np.float32)


def _sizes(texture: Texture) -> list[tuple[int, int]]:
    """(rows, columns) of each level."""
    height, width, _ = texture.texels.shape
    found = [(height, width)]
    while texture.filter == "mipmap" and found[-1] != (1, 1):
        found.append((max(found[-1][0] // 2, 1), max(found[-1][1] // 2, 1)))
    return found


def _scattered(texture: Texture, size: tuple[int, int], place: Array, by: Array) -> Array:
    """(rows, columns, 4): sums of what goes to each texel of a level."""
    rows, columns = size
    found = np.zeros((4, rows * columns))
    axes = [
        _taps(place[:, k], side, texture.wraps[k], texture.filter)
        for k, side in enumerate((columns, rows))
    ]
    for column, across in zip(*axes[0], strict=True):
        for row, along in zip(*axes[1], strict=True):
            for c in range(4):
                shares = by[:, c] * across * along
                found[c] += np.bincount(row * columns + column, shares, rows * columns)
    return found.T.reshape(rows, columns, 4)


def _taps(place: Array, size: int, wrap: str, filtering: str) -> tuple[list[Array], list[Array]]:
    """The texels along one axis that a place lies between, and their shares."""
    if wrap == "clamp":
        held = np.clip(place, 0, 1)
    else:
        held = place % (1 if wrap == "repeat" else 2)
    at = held * size
    if filtering == "nearest":
        return [_column(np.floor(at), size, wrap)], [np.ones(len(place))]
    low = np.floor(at - 0.5)
    share = at - 0.5 - low
    return [_column(low, size, wrap), _column(low + 1, size, wrap)], [1 - share, share]


def _column(i: Array, size: int, wrap: str) -> NDArray[np.int64]:
    if wrap == "repeat":
        i = i % size
    if wrap == "mirror":
        i = np.where(i < 0, 0, i)
        i = np.where(i > size - 1, 2 * size - 1 - i, i)
    return np.clip(i, 0, size - 1).astype(np.int64)


def _overlaps(larger: int, smaller: int) -> tuple[list[Array], list[Array]]:
    """Of each texel of the smaller side those of the larger that it covers, and their shares. It
    covers less than four; what is beyond the side has the share 0."""
    begin = np.arange(smaller) * larger
    first = begin // smaller
    at = [first + k for k in range(4)]
    shares = [
        np.clip(
            np.minimum((one + 1) * smaller, begin + larger) - np.maximum(one * smaller, begin),
            0,
            None,
        )
        / larger
        for one in at
    ]
    return at, shares


def _to_larger(larger: Array, smaller: Array, by: Array) -> Array:
    """From derivatives by a level to those by the one that it is means of: of alpha, and of colour
    by alpha, or where there is none as it is."""
    height, width, _ = larger.shape
    found, held = np.zeros((2, height + 4, width + 4, 4))
    held[:height, :width] = larger
    alpha = np.zeros(smaller.shape[:2])
    taps = [
        (row[:, None], column[None], along[:, None] * across[None])
        for row, along in zip(*_overlaps(height, smaller.shape[0]), strict=True)
        for column, across in zip(*_overlaps(width, smaller.shape[1]), strict=True)
    ]
    for row, column, share in taps:
        alpha += share * held[row, column, 3]
    seen = alpha > 0
    over = np.divide(1, alpha, out=np.zeros_like(alpha), where=seen)
    for row, column, share in taps:
        texel = held[row, column]
        counts = np.where(seen, texel[..., 3] * over, 1)
        # no two texels of the smaller level have one of the larger as their k-th
        found[row, column, :3] += (share * counts)[..., None] * by[..., :3]
        moved = ((texel[..., :3] - smaller[..., :3]) * by[..., :3]).sum(axis=-1)
        found[row, column, 3] += share * (by[..., 3] + moved * over)
    inner: Array = found[:height, :width]
    return inner
