"""The header of an OpenEXR file, read without what its attributes mean.

OpenEXR's Python package refuses a file for an attribute that it cannot make an object of, although
no pixel needs it. Pixels are left to OpenEXR; where it refuses, it sees the file through a window
(`Covered`) in which attributes that pixels do not need are one harmless string, as long as they
were. The same exchange, the other way round, writes attributes that it could not write
(`put_frame`).

What a header is made of: OpenEXR File Layout, openexr.com.
"""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import BinaryIO

from moit.fragments.frame import Attribute, Frame, decoded

MAGIC = b"\x76\x2f\x31\x01"
TILED_FLAG, DEEP_FLAG, SEVERAL_FLAG = 0x200, 0x800, 0x1000
LONG_NAME = 31
MOST_NAME = 255

# What OpenEXR accepts as a coordinate of a window.
MOST_COORDINATE = 2**30 - 1

# Real headers have tens; a damaged file can claim millions, each an object here.
MOST_ATTRIBUTES = 2**16

# What OpenEXR needs to find and to decode pixels.
NEEDED = frozenset(
    (
        b"channels",
        b"chunkCount",
        b"compression",
        b"dataWindow",
        b"displayWindow",
        b"lineOrder",
        b"maxSamplesPerPixel",
        b"name",
        b"pixelAspectRatio",
        b"screenWindowCenter",
        b"screenWindowWidth",
        b"tiles",
        b"type",
        b"version",
    )
)

# What is true of the file that was read and not of one that is made of its pixels: how they are
# stored, whether samples are sorted, which channels are which view's, what ids stand for, a
# thumbnail.
TYPES_OF_THE_FILE = frozenset((b"chlist", b"deepImageState", b"idmanifest", b"preview"))
SCREEN = frozenset((b"screenWindowCenter", b"screenWindowWidth"))
OF_THE_FILE = NEEDED - SCREEN | {
    b"dwaCompressionLevel",
    b"multiView",
    b"zipCompressionLevel",
}


class HeaderError(ValueError):
    """What is wrong with a header."""


@dataclass(frozen=True)
class Header:
    """The attributes of one part, in the file's order, and the bytes that they take."""

    attributes: tuple[Attribute, ...]
    begin: int
    end: int

    def get(self, name: str) -> Attribute | None:
        raw = name.encode()
        return next((one for one in self.attributes if one.raw_name == raw), None)

    def text(self, name: str) -> str:
        """The value of a string, "" where there is none."""
        found = self.get(name)
        return decoded(found.data) if found else ""

    def frame(self) -> Frame:
        """What it says besides its pixels."""
        window, aspect = self.get("displayWindow"), self.get("pixelAspectRatio")
        x0, y0, x1, y1 = window_of(window, "displayWindow")
        ratio = aspect.value if aspect else 1.0
        kept = (one for one in self.attributes if _outlives(one))
        return Frame(
            (y1 - y0 + 1, x1 - x0 + 1),
            (y0, x0),
            # Files that do not care say 0.
            ratio if isinstance(ratio, float) and 0 < ratio < float("inf") else 1.0,
            tuple({one.raw_name: one for one in kept}.values()),
        )


def _outlives(attribute: Attribute) -> bool:
    """Whether a file that is made of the pixels gets an attribute too: what is damaged in this one
    would make others refuse that one."""
    return (
        attribute.raw_name not in OF_THE_FILE
        and attribute.raw_type not in TYPES_OF_THE_FILE
        and attribute.sound
    )


def window_of(attribute: Attribute | None, name: str) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1), the corners that are part of it."""
    if attribute is None or attribute.type != "box2i" or not isinstance(attribute.value, tuple):
        raise HeaderError(f"there is no {name}")
    x0, y0, x1, y1 = attribute.value
    if x1 < x0 or y1 < y0:
        raise HeaderError(f"its {name} is empty")
    return x0, y0, x1, y1


@dataclass(frozen=True)
class Headers:
    flags: int
    parts: tuple[Header, ...]

    @property
    def plain(self) -> bool:
        """Whether libraries stumble over nothing later than at the header: attributes that pixels
        do not need can be what their types say, and names that they need are UTF-8."""
        return all(
            _readable(one, index) == one if one.raw_name in NEEDED else one.sound
            for index, part in enumerate(self.parts)
            for one in part.attributes
        )


def read_headers(stream: BinaryIO) -> Headers:
    """The headers of all parts. Raises HeaderError."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    start = stream.read(8)
    if len(start) < 8 or start[:4] != MAGIC:
        raise HeaderError("not an OpenEXR file")
    (flags,) = struct.unpack("<I", start[4:])
    bytes_of = _Bytes(stream, size)
    parts: list[Header] = []
    left = MOST_ATTRIBUTES
    while True:
        header = _header(bytes_of, left)
        if not header.attributes and flags & SEVERAL_FLAG and parts:
            return Headers(flags, tuple(parts))
        parts.append(header)
        left -= len(header.attributes)
        if not flags & SEVERAL_FLAG:
            return Headers(flags, tuple(parts))


