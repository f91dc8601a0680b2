"""Slices of fragments that a device lists or draws: where they stand, and what blocks have.

A pass marks the cells of depth that have anything. The core makes tables of the marks, which are
few, so that one text says where slices stand; fragments stay on the device.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog.options import WARPS
from moit.catalog.slices import TABLES
from moit.fragments.fragments import Fragments
from moit.gpu.described import Passes

ENTRY = 3 * 4  # bytes


@dataclasses.dataclass(frozen=True)
class SlicedPicture:
    """A picture of so many pixels a side, and a technique of slices by its fields."""

    fields: Mapping[str, Any]
    width: int
    height: int

    @property
    def region_side(self) -> int:
        """Of what has a table, in pixels; 0: the picture is one."""
        table = TABLES[self.fields.get("table", 0)]
        sides = {"image": 0, "tile": self.fields.get("tile", 0), "pixel": self.block_side}
        return int(sides[table])

    @property
    def block_side(self) -> int:
        return int(self.fields["resolution"])

    def _there(self, side: int) -> tuple[int, int]:
        return -(-self.width // side), -(-self.height // side)

    @property
    def regions(self) -> int:
        across, down = self._there(self.region_side) if self.region_side else (1, 1)
        return across * down

    @property
    def blocks(self) -> int:
        across, down = self._there(self.block_side)
        return across * down

    @property
    def mark_words(self) -> int:
        return int(self.regions * self.fields["cells"] // 32)

    def uniforms(self) -> dict[str, Any]:
        across, down = self._there(self.block_side)
        return {
            "image_top": 0,
            "image_left": 0,
            "image_height": self.height,
            "first_pixel": 0,
            "guided": 0,
            "block_side": self.block_side,
            "shared_side": self.block_side,
            "block_left": 0,
            "block_top": 0,
            "blocks_across": across,
            "blocks_down": down,
            "region_side": self.region_side,
            "region_top": 0,
            "region_left": 0,
            "regions_across": self._there(self.region_side)[0] if self.region_side else 1,
        }

    def sizes(self, passes: Passes) -> dict[str, int]:
        """Bytes of the buffers that it has beside those of any technique."""
        return {
            "tables": ENTRY * self.regions * int(self.fields["cells"]),
            "blocks": 4 * self.blocks * passes.block_words,
        }

    def tables(self, marks: NDArray[np.uint32], threads: int) -> tuple[NDArray[np.float32], int]:
        """(regions, cells, 3) of where slices stand by marks (mark_words,) of cells that have
        anything, and how many cells are joined: what the core makes of as many pixels as there are
        regions, with a fragment in each such cell."""
        cells = int(self.fields["cells"])
        bits = np.unpackbits(marks.view(np.uint8), bitorder="little").reshape(self.regions, cells)
        counts = bits.sum(axis=1, dtype=np.int64)
        cell = np.nonzero(bits)[1]
        depth = ((cell + 0.5) / cells).astype(np.float32)  # cells are a power of two: exact
        marked = Fragments(
            np.concatenate([[0], np.cumsum(counts)]),
            depth,
            np.full(len(depth), np.float32(0.5)),
            shape=(1, self.regions),
            depth_range=(0.0, 1.0),
        )
        own = {"resolution": 1, "warp": WARPS.index("none")}
        if self.region_side:
            own["table"] = TABLES.index("pixel")
        found = _core.slice_tables(marked, {**self.fields, **own}, False, threads)
        return found[0], found[-1]
