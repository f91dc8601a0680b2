"""Deep files written row by row, of any size, with all of a header that stays true.

OpenEXR's package takes whole images. So it is given some rows at a time, as a file of their own in
memory, of which the chunks are copied: a chunk is one row, and says which.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, BinaryIO

from moit import _core
from moit.formats.deep_rows import DeepRows
from moit.formats.exr_chunks import chunk_count, chunks_of
from moit.formats.exr_headers import (
    DEEP_FLAG,
    LONG_NAME,
    MAGIC,
    MOST_COORDINATE,
    OF_THE_FILE,
    SCREEN,
    SEVERAL_FLAG,
    Header,
    HeaderError,
    Headers,
    channels_of,
    packed,
    read_headers,
)
from moit.fragments.frame import Attribute
from moit.system.environment import thread_count
from moit.system.files import replacing

LONG_NAMES_FLAG = 0x400
COMPRESSIONS = ("zstd", "zips", "rle", "none")

# What is true of the samples' order and number only where nothing has changed.
UNTRUE = frozenset((b"deepImageState", b"preview", b"software"))
STAYING = SCREEN | {b"multiView", b"name"}


@dataclass(frozen=True)
class Place:
    """Where an image lies and what its header says besides.

    shape, origin : (height, width) and (y, x) of the data window.
    attributes : all of a header that is written again.
    beside : a file of several parts, and which of them the image takes the place of: the others are
        copied. None: the image is alone.
    """

    shape: tuple[int, int]
    origin: tuple[int, int]
    display_shape: tuple[int, int]
    display_origin: tuple[int, int]
    pixel_aspect: float
    attributes: tuple[Attribute, ...]
    beside: tuple[str, int] | None = None


def place_of(
    header: Header,
    shape: tuple[int, int],
    origin: tuple[int, int],
    beside: tuple[str, int] | None = None,
) -> Place:
    """That of an image that is made of a part with such a header. What ids stand for, and which
    channels are which view's, stays: names and ids do."""
    frame = header.frame()
    kept = tuple(one for one in header.attributes if _stays(one))
    display = (frame.display_shape, frame.display_origin, frame.pixel_aspect)
    return Place(shape, origin, *display, kept, beside)


def _stays(one: Attribute) -> bool:
    name = one.raw_name
    return (name not in OF_THE_FILE or name in STAYING) and name not in UNTRUE and one.sound


def compressions() -> tuple[str, ...]:
    """What the OpenEXR at hand compresses deep images with, the smallest files first."""
    import OpenEXR

    found = (f"{name.upper()}_COMPRESSION" for name in COMPRESSIONS)
    able = [hasattr(OpenEXR, one.replace("NONE", "NO")) for one in found]
    return tuple(name for name, is_able in zip(COMPRESSIONS, able, strict=True) if is_able)


def compression_named(name: str | None) -> str:
    """The compression that is meant; None: the first of `compressions`. Raises ValueError."""
    able = compressions()
    if name is None:
        return able[0]
    if name not in able:
        raise ValueError(f"compression: expected one of {', '.join(able)}; got {name!r:.80}")
    return name


