"""Blocks of pixels that have states of their own."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments.fragments import Fragments
from moit.fragments.squares import Squares, squares_of


@dataclasses.dataclass(frozen=True)
class Blocks(Squares):
    """Which pixels of an image blocks take, and which fragments of these.

    taken : (blocks + 1,), of a block its pixels among those taken.
    offsets : (pixels taken + 1,), of a pixel its fragments in `fragment`.
    fragment : places in the arrays of the fragments.
    """

    taken: NDArray[np.int64]
    offsets: NDArray[np.int64]
    fragment: NDArray[np.int64]


def blocks_of(
    f: Fragments,
    side: int,
    average: bool,
    opaque: NDArray[np.bool_] | None,
    kept: NDArray[np.bool_] | None = None,
) -> Blocks:
    """average : blocks take all of their pixels, not only the one at their middle.

    opaque : (N,), surfaces that hide what is behind them: of a block what lies behind the farthest
        of its pixels' nearest, if all have one, is left out, and so are they. None: none do.
    kept : (N,), fragments that blocks take; None: all.
    """
    height, width = f.shape
    squares = squares_of(f, side)
    top, left, across, down = squares.top, squares.left, squares.across, squares.down
    block = _block_of(f, side, across)
    if average:
        pixel = np.argsort(block, kind="stable")
    else:
        middle_y = np.clip(np.arange(down) * side - top + side // 2, 0, height - 1)
        middle_x = np.clip(np.arange(across) * side - left + side // 2, 0, width - 1)
        pixel = (middle_y[:, None] * width + middle_x).ravel()
    taken = np.searchsorted(
        np.sort(block) if average else np.arange(across * down), np.arange(across * down + 1)
    )
    counts = np.diff(f.offsets)[pixel]
    begin = np.concatenate([[0], np.cumsum(counts)])
    fragment = np.arange(begin[-1]) + np.repeat(f.offsets[pixel] - begin[:-1], counts)
    if kept is not None:
        begin = np.concatenate([[0], np.cumsum(kept[fragment])])[begin]
        fragment = fragment[kept[fragment]]
    if opaque is not None:
        _, farthest = _surfaces(f, opaque, block, across * down)
        of_block = np.repeat(np.repeat(np.arange(across * down), np.diff(taken)), counts)
        stays = ~opaque[fragment] & (f.depth[fragment] <= farthest[of_block])
        begin = np.concatenate([[0], np.cumsum(stays)])[begin]
        fragment = fragment[stays]
    return Blocks(side, left, top, across, down, taken, begin, fragment)


def _block_of(f: Fragments, side: int, across: int) -> NDArray[np.intp]:
    """(pixels,) the block of each."""
    height, width = f.shape
    top, left = (origin % side for origin in f.origin)
    y, x = np.divmod(np.arange(height * width), max(width, 1))
    block: NDArray[np.intp] = (y + top) // side * across + (x + left) // side
    return block


def _surfaces(
    f: Fragments, opaque: NDArray[np.bool_], block: NDArray[np.intp], blocks: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Depths of opaque surfaces: of each pixel the nearest, infinite where there is none, and of
    each block the farthest of these."""
    nearest = np.full(block.size, np.inf)
    owner = np.repeat(np.arange(block.size), np.diff(f.offsets))
    np.minimum.at(nearest, owner[opaque], f.depth[opaque].astype(np.float64))
    farthest = np.full(blocks, -np.inf)
    np.maximum.at(farthest, block, nearest)
    return nearest, farthest


def guides_of(
    f: Fragments, b: Squares, opaque: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Depths of opaque surfaces by which shares of blocks go, (pixels,) and (blocks,), all positive
    and finite; None where there are none to go by."""
    block = _block_of(f, b.side, b.across)
    nearest, farthest = _surfaces(f, opaque, block, b.across * b.down)
    most = farthest[np.isfinite(farthest)].max(initial=0.0)
    if most <= 0:
        return None
    return np.clip(nearest, 2.0**-1000, 2 * most), np.minimum(farthest, 2 * most)


def opaque_and_net(f: Fragments, threads: int) -> tuple[NDArray[np.bool_], NDArray[Any]]:
    """Of all fragments: whether nothing gets through, and net coverage."""
    _, _, opacity, net = _core.surviving(f, False, threads)
    if opacity is None or net is None:
        return f.alpha == 1, f.alpha
    return (opacity == 1).all(axis=1), net
