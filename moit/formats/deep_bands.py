"""Deep images larger than memory, band after band of whole rows."""

from __future__ import annotations

import operator
import os
import tempfile
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from moit.checks.arguments import path_name
from moit.formats.deep import Part, Remarks, deep_part, samples_of
from moit.fragments.fragments import Fragments, default_range, union_of_ranges
from moit.system.progress import Progress, steps

if TYPE_CHECKING:
    pass

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
    subimage: int = 0,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> Iterator[Fragments]:
    """The samples of a deep OpenEXR file as Fragments of some whole rows each, from the top on.

    path, subimage : as `read_deep`.
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
    name = path_name(path)
    with open(name, "rb") as stream:  # what the system refuses is its own OSError
        part = deep_part(name, stream, subimage)
        part.window(os.fstat(stream.fileno()).st_size, name)
    return Bands(name, part, bytes_of(memory)).read(progress)


def bytes_of(memory: int) -> int:
    try:
        count = operator.index(memory)
    except TypeError:
        raise TypeError(f"memory: expected bytes, got {type(memory).__name__}") from None
    if count < LEAST_MEMORY:
        raise ValueError(f"memory: expected at least {LEAST_MEMORY} bytes, got {count}")
    return count


class Bands:
    """The bands of one file."""

    def __init__(self, name: str, part: Part, memory: int) -> None:
        self.name, self.part, self.memory = name, part, memory
        (_, self.first), (_, last) = part.first, part.last
        self.height = last - self.first + 1
        self.width = part.last[0] - part.first[0] + 1

    def read(self, progress: Progress) -> Iterator[Fragments]:
        with _Source(self.name, self.part) as source:
            kept, ranges, samples, remarks = self.survey(source, progress)
            for text in remarks.texts():
                warnings.warn(f"{self.name!r}: {text}", UserWarning, stacklevel=3)
            depth_range = union_of_ranges(ranges)
            if kept is None:
                plan = self.plan(samples, source.step)
                with steps(progress, len(plan), "bands") as done:
                    for begin, end in plan:
                        yield _within(source.band(begin, end)[0], depth_range)
                        done(f"row {end} of {self.height}")
            else:
                for band in kept:
                    yield _within(band, depth_range)

    def survey(
        self, source: _Source, progress: Progress
    ) -> tuple[list[Fragments] | None, list[Ranged], np.ndarray[Any, Any], Remarks]:
        """All bands where they fit into half of the memory; depth ranges, samples of each row
        and what reading changed."""
        kept: list[Fragments] | None = []
        ranges: list[Ranged] = []
        samples = np.zeros(self.height, np.int64)
        remarks, held, row = Remarks(), 0, 0
        rows = max(1, min(FIRST_ROWS, self.memory // (BYTES_A_PIXEL * self.width)))
        with steps(progress, self.height, "rows looked at") as done:
            while row < self.height:
                end = min(self.height, source.up(row + rows))
                band, found = source.band(row, end)
                remarks += found
                counts = band.counts.reshape(end - row, -1).sum(axis=1)
                samples[row:end] = counts
                if len(band):
                    ranges.append(default_range(band._arrays()))
                if kept is not None:
                    kept.append(band)
                    held += band.offsets.nbytes + band.depth.nbytes * 5
                    if held > self.memory // 2:
                        kept = None
                a_row = BYTES_A_PIXEL * self.width + BYTES_A_SAMPLE * int(counts.max())
                rows = max(1, min(2 * rows, self.memory // (2 * a_row)))
                for _ in range(end - row):
                    done("")
                row = end
        return kept, ranges, samples, remarks

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


def _within(f: Fragments, depth_range: tuple[float, float]) -> Fragments:
    return Fragments._of_checked(f.offsets, f._arrays(), f.shape, depth_range, f.origin)


class _Source:
    """Rows of a deep file. OpenImageIO decodes them and writes them to a file of their own without
    compression, which OpenEXR turns into arrays: it cannot read a part of a file, and the former
    cannot make arrays of samples."""

    def __init__(self, name: str, part: Part) -> None:
        self.name, self.part = name, part
        self.folder = tempfile.TemporaryDirectory(prefix="moit-")

    def __enter__(self) -> _Source:
        import OpenImageIO as oiio

        try:
            name = self.name
            name.encode()
        except UnicodeEncodeError:
            raise OSError(f"{self.name!r}: OpenImageIO takes Unicode names only") from None
        file = oiio.ImageInput.open(name)
        if file is None or not file.seek_subimage(self.part.index, 0):
            raise OSError(f"{self.name!r}: damaged: {oiio.geterror() or 'cannot be opened'}")
        self.file, self.spec = file, file.spec()
        self.step = max(1, self.spec.tile_height)
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self.folder.cleanup()

    def up(self, row: int) -> int:
        """The first row at or below `row` that a band may end before."""
        return -(-row // self.step) * self.step

    def band(self, begin: int, end: int) -> tuple[Fragments, Remarks]:
        """Rows begin to end - 1, counted from the first of the data window."""
        import OpenImageIO as oiio

        spec, first = self.spec, self.spec.y
        y0, y1 = first + begin, first + end
        if spec.tile_width:
            deep = self.file.read_native_deep_tiles(
                self.part.index, 0, spec.x, spec.x + spec.width, y0, y1, 0, 1, 0, spec.nchannels
            )
        else:
            deep = self.file.read_native_deep_scanlines(
                self.part.index, 0, y0, y1, 0, 0, spec.nchannels
            )
        if deep is None:
            raise OSError(f"{self.name!r}: damaged: {self.file.geterror() or 'cannot be decoded'}")
        own = oiio.ImageSpec(spec.width, end - begin, spec.nchannels, oiio.FLOAT)
        own.channelnames, own.channelformats = spec.channelnames, spec.channelformats
        own.deep, own.x, own.y = True, spec.x, y0
        own.attribute("compression", "none")
        path = os.path.join(self.folder.name, "band.exr")
        out = oiio.ImageOutput.create(path)
        if out is None:
            raise OSError(f"{path!r}: {oiio.geterror()}")
        written = out.open(path, own) and out.write_deep_image(deep)
        error = out.geterror()
        if not (out.close() and written):
            raise OSError(f"{path!r}: {error or out.geterror() or 'cannot be written'}")
        del deep
        return samples_of(path, 0, self.name)