class DeepOutput:
    """A file that takes rows from the top on. `deep_output` opens one."""

    def __init__(
        self, stream: BinaryIO, name: str, place: Place, types: Mapping[str, Any], compression: str
    ) -> None:
        self.stream, self.name, self.place, self.types = stream, name, place, dict(types)
        self.others: Headers | None = None
        if place.beside:
            with open(place.beside[0], "rb") as source:
                self.others = read_headers(source)
        self.compression, self.threads = compression, thread_count(None)
        self.row = place.origin[0]
        self.places: list[int] = []
        self.header: Header | None = None
        self.known: tuple[Attribute, ...] = ()

    def put(self, rows: DeepRows) -> None:
        """The next rows."""
        assert rows.origin == (self.row, self.place.origin[1])
        start, chunks, ends = self._chunks(rows)
        if self.header is None:
            self._begin(start)
        if self.place.beside:
            self._put_each(chunks, ends)
        else:
            at = self.stream.tell()
            self.places += [at + end for end in ends]
            self.stream.write(chunks)
        self.row = rows.bottom

    def _put_each(self, chunks: bytes, ends: Sequence[int]) -> None:
        """Each behind the index of its part."""
        assert self.place.beside
        index = struct.pack("<i", self.place.beside[1])
        for begin, end in pairwise((*ends, len(chunks))):
            self.places.append(self.stream.tell())
            self.stream.write(index + chunks[begin:end])

    def at_end(self, attributes: Sequence[Attribute]) -> None:
        """Values that are known now, of attributes that the header has, as long as these."""
        self.known = tuple(attributes)

    def finish(self) -> None:
        """Writes what is known at the end."""
        assert self.row == self.place.origin[0] + self.place.shape[0]
        tables = self._copied() if self.place.beside else [self.places]
        self.stream.seek(self.table)
        for places in tables:
            self.stream.write(struct.pack(f"<{len(places)}Q", *places))
        for one in self.known:
            at = self.reserved[one.raw_name]
            self.stream.seek(at)
            self.stream.write(one.data)

    def _copied(self) -> list[list[int]]:
        """Copies the chunks of the other parts; the places of those of all."""
        assert self.place.beside and self.others
        path, own = self.place.beside
        tables = []
        with open(path, "rb") as source:
            for index in range(len(self.others.parts)):
                places = self.places if index == own else []
                for chunk in chunks_of(source, self.others, index) if index != own else ():
                    places.append(self.stream.tell())
                    self.stream.write(struct.pack("<i", index) + chunk)
                tables.append(places)
        return tables

    def _chunks(self, rows: DeepRows) -> tuple[Header, bytes, list[int]]:
        """The header, the chunks and where each begins, of a file of these rows."""
        import OpenEXR

        kind = self.compression.replace("none", "no").upper()
        (height, width), (y, x) = rows.shape, rows.origin
        header = {
            "type": OpenEXR.deepscanline,
            "compression": getattr(OpenEXR, f"{kind}_COMPRESSION"),
            "dataWindow": ((x, y), (x + width - 1, y + height - 1)),
        }
        pixels = {
            name: _core.split_pixels(array, rows.offsets).reshape(rows.shape)
            for name, array in rows.channels.items()
        }
        memory = io.BytesIO()
        try:
            OpenEXR.File(header, pixels, num_threads=self.threads).write(memory)
        except (OSError, MemoryError):
            raise
        except Exception as error:  # OpenEXR raises whatever pybind11 makes of C++
            raise OSError(f"{self.name!r}: OpenEXR cannot write it: {error}") from error
        found = read_headers(memory).parts[0]
        content = memory.getbuffer()
        places = struct.unpack_from(f"<{height}Q", content, found.end + 1)
        begin = found.end + 1 + 8 * height
        return found, bytes(content[begin:]), [place - begin for place in places]

    def _begin(self, written: Header) -> None:
        """Writes the header and makes room for the table."""
        from moit.system.version import VERSION

        place, (height, _) = self.place, self.place.shape
        software = Attribute(b"software", b"string", f"moit {VERSION}".encode())
        kept = {one.raw_name: one for one in (*written.attributes, *place.attributes, software)}
        kept |= {
            b"dataWindow": _box(b"dataWindow", place.origin, place.shape),
            b"displayWindow": _box(b"displayWindow", place.display_origin, place.display_shape),
            b"chunkCount": Attribute(b"chunkCount", b"int", struct.pack("<i", height)),
            b"pixelAspectRatio": Attribute(
                b"pixelAspectRatio", b"float", struct.pack("<f", place.pixel_aspect)
            ),
        }
        self.header = Header(tuple(kept.values()), 0, 0)
        parts = [self.header] if self.others is None else list(self.others.parts)
        if place.beside:
            parts[place.beside[1]] = self.header
        several = SEVERAL_FLAG if place.beside else 0
        self.stream.write(MAGIC + struct.pack("<I", 2 | DEEP_FLAG | several | _long_names(parts)))
        self.reserved = {}
        for part in parts:
            for one in part.attributes:
                data = packed([one])
                if part is self.header:
                    self.reserved[one.raw_name] = self.stream.tell() + len(data) - len(one.data)
                self.stream.write(data)
            self.stream.write(b"\0")
        self.stream.write(b"\0" if place.beside else b"")
        self.table = self.stream.tell()
        chunks = sum(map(chunk_count, parts)) if place.beside else height
        self.stream.write(bytes(8 * chunks))


def _long_names(parts: Sequence[Header]) -> int:
    """The flag of files with a name of more than 31 bytes, of attributes, types or channels."""
    for part in parts:
        listed = part.get("channels")
        names = [name for name, _, _ in channels_of(listed.data)] if listed else []
        for one in part.attributes:
            names += [one.raw_name, one.raw_type]
        if any(len(name) > LONG_NAME for name in names):
            return LONG_NAMES_FLAG
    return 0


def _box(name: bytes, origin: tuple[int, int], shape: tuple[int, int]) -> Attribute:
    (y, x), (height, width) = origin, shape
    return Attribute(name, b"box2i", struct.pack("<4i", x, y, x + width - 1, y + height - 1))


@contextmanager
def deep_output(
    path: str, place: Place, types: Mapping[str, Any], compression: str | None
) -> Iterator[DeepOutput]:
    """A deep file that appears whole or not at all when the block ends; `put` its rows.

    types : the dtype of each channel: float16, float32 or uint32.

    Raises OSError that names `path`, ValueError where OpenEXR cannot hold the window.
    """
    (height, width), (y, x) = place.shape, place.origin
    if height * width == 0:
        raise ValueError(f"OpenEXR cannot hold an image of {height} x {width} pixels")
    if min(y, x) < -MOST_COORDINATE or max(y + height, x + width) > MOST_COORDINATE:
        raise ValueError(f"OpenEXR's coordinates end at {MOST_COORDINATE}; found a window beyond")
    with replacing(path) as part, open(part, "xb") as stream:
        output = DeepOutput(stream, path, place, types, compression_named(compression))
        yield output
        try:
            output.finish()
        except HeaderError as error:
            beside = place.beside[0] if place.beside else path
            raise OSError(f"{beside!r}: damaged: {error}") from None
