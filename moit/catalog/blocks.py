"""The option to keep states of blocks of pixels, not of each pixel."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from moit.catalog.options import each_depth, whole
from moit.catalog.reconstruction import WarpedDepth
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments
from moit.fragments.ranges import opaque_fragments

TOTALS = ("block", "full")
UPSAMPLINGS = ("bilinear", "depth-aware")


@dataclasses.dataclass(frozen=True, kw_only=True)
class InBlocks(WarpedDepth):
    """Options of techniques whose state can be that of a block of pixels.

    resolution : a side in pixels, from 1, of the blocks that have states of their own: the mean of
        their pixels', each of what its own opaque surface leaves. Between the middles of blocks
        states are interpolated. Blocks count from display coordinates (0, 0); at the edges of a
        crop they lack their neighbours.
    total : with a resolution above 1 "block": total absorbance is that of blocks, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        absorbance beside, to which what is read of blocks is scaled.
    upsampling : with a resolution above 1 "bilinear", or "depth-aware": beside that blocks count
        the more, the nearer their farthest opaque surface is to the pixel's, whose depths have to
        be positive (Kopf et al. 2007, csrc/kernels/upsampling.h). FLIP over 20 scenes is the same
        with it, or larger by 1 %: means of pixels know what lies behind nearer surfaces' edges.
    """

    resolution: int = 1
    total: str = "block"
    upsampling: str = "bilinear"

    def __post_init__(self) -> None:
        super().__post_init__()
        whole(self, "resolution", 1)
        one_of("total", self.total, TOTALS)
        check_upsampling(self.resolution, self.upsampling)
        if self.resolution == 1 and self.total == "full":
            raise ValueError(
                "total: expected 'block' with resolution=1, where each pixel has its own anyway, "
                "got 'full'"
            )
        if self.resolution > 1:
            one_by_one(self.resolution, self._not_in_blocks)

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        check_surfaces(f, self.upsampling)
        return super().fields_for(f)

    @property
    def _not_in_blocks(self) -> dict[str, bool]:
        """Whether options are set, as one writes them, with which a state is the pixel's own."""
        return {"depth_range='pixel'": self.range_per_pixel}

    @property
    def block_side(self) -> int:
        return self.resolution

    def _bits_in_blocks(self, state: int, total: int = 32) -> float:
        """Of a pixel, where a block's state and a pixel's total take so many."""
        if self.resolution == 1:
            return state
        return state / self.resolution**2 + (total if self.total == "full" else 0)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "resolution": self.resolution,
            "full_total": self.total == "full",
            "depth_aware": self.upsampling == "depth-aware",
        }


def check_upsampling(resolution: int, upsampling: str) -> None:
    """ValueError where `upsampling` is none, or nothing lies between blocks."""
    one_of("upsampling", upsampling, UPSAMPLINGS)
    if resolution == 1 and upsampling != "bilinear":
        raise ValueError(
            "upsampling: expected 'bilinear' with resolution=1, where nothing lies between blocks, "
            f"got {upsampling!r}"
        )


def check_surfaces(f: Fragments, upsampling: str) -> None:
    """FragmentsError where opaque surfaces have depths that upsampling cannot go by."""
    if upsampling == "depth-aware":
        good = (f.depth > 0) | ~opaque_fragments(f._arrays())
        each_depth(f, good, "positive depth of opaque surfaces for upsampling='depth-aware'")


def one_by_one(resolution: int, not_in_blocks: dict[str, bool]) -> None:
    """ValueError where an option is set with which states of blocks cannot be had."""
    for option, is_set in not_in_blocks.items():
        if is_set:
            raise ValueError(
                f"resolution: expected 1 with {option}, got {resolution}: states of blocks are "
                "means, interpolated, and are not the pixel's own"
            )
