"""Slices of optical depth, placed where anything is."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np

from moit.catalog.blocks import check_surfaces, check_upsampling
from moit.catalog.options import names_of, whole, within
from moit.catalog.reconstruction import WarpedDepth
from moit.catalog.targets import SliceWords, Targets, added, held_in, multiplied
from moit.checks.arguments import one_of
from moit.fragments.fragments import Fragments
from moit.fragments.squares import squares_of

TABLES = names_of("TABLE")
TOTALS = ("block", "byte", "half", "full")
INSIDE = (None, "power4")
# Of each of TABLES how many cells it has where none are said: an image's costs nothing.
CELLS = {"image": 2048, "tile": 512, "pixel": 256}
CELL_COUNTS = tuple(64 << k for k in range(8))
MOST_SIDE = 1024  # of blocks and squares
ENTRY_BYTES = 8  # of one cell of a table while slices are read (moit_slice_entry)
MOST_TABLE_BYTES = 1 << 32  # of all tables of an image together
MOMENT_BITS = 5 * 32  # of power4
BYTE = 8  # of what is multiplied up
PUBLISHED_BIAS = {"linear": 2.0, "cubic": 2.5}  # of filters, in slices


def codes_of(bits: int) -> tuple[float, float]:
    """Of a slice the largest code, and the optical depth that it stands for (slice_tables.c)."""
    return float((1 << bits) - 1), 5.5412635451584258 if bits == 8 else bits * math.log(2)


def shares_no_range(resolution: int, depth_range: str) -> None:
    """ValueError where blocks would share slices of pixels' own ranges of depth."""
    if resolution > 1 and depth_range == "pixel":
        raise ValueError(
            f"resolution: expected 1 with depth_range='pixel', got {resolution}: blocks share "
            "depths"
        )


@dataclasses.dataclass(frozen=True)
class AdaptiveVoxels(WarpedDepth):
    """Optical depth in slices of a picture of an eighth of the size, as published (AVBOIT).

    Depth is cut into cells, and slices stand where anything is in the image. A block of pixels adds
    the optical depth of its fragments to slices, as codes of few bits; summed up from front to back
    they become the light behind each slice, in a byte. Fragments read it some slices nearer than
    they are, as what they have added themselves is not to dim them.

    Its troubles are dials of `moit.stability`: "thin" shows what is less than half a step and lost,
    "overflow" slices that hold no more, "adjacent" neighbours passed over by the slices that light
    is read nearer, "screen" opacity that a smaller picture shows otherwise, "tilted" surfaces that
    darken themselves, "moving" jumps between slices, and the column "brightness", with
    normalize=False, weights that do not sum to what is covered. Here overflow is that of a slice's
    whole sum, the same in any order.

    count : 2 to 256 slices; there are fewer cells with anything, or cells are joined by twos.
    bits : 8 or 16 of a slice. Half a step of 8 is 0.011 of optical depth: what adds less to each
        of its two slices, as a surface of up to 4 % opacity does between them, is lost. A slice
        that would have more than 5.5, or with 16 bits 11, lets nothing through, nor do later ones.
    resolution : a side in pixels of the blocks, from 1. Light is bilinear between blocks.
    slice_bias : from 0 to 8 slices that fragments read nearer than they are; None: as published, 2,
        and with the cubic filter 2.5. It is applied before empty cells are left out, so that it
        may fall in another layer's slices, or in none.
    filter : of the light between slices and blocks: "linear", or "cubic", a B-spline of 64 values,
        smoother and with each layer spread wider. With resolution=1 it is along depth alone.
    low_resolution : a block has "raster", what the pixel at its middle has, as a smaller render
        target would, or "average", the mean of its pixels.
    cells : that depth is cut into, a power of two from 64 to 8192.
    warp, depth_range, normalize, max_alpha : as `moit.Slices` has them. The paper's depth is
        log(1 + z / a), which is even near the eye.

    What reaches the background is the product of 1 - alpha, as published a sum of optical depths
    of each pixel. Not here: coloured extinction.

    Drobot, "Adaptive Voxel-Based Order-Independent Transparency", SIGGRAPH 2025, Advances in
    Real-Time Rendering in Games.

    Raises ValueError and TypeError for options that are none.

    >>> str(moit.AdaptiveVoxels())
    'avboit'
    """

    count: int = 128
    bits: int = 8
    resolution: int = 8
    slice_bias: float | None = dataclasses.field(default=None, kw_only=True)
    filter: str = dataclasses.field(default="linear", kw_only=True)
    low_resolution: str = dataclasses.field(default="raster", kw_only=True)
    cells: int = dataclasses.field(default=8192, kw_only=True)

    kind: ClassVar[str] = "avboit"
    family: ClassVar[str] = "curves, series"
    source: ClassVar[str] = "Drobot 2025"
    papers: ClassVar[tuple[str, ...]] = ("drobot2025",)

    def __post_init__(self) -> None:
        whole(self, "count", 2, 256)
        one_of("bits", self.bits, (8, 16))
        whole(self, "resolution", 1, MOST_SIDE)
        if self.slice_bias is not None:
            within(self, "slice_bias", 0, 8)
        one_of("filter", self.filter, tuple(PUBLISHED_BIAS))
        one_of("low_resolution", self.low_resolution, ("raster", "average"))
        one_of("cells", self.cells, CELL_COUNTS)
        super().__post_init__()
        shares_no_range(self.resolution, self.depth_range)

    @property
    def bits_per_pixel(self) -> float | None:
        """Slices, whose place the light behind them takes, and a byte of total."""
        return self.count * self.bits / self.resolution**2 + BYTE + self._extent_bits

    @property
    def local(self) -> bool:
        return False

    @property
    def block_side(self) -> int:
        return self.resolution

    @property
    def draws_blocks(self) -> bool:
        return self.low_resolution == "raster"

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.count,
            "bits": self.bits,
            "cells": self.cells,
            "resolution": self.resolution,
            "slice_bias": PUBLISHED_BIAS[self.filter]
            if self.slice_bias is None
            else self.slice_bias,
            "cubic": self.filter == "cubic",
            "average": self.low_resolution == "average",
        }

    def shipped_to(self) -> Targets | None:
        words = SliceWords(self.count, self.cells, self.draws_blocks)
        return Targets(shaded=added("16f", multiplied("r8")), words=words)