class _Bytes:
    """Reads from a stream what is there, or raises HeaderError."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self.stream, self.size = stream, size

    def take(self, count: int) -> bytes:
        if not 0 <= count <= self.size - self.stream.tell():
            raise HeaderError("the header ends within an attribute")
        return self.stream.read(count)

    def name(self) -> bytes:
        at = self.stream.tell()
        found, zero, _ = self.stream.read(MOST_NAME + 1).partition(b"\0")
        if not zero:
            raise HeaderError("the header has a name without end")
        self.stream.seek(at + len(found) + 1)
        return found


def _header(bytes_of: _Bytes, most: int) -> Header:
    begin = bytes_of.stream.tell()
    found: list[Attribute] = []
    while name := bytes_of.name():
        if len(found) == most:
            raise HeaderError(f"the header has more than {MOST_ATTRIBUTES} attributes")
        kind = bytes_of.name()
        (length,) = struct.unpack("<i", bytes_of.take(4))
        found.append(Attribute(name, kind, bytes_of.take(length)))
    return Header(tuple(found), begin, bytes_of.stream.tell() - 1)


def packed(attributes: Iterable[Attribute]) -> bytes:
    """The attributes as a file has them."""
    return b"".join(
        one.raw_name + b"\0" + one.raw_type + b"\0" + struct.pack("<i", len(one.data)) + one.data
        for one in attributes
    )


# One string attribute can be as long as any attributes together that take this much.
LEAST_FILLER = len(packed([Attribute(b"~", b"string", b"")]))


def filler(length: int, long_name: bool = False) -> Attribute:
    """A string that takes `length` bytes in all."""
    name = b"~" * (LONG_NAME + 1 if long_name else 1)
    text = length - len(packed([Attribute(name, b"string", b"")]))
    return Attribute(name, b"string", b"~" * text)


def needed_only(stream: BinaryIO, headers: Headers) -> bytes | None:
    """The start of the file, up to the end of the last header, as OpenEXR takes it: attributes
    that pixels do not need are one string, names that are not UTF-8 others of the same length.
    None where there is nothing to hide, or too little."""
    last = headers.parts[-1].end
    stream.seek(0)
    start = bytearray(stream.read(last))
    for index, header in enumerate(headers.parts):
        needed = [_readable(one, index) for one in header.attributes if one.raw_name in NEEDED]
        kept = packed(needed)
        room = header.end - header.begin - len(kept)
        if 0 < room < LEAST_FILLER:
            return None
        if room:
            kept += packed([filler(room)])
        start[header.begin : header.end] = kept
    return bytes(start)


def _readable(attribute: Attribute, index: int) -> Attribute:
    if attribute.raw_name == b"name" and not _is_utf8(attribute.data):
        own = str(index).encode().ljust(len(attribute.data), b"~")
        if len(own) == len(attribute.data):
            return Attribute(attribute.raw_name, attribute.raw_type, own)
    if attribute.raw_name == b"channels":
        return Attribute(attribute.raw_name, attribute.raw_type, _renamed(attribute.data))
    return attribute


def _is_utf8(text: bytes) -> bool:
    try:
        text.decode()
    except UnicodeDecodeError:
        return False
    return True


CHANNEL = struct.Struct("<iB3xii")  # its type, whether it is perceptually linear, its sampling


def channels_of(data: bytes) -> list[tuple[bytes, int, int]]:
    """(name, where it starts, its type) of each channel of a list. Raises HeaderError."""
    found, at = [], 0
    while at < len(data) and data[at]:
        end = data.find(b"\0", at)
        if end < 0 or end + 1 + CHANNEL.size > len(data):
            raise HeaderError("its list of channels ends within a channel")
        found.append((data[at:end], at, CHANNEL.unpack_from(data, end + 1)[0]))
        at = end + 1 + CHANNEL.size
    if at != len(data) - 1:
        raise HeaderError("its list of channels has no end")
    return found


def _renamed(data: bytes) -> bytes:
    """The list of channels with names that are UTF-8, in the same order."""
    try:
        channels = channels_of(data)
    except HeaderError:
        return data  # for OpenEXR to refuse
    if all(_is_utf8(name) for name, _, _ in channels):
        return data
    new = bytearray(data)
    names = []
    for name, at, _ in channels:
        # What is greater than ASCII stays so among ASCII names, and order is all that counts.
        own = name if _is_utf8(name) else bytes(min(byte, 0x7E) for byte in name)
        new[at : at + len(name)] = own
        names.append(own)
    in_order = all(a < b for a, b in pairwise(names))
    return bytes(new) if in_order else data


def readable_channels(data: bytes) -> tuple[str, ...]:
    """The names that OpenEXR's package gives for a list of channels."""
    return tuple(decoded(name) for name, _, _ in channels_of(_renamed(data)))


