"""Kits whose moments are of blocks of pixels, against the core: texels as small targets have them,
made by the text, and read between by it."""

from __future__ import annotations

import numpy as np

import moit
from readings import kits

WIDTH = 40  # of a picture of a case's pixels, row by row; the last blocks are cut


class Picture:
    """A case's pixels in rows."""

    def __init__(self, case, side: int) -> None:
        self.case, self.side, self.width = case, side, WIDTH
        self.height = (len(case.offsets) - 1) // WIDTH
        self.pixels = self.height * WIDTH
        self.fragments_there = int(case.offsets[self.pixels])
        across, down = -(-WIDTH // side), -(-self.height // side)
        self.texels = np.array([across, down])
        middle = np.arange(max(across, down)) * side + side // 2
        column, row = np.minimum(middle, WIDTH - 1), np.minimum(middle, self.height - 1)
        # the pixel whose numbers a texel has
        self.of_texel = (row[:down, None] * WIDTH + column[:across]).ravel()

    def fragments(self, dtype=np.float64) -> moit.Fragments:
        c, n = self.case, self.fragments_there
        return moit.Fragments(
            c.offsets[: self.pixels + 1],
            *(one[:n].astype(dtype) for one in (c.depth, c.alpha, c.color)),
            shape=(self.height, WIDTH),
            depth_range=(0.1, 1000.0),
        )

    def between(self, technique, language: str) -> tuple[np.ndarray, np.ndarray]:
        """The first texel that each pixel lies between, and the shares of four."""
        place = np.arange(self.pixels)
        return kits.texels(technique, language, np.stack([place % WIDTH, place // WIDTH], 1))

    def means(self, each: np.ndarray) -> np.ndarray:
        """(T, k): of blocks' pixels (P, k)."""
        place = np.arange(self.pixels)
        row, column = place // WIDTH // self.side, place % WIDTH // self.side
        block = row * self.texels[0] + column
        found = np.zeros((self.texels.prod(), each.shape[1]))
        np.add.at(found, block, each[: self.pixels].astype(np.float64))
        return (found / np.bincount(block)[:, None]).astype(np.float32)

    def read(self, technique, language: str, texels: np.ndarray, struct: str, between, own=None):
        """(P, k): what pixels read of texels (T, k); own: (P,) of their totals, to scale it to."""
        first, shares = between
        low = np.minimum(first, self.texels - 1)
        high = np.minimum(first + 1, self.texels - 1)
        corners = [(low[:, 0], low[:, 1]), (high[:, 0], low[:, 1])]
        corners += [(low[:, 0], high[:, 1]), (high[:, 0], high[:, 1])]
        found = np.stack([texels[y * self.texels[0] + x] for x, y in corners], 1)
        return kits.read_between(technique, language, found, shares, struct, own)


def through(technique, language: str, case) -> tuple[np.ndarray, Picture]:
    """Transmittance of fragments of such a picture, by the text."""
    kit = kits.include(technique, language)
    picture = Picture(case, kit.side)
    n = picture.fragments_there
    pixel, alpha = case.pixel[:n], case.alpha[:n]
    depths = kits.warped(technique, language, case.depth)
    z, between = depths[:n], picture.between(technique, language)
    each = case.summed(kits.accumulated(technique, language, case.depth, case.alpha))
    texels = picture.means(each) if kit.means else each[picture.of_texel]
    own = each[: picture.pixels, -1] if kit.own_total else None
    sums = picture.read(technique, language, texels, "sums", between, own)[pixel]
    if not kit.second:
        return kits.through(technique, language, sums, z, alpha), picture
    own = each[case.pixel]  # as fragments of a texel's own have it
    terms = kits.accumulated_second(technique, language, own, depths, case.alpha)
    texels = case.summed(terms)[picture.of_texel]
    seconds = picture.read(technique, language, texels, "seconds", between)[pixel]
    return kits.through_second(technique, language, sums, seconds, z, alpha), picture


def shares_anywhere(technique, language: str, count: int) -> np.ndarray:
    """(count, 4): of four texels, that pixels have somewhere in large pictures."""
    pixel = np.random.default_rng(5).integers(0, 4000, (count, 2))
    return kits.texels(technique, language, pixel)[1]


def read_alike(technique, language: str, numbers: np.ndarray, struct: str, shares) -> np.ndarray:
    """(n, k): what pixels read where all four texels have the same (n, k)."""
    four = np.repeat(numbers[:, None], 4, axis=1)
    return kits.read_between(technique, language, four, shares, struct)
