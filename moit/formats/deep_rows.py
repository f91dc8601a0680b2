"""Rows of a deep image with all their channels, as files hold them.

`Fragments` are what techniques see: colour without alpha, one layer. What goes from file to file
keeps every channel, its type and its light multiplied by alpha.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from moit.formats.exr_headers import Header, HeaderError, channels_of, read_headers, window_of

Index = NDArray[np.int64]

# As OpenEXR numbers a channel's types.
DTYPES = (np.uint32, np.float16, np.float32)
UNCOMPRESSED = 0


@dataclass(frozen=True)
class DeepRows:
    """Samples of a window of pixels.

    shape, origin : (height, width) and (y, x) of its first pixel.
    offsets : (P + 1,) int64; pixel p owns samples offsets[p]:offsets[p + 1].
    channels : by name (N,) float16, float32 or uint32.
    """

    shape: tuple[int, int]
    origin: tuple[int, int]
    offsets: Index
    channels: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return int(self.offsets[-1])

    @property
    def bottom(self) -> int:
        """The row behind the last."""
        return self.origin[0] + self.shape[0]

    def rows(self, begin: int, end: int) -> DeepRows:
        """Those from y = begin to end - 1, which must be among these; views of them."""
        width, first = self.shape[1], begin - self.origin[0]
        ends = self.offsets[first * width : (end - self.origin[0]) * width + 1]
        part = slice(int(ends[0]), int(ends[-1]))
        channels = {name: array[part] for name, array in self.channels.items()}
        return DeepRows((end - begin, width), (begin, self.origin[1]), ends - ends[0], channels)

    def columns(self, left: int, width: int) -> DeepRows:
        """Those from x = left on; pixels that are not among these are empty."""
        height, own = self.shape
        if (left, width) == (self.origin[1], own):
            return self
        first = max(left, self.origin[1]) - self.origin[1]
        last = min(left + width, self.origin[1] + own) - self.origin[1]
        counts = np.zeros((height, width), np.int64)
        kept = np.zeros((height, own), np.bool_)
        if first < last:
            at = first + self.origin[1] - left
            held = np.diff(self.offsets).reshape(height, own)
            counts[:, at : at + last - first] = held[:, first:last]
            kept[:, first:last] = True
        samples = np.repeat(kept.ravel(), np.diff(self.offsets))
        channels = {name: array[samples] for name, array in self.channels.items()}
        return DeepRows(
            (height, width), (self.origin[0], left), offsets_of(counts.ravel()), channels
        )

    def with_channels(self, channels: Mapping[str, NDArray[Any]]) -> DeepRows:
        return DeepRows(self.shape, self.origin, self.offsets, channels)


def one_type(kinds: Sequence[Any]) -> Any:
    """The dtype that holds numbers of any of these."""
    return kinds[0] if len({*kinds}) == 1 else np.float32


def as_held(values: NDArray[Any], dtype: Any, name: str) -> NDArray[Any]:
    """Numbers as a channel holds them. Raises ValueError where these are too large for it."""
    with np.errstate(over="ignore", under="ignore"):
        stored = values.astype(dtype)
    lost = ~np.isfinite(stored)
    if lost.any():
        found = values[int(lost.argmax())]
        raise ValueError(f"{name}: found {found}, too large for {np.dtype(dtype)}")
    return stored


def offsets_of(counts: Index) -> Index:
    """(P + 1,) of the number of samples of each pixel."""
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    return offsets


def empty_rows(
    shape: tuple[int, int], origin: tuple[int, int], types: Mapping[str, Any]
) -> DeepRows:
    """Pixels without samples."""
    offsets = np.zeros(shape[0] * shape[1] + 1, np.int64)
    return DeepRows(
        shape, origin, offsets, {name: np.zeros(0, kind) for name, kind in types.items()}
    )


def stacked(parts: Sequence[DeepRows]) -> DeepRows:
    """Rows of one width, one below the other."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    counts = np.concatenate([np.diff(one.offsets) for one in parts])
    channels = {
        name: np.concatenate([one.channels[name] for one in parts]) for name in first.channels
    }
    shape = (sum(one.shape[0] for one in parts), first.shape[1])
    return DeepRows(shape, first.origin, offsets_of(counts), channels)


