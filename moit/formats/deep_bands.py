"""Deep images larger than memory, band after band of whole rows."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from moit.checks.arguments import path_name, truth, whole
from moit.formats.deep import Remarks, fragments_of
from moit.formats.deep_channels import Wanted, wanted
from moit.formats.deep_parts import ExrFile, Part
from moit.formats.deep_rows import DeepRows
from moit.formats.deep_source import Source
from moit.fragments.fragments import Fragments
from moit.fragments.frame import Frame
from moit.fragments.ranges import default_range, union_of_ranges
from moit.system.progress import Progress, steps

USUAL_MEMORY = 1 << 30
LEAST_MEMORY = 1 << 20

# What reading takes at its height, measured: objects for each pixel and channel, and samples in
# OpenImageIO's deep data, in OpenEXR's arrays and in Fragments.
BYTES_A_PIXEL = 640
BYTES_A_SAMPLE = 112

Ranged = tuple[
    tuple[float, float], bool
]  # a band's range, and whether it is of what is transparent

FIRST_ROWS = 16  # as many as one chunk of a file mostly holds


def read_deep_bands(
    path: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    channels: Mapping[str, str] | None = None,
    tidy: bool = True,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
    subimage: int | None = None,
) -> Iterator[Fragments]:
    """The samples of a deep OpenEXR file as Fragments of some whole rows each, from the top on.

    path, part, layer, channels, tidy, subimage : as `read_deep`.
    memory : bytes that reading a band may take, about, at least 1 MiB. A band has at least one
        row, or one row of tiles, however much that takes.
    progress : see `moit.compare`.

    All bands have the depth_range of the whole image, which `read_deep` gives, and their own
    shape and origin: technique by technique, their composites are the rows of the composite of
    the whole where `technique.local`. A file that does not fit is read twice, first for its
    range. Raises and warns as `read_deep`, before the first band.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> sum(band.shape[0] for band in moit.read_deep_bands("panes.exr"))
    6
    """
    name, chosen = path_name(path), wanted(part, layer, channels, subimage)
    return Bands(name, band_part(name, chosen), memory, truth("tidy", tidy)).read(progress)


def band_part(name: str, chosen: Wanted) -> Part:
    """The part of a file that is meant, with a window that the file can hold."""
    with open(name, "rb") as stream:  # what the system refuses is its own OSError
        file = ExrFile(name, stream)
        part = file.chosen(chosen)
        part.window(file.size(), name)
    return part


class Bands:
    """The bands of one file."""

    def __init__(self, name: str, part: Part, memory: int, tidy: bool = True) -> None:
        self.name, self.part, self.tidy = name, part, tidy
        self.memory = whole("memory", memory, LEAST_MEMORY)
        (_, self.first), (_, last) = part.first, part.last
        self.height = last - self.first + 1
        self.width = part.last[0] - part.first[0] + 1

    def read(self, progress: Progress) -> Iterator[Fragments]:
        with Source(self.name, self.part) as source:
            kept, ranges, samples, remarks = self.survey(source, progress)
            for text in remarks.texts():
                warnings.warn(f"{self.name!r}: {text}", UserWarning, stacklevel=3)
            depth_range = union_of_ranges(ranges)
            if kept is None:
                plan = self.plan(samples, source.step)
                with steps(progress, len(plan), "bands") as done:
                    for begin, end in plan:
                        yield _within(
                            self.band(source, begin, end)[0], depth_range, self.part.frame
                        )
                        done(f"row {end} of {self.height}")
            else:
                for band in kept:
                    yield _within(band, depth_range, self.part.frame)

    def survey(
        self, source: Source, progress: Progress
    ) -> tuple[list[Fragments] | None, list[Ranged], np.ndarray[Any, Any], Remarks]:
        """All bands where they fit into half of the memory; depth ranges, samples of each row
        and what reading changed."""
        kept: list[Fragments] | None = []
        ranges: list[Ranged] = []
        samples = np.zeros(self.height, np.int64)
        remarks, held, row = Remarks(), 0, 0
        rows = self.first_rows()
        with steps(progress, self.height, "rows looked at") as done:
            while row < self.height:
                end = min(self.height, source.up(row + rows))
                band, found = self.band(source, row, end)
                remarks += found
                counts = band.counts.reshape(end - row, -1).sum(axis=1)
                samples[row:end] = counts
                if len(band):
                    ranges.append(default_range(band._arrays()))
                if kept is not None:
                    kept.append(band)
                    held += band.offsets.nbytes + sum(
                        a.nbytes for a in band._arrays() if a is not None
                    )
                    if held > self.memory // 2:
                        kept = None
                rows = self.next_rows(rows, counts)
                for _ in range(end - row):
                    done("")
                row = end
        return kept, ranges, samples, remarks

    def first_rows(self) -> int:
        return max(1, min(FIRST_ROWS, self.memory // (BYTES_A_PIXEL * self.width)))

    def next_rows(self, rows: int, counts: np.ndarray[Any, Any]) -> int:
        """How many rows to look at after as many with these numbers of samples each."""
        a_row = BYTES_A_PIXEL * self.width + BYTES_A_SAMPLE * int(counts.max())
        return max(1, min(2 * rows, self.memory // (2 * a_row)))

    def all_rows(self) -> Iterator[DeepRows]:
        """All rows with all channels, in bands."""
        with Source(self.name, self.part) as source:
            row, rows = 0, self.first_rows()
            while row < self.height:
                end = min(self.height, source.up(row + rows))
                found = source.rows(row, end)
                yield found
                counts = np.diff(found.offsets).reshape(end - row, -1).sum(axis=1)
                rows = self.next_rows(rows, counts)
                row = end

    def band(self, source: Source, begin: int, end: int) -> tuple[Fragments, Remarks]:
        return fragments_of(source.rows(begin, end), self.part, self.name, self.tidy)

    def plan(self, samples: np.ndarray[Any, Any], step: int) -> list[tuple[int, int]]:
        """Bands of rows that take no more than the memory, as far as steps of rows allow."""
        taken = BYTES_A_PIXEL * self.width + BYTES_A_SAMPLE * samples
        plan, begin, spent = [], 0, 0
        for row in range(0, self.height, step):
            cost = int(taken[row : row + step].sum())
            if spent and spent + cost > self.memory:
                plan.append((begin, row))
                begin, spent = row, 0
            spent += cost
        plan.append((begin, self.height))
        return plan


def _within(f: Fragments, depth_range: tuple[float, float], frame: Frame) -> Fragments:
    return Fragments._of_checked(f.offsets, f._arrays(), f.shape, depth_range, f.origin, frame)