class Covered:
    """A stream whose first bytes are others."""

    def __init__(self, stream: BinaryIO, start: bytes) -> None:
        self.stream, self.start = stream, start
        self.stream.seek(0)

    def read(self, count: int) -> bytes:
        at = self.stream.tell()
        found = self.stream.read(count)
        hidden = self.start[at : at + len(found)]
        return hidden + found[len(hidden) :]

    def tell(self) -> int:
        return self.stream.tell()

    def seek(self, offset: int, whence: int = 0) -> int:
        return self.stream.seek(offset, whence)


def packed_frame(frame: Frame) -> bytes:
    """A frame as the header of a file that has no more."""
    window = struct.pack("<4i", *_corners(frame))
    aspect = struct.pack("<f", frame.pixel_aspect)
    own = [
        Attribute(b"displayWindow", b"box2i", window),
        Attribute(b"pixelAspectRatio", b"float", aspect),
    ]
    return packed([*own, *frame.attributes]) + b"\0"


def unpacked_frame(data: bytes) -> Frame:
    """The frame that `packed_frame` packed. Raises HeaderError."""
    return _header(_Bytes(io.BytesIO(data), len(data)), MOST_ATTRIBUTES).frame()


def _corners(frame: Frame) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1) of the display window."""
    (top, left), (height, width) = frame.display_origin, frame.display_shape
    return left, top, left + width - 1, top + height - 1


# Writing: a file is written with a string in the place of attributes, which then is exchanged.


def kept_of(frame: Frame, taken: Iterable[str]) -> tuple[Attribute, ...]:
    """The attributes of a frame that a file gets in which those named already are."""
    written = {name.encode() for name in taken} | OF_THE_FILE | SCREEN
    kept = tuple(one for one in frame.attributes if one.raw_name not in written)
    if kept and len(packed(kept)) <= len(packed([filler(0, _have_long_name(kept))])):
        kept += (Attribute(b"attributes", b"string", b"kept"),)  # makes room for a string
    return kept


def _have_long_name(attributes: Iterable[Attribute]) -> bool:
    return any(max(len(one.raw_name), len(one.raw_type)) > LONG_NAME for one in attributes)


def place_for(kept: Sequence[Attribute]) -> dict[str, str]:
    """The string, by its name, that a file is written with for `put_frame`; none for none."""
    if not kept:
        return {}
    place = filler(len(packed(kept)), _have_long_name(kept))
    return {place.name: place.data.decode()}


def put_frame(path: str, frame: Frame, kept: Sequence[Attribute]) -> None:
    """Gives a file of one part, just written with `place_for(kept)`, the frame: only bytes of its
    header change, and no place."""
    with open(path, "r+b") as stream:
        header = read_headers(stream).parts[0]
        exact = {
            b"displayWindow": struct.pack("<4i", *_corners(frame)),
            b"pixelAspectRatio": struct.pack("<f", frame.pixel_aspect),
        }
        exact |= {
            one.raw_name: one.data
            for one in frame.attributes
            if (one.raw_name, one.raw_type, len(one.data))
            in ((b"screenWindowCenter", b"v2f", 8), (b"screenWindowWidth", b"float", 4))
        }
        place = place_for(kept)
        new = b""
        for one in header.attributes:
            if one.name in place:
                new += packed(kept)
            else:
                data = exact.get(one.raw_name, one.data)
                new += packed([Attribute(one.raw_name, one.raw_type, data)])
        if len(new) != header.end - header.begin:
            raise OSError(f"{path!r}: its header was not written as asked for")
        stream.seek(header.begin)
        stream.write(new)