def side_by_side(parts: Sequence[DeepRows]) -> tuple[DeepRows, NDArray[np.int64]]:
    """The samples of images of one window and the same channels, each pixel's one after the other;
    and (N,) which image each is of."""
    if len(parts) == 1:
        return parts[0], np.zeros(len(parts[0]), np.int64)
    counts = [np.diff(one.offsets) for one in parts]
    offsets = offsets_of(np.sum(counts, axis=0, dtype=np.int64))
    places, begins = [], offsets[:-1].copy()
    for one, own in zip(parts, counts, strict=True):
        place = np.repeat(begins - one.offsets[:-1], own)
        place += np.arange(len(one))
        places.append(place)
        begins += own
    owner = np.empty(int(offsets[-1]), np.int64)
    channels = {
        name: np.empty(int(offsets[-1]), array.dtype) for name, array in parts[0].channels.items()
    }
    for i, (one, place) in enumerate(zip(parts, places, strict=True)):
        owner[place] = i
        for name, array in channels.items():
            array[place] = one.channels[name]
    return DeepRows(parts[0].shape, parts[0].origin, offsets, channels), owner


def uncompressed_rows(stream: BinaryIO, size: int) -> DeepRows:
    """All rows of a file of one deep part of scan lines without compression, of `size` bytes.

    Such files are made on the way from a library that decodes to arrays, so they are read by us:
    OpenEXR's package would make an object of each pixel and channel. Raises HeaderError where
    anything is not as its header says.
    """
    header = read_headers(stream).parts[0]
    compression, listed = header.get("compression"), header.get("channels")
    if compression is None or compression.data != bytes([UNCOMPRESSED]) or listed is None:
        raise HeaderError("it is not what was asked for")
    x0, y0, x1, y1 = window_of(header.get("dataWindow"), "dataWindow")
    height, width = y1 - y0 + 1, x1 - x0 + 1
    stream.seek(0)
    content = np.fromfile(stream, np.uint8, size)
    chunks = [
        _chunk(content, at, y0 + row, width)
        for row, at in enumerate(_places(content, header, height))
    ]
    counts = np.concatenate([chunk[0] for chunk in chunks])
    offsets = offsets_of(counts)
    held = channels_of(listed.data)
    names = [name.decode() for name, _, _ in held]
    kinds = [np.dtype(DTYPES[number]) for _, _, number in held]
    arrays = [np.empty(int(offsets[-1]), kind) for kind in kinds]
    at = 0
    for own, samples in chunks:
        count, begin = int(own.sum()), 0
        if count * sum(kind.itemsize for kind in kinds) != len(samples):
            raise HeaderError("a row has another number of bytes than its samples need")
        for array, kind in zip(arrays, kinds, strict=True):
            end = begin + count * kind.itemsize
            array[at : at + count].view(np.uint8)[:] = samples[begin:end]
            begin = end
        at += count
    return DeepRows((height, width), (y0, x0), offsets, dict(zip(names, arrays, strict=True)))


def _places(content: NDArray[np.uint8], header: Header, height: int) -> list[int]:
    begin = header.end + 1
    table = content[begin : begin + 8 * height].tobytes()
    if len(table) != 8 * height:
        raise HeaderError("its table of rows ends early")
    return list(struct.unpack(f"<{height}Q", table))


def _chunk(
    content: NDArray[np.uint8], at: int, row: int, width: int
) -> tuple[Index, NDArray[np.uint8]]:
    """(width,) numbers of samples, and the samples' bytes, of the chunk at a place."""
    start = content[at : at + 28].tobytes()
    if len(start) != 28:
        raise HeaderError("a row lies beyond its end")
    y, counted, packed, _ = struct.unpack("<i3Q", start)
    table = content[at + 28 : at + 28 + counted]
    samples = content[at + 28 + counted : at + 28 + counted + packed]
    if y != row or len(table) != counted or counted != 4 * width or len(samples) != packed:
        raise HeaderError(f"its row {row} is not whole")
    ends = table.copy().view("<i4").astype(np.int64)
    counts = np.diff(ends, prepend=0)
    if (counts < 0).any():
        raise HeaderError(f"its row {row} has less than no samples")
    return counts, samples