@dataclasses.dataclass(frozen=True)
class Slices(WarpedDepth):
    """Optical depth along the ray in slices, whole numbers that are added up: ours.

    Depth is cut into cells, and slices stand at the borders of those that have anything in them, in
    the image, in a square of pixels or in a pixel. A fragment adds its optical depth, in steps, to
    the two slices of its cell. What lies in front of it is read in the middle of slices, and its
    own share, known exactly, is taken out: it does not occlude itself, coincident fragments share
    evenly, and what is two slices away counts exactly. Sums are of whole numbers: transmittances
    are the same bits in any order of arrival, but within moments.

    count : 2 to 256 slices.
    bits : 2 to 16 of a slice: of 8 steps of 0.022 of optical depth up to 5.5, of 16 steps of
        0.00017 up to 11. A slice that would have more has its most, in any order. Fractions of
        steps are dropped or made whole by pixel and cell, so that thin layers count right in the
        mean. While fragments are added slices have 32 bits.
    table : what has its own places of slices: "image"; "tile", a square of pixels; "pixel", or
        where several share slices, their block.
    tile : a side of these squares in pixels, a multiple of the resolution.
    cells : that depth is cut into, a power of two from 64 to 8192; None: 2048 in an image, 512 in a
        square, 256 in a pixel, whose bits of what is in which count. They are joined as far as
        there are too few slices.
    resolution : a side in pixels, from 1, of blocks that share slices. What pixels read lies
        bilinearly between the blocks around them. Blocks count from display coordinates (0, 0);
        at the edges of a crop they lack their neighbours.
    total : where blocks share slices, "full", or "half" as a half float, or "byte" as its ratio to
        the block's, six digits of eight octaves: each pixel has its own total beside, which what is
        read of blocks is scaled to, and blocks whose totals are as its own count more; "block": it
        has not.
    upsampling : where blocks share slices "bilinear", or "depth-aware": beside that blocks count
        the more, the nearer their farthest opaque surface is to the pixel's, whose depths have to
        be positive.
    inside : "power4": transmittance is held within what four power moments of each pixel prove.
        Where blocks share slices it is read as far between these bounds as the slices stand between
        those that moments of the slices prove.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [0, 1] already.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each pixel's
        own extent, at resolution 1 only.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    With resolution 1 `moit.bounds` are of the slices themselves: what is in slices before a
    fragment's cell is in front of it, and nothing behind its cell is.

    Raises ValueError and TypeError for options that are none, and ValueError for an image whose
    tables of squares or blocks, 8 bytes a cell while they are read, have more than 4 GiB. The
    storage is that of Drobot, "Adaptive Voxel-Based Order-Independent Transparency", SIGGRAPH 2025.

    >>> str(moit.Slices(64, resolution=4, total="full"))
    "slices64(resolution=4,total='full')"
    """

    count: int = 64
    bits: int = 8
    table: str = "image"
    tile: int = dataclasses.field(default=16, kw_only=True)
    cells: int | None = dataclasses.field(default=None, kw_only=True)
    resolution: int = dataclasses.field(default=1, kw_only=True)
    total: str = dataclasses.field(default="block", kw_only=True)
    upsampling: str = dataclasses.field(default="bilinear", kw_only=True)
    inside: str | None = dataclasses.field(default=None, kw_only=True)

    kind: ClassVar[str] = "slices"
    counted: ClassVar[str] = "count"
    usual: ClassVar[int] = 64
    family: ClassVar[str] = "curves, series"
    source: ClassVar[str] = "ours; storage of Drobot 2025"
    papers: ClassVar[tuple[str, ...]] = ("drobot2025",)

    def __post_init__(self) -> None:
        whole(self, "count", 2, 256)
        whole(self, "bits", 2, 16)
        one_of("table", self.table, TABLES)
        whole(self, "tile", 1, MOST_SIDE)
        if self.cells is not None:
            one_of("cells", self.cells, CELL_COUNTS)
        whole(self, "resolution", 1, MOST_SIDE)
        one_of("total", self.total, TOTALS)
        one_of("inside", self.inside, INSIDE)
        check_upsampling(self.resolution, self.upsampling)
        super().__post_init__()
        if self.table == "tile" and self.tile % self.resolution:
            raise ValueError(
                f"tile: expected a multiple of the resolution {self.resolution}, got {self.tile}"
            )
        shares_no_range(self.resolution, self.depth_range)
        if self.resolution == 1 and self.total != "block":
            raise ValueError(
                "total: expected 'block' with resolution=1, where each pixel has its own anyway, "
                f"got {self.total!r}"
            )

    @property
    def _cells(self) -> int:
        return CELLS[self.table] if self.cells is None else self.cells

    @property
    def bits_per_pixel(self) -> float | None:
        """Slices, what is in which cell, and a total where blocks share slices, or moments, which
        have one."""
        blocks = self.resolution**2
        marks = {"image": 0.0, "tile": self._cells / self.tile**2, "pixel": self._cells / blocks}
        own_total = (
            0 if self.inside else {"block": 0, "byte": 8, "half": 16, "full": 32}[self.total]
        )
        return (
            self.count * self.bits / blocks
            + marks[self.table]
            + own_total
            + (MOMENT_BITS if self.inside else 0)
            + self._extent_bits
        )

    @property
    def local(self) -> bool:
        return self.resolution == 1 and self.table == "pixel"

    @property
    def block_side(self) -> int:
        return self.resolution

    @property
    def table_side(self) -> int:
        """A side in pixels of what has a table of its own; 0: the image is one."""
        return {"image": 0, "tile": self.tile, "pixel": self.resolution}[self.table]

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        check_surfaces(f, self.upsampling)
        if self.table_side > 1:  # of single pixels one is made after the other
            tables = squares_of(f, self.table_side).count
            size = tables * self._cells * ENTRY_BYTES
            if size > MOST_TABLE_BYTES:
                raise ValueError(
                    f"cells: {self} has {tables} tables of {self._cells} cells in an image of "
                    f"{f.shape[0]} x {f.shape[1]} pixels, {size / 2**30:.1f} GiB while it is read; "
                    f"at most {MOST_TABLE_BYTES / 2**30:.1f} are made: take fewer cells, or larger "
                    "squares"
                )
        return super().fields_for(f)

    @property
    def excludes_self(self) -> bool:
        return True

    @property
    def thick_cells(self) -> tuple[int, float]:
        most, depth = codes_of(self.bits)
        return self._cells, depth / most

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.count,
            "bits": self.bits,
            "table": TABLES.index(self.table),
            "tile": self.tile,
            "cells": self._cells,
            "resolution": self.resolution,
            "full_total": self.total != "block",
            "half_total": self.total == "half",
            "byte_total": self.total == "byte",
            "depth_aware": self.upsampling == "depth-aware",
            "inside": self.inside is not None,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        if self.inside:  # moments are of lists
            return None
        words = SliceWords(self.count, self._cells)
        return Targets(shaded=added(colours, multiplied()), words=words)

    def shipped_to(self) -> Targets | None:
        words = SliceWords(self.count, self._cells)
        if self.total == "block":
            return Targets(shaded=added("16f", multiplied()), words=words)
        held = held_in(("r32f" if self.total == "full" else "r16f",))
        return Targets(held, added("16f"), words=words)

    @property
    def costs_like(self) -> tuple[str, ...]:
        """Passes differ by what blocks share, not by how many slices there are."""
        if self.inside or self.table != "image":
            return ()
        return ("slices64",) if self.resolution == 1 else ("slices32(resolution=4,total='full')",)
