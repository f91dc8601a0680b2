"""The parts of an OpenEXR file, and the one that is meant: what there is before pixels are read."""

from __future__ import annotations

import operator
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, BinaryIO

from numpy.typing import NDArray

from moit.checks.arguments import nearest
from moit.checks.exceptions import FragmentsError, in_one_line
from moit.formats.deep_channels import PartChannels, Wanted, chosen_layer
from moit.formats.exr_headers import (
    DEEP_FLAG,
    SEVERAL_FLAG,
    TILED_FLAG,
    Covered,
    Header,
    HeaderError,
    Headers,
    channels_of,
    needed_only,
    read_headers,
    readable_channels,
    window_of,
)
from moit.fragments.frame import Frame, decoded

# No file is smaller than its compressed table of sample counts, four bytes a pixel. Deflate makes
# nothing smaller than 1 in 1032; Zstandard reaches more, but not where each line is a chunk with a
# header. A file that claims more pixels is damaged, and believing it could take all memory.
PIXELS_PER_BYTE = 1032 // 4
PIXELS_PER_BYTE_ZSTD = 2**13

# As OpenEXR numbers them in files.
COMPRESSIONS = (
    "none",
    "rle",
    "zips",
    "zip",
    "piz",
    "pxr24",
    "b44",
    "b44a",
    "dwaa",
    "dwab",
)
TYPES = ("uint", "half", "float")
DEEP = ("deepscanline", "deeptile")


@dataclass(frozen=True)
class Part:
    index: int
    name: str
    view: str
    kind: str  # scanlineimage, tiledimage, deepscanline, deeptile
    channels: tuple[str, ...]
    types: tuple[str, ...]  # of the channels
    first: tuple[int, int]  # (x, y) of the data window's corners
    last: tuple[int, int]
    compression: str
    zstd: bool
    frame: Frame
    plain: bool  # whether the file's headers are
    views: tuple[str, ...]  # of a part that holds several; the first has no prefix
    readable: tuple[str, ...]  # the channels' names as OpenEXR's package gives them
    layer: str = ""
    names: Mapping[str, str] = field(default_factory=dict)  # the channel that has each role
    given: Mapping[str, str] = field(default_factory=dict)

    @property
    def deep(self) -> bool:
        return self.kind in DEEP

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)"""
        width, height = (b - a + 1 for a, b in zip(self.first, self.last, strict=True))
        return width, height

    def window(self, file_size: int, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
        """(x, y) of the data window's first pixel and its (width, height)."""
        width, height = self.size
        most = file_size * (PIXELS_PER_BYTE_ZSTD if self.zstd else PIXELS_PER_BYTE)
        if not (0 < width and 0 < height and width * height <= most):
            raise OSError(
                f"{name!r}: damaged: {file_size} bytes cannot hold {height} x {width} deep pixels"
            )
        return self.first, (width, height)

    def of(self, chosen: Wanted) -> Part:
        """The part with the channels of the layer that is meant."""
        layer, names = chosen_layer(
            PartChannels(self.channels, self.views, chosen.channels), chosen.layer
        )
        return replace(self, layer=layer, names=names, given=chosen.channels)

    def __str__(self) -> str:
        words = [str(self.index)]
        words += [repr(self.name)] if self.name else []
        words += [f"(view {self.view!r})"] if self.view else []
        return " ".join(words)


class ExrFile:
    """An open OpenEXR file: its parts, and their pixels by OpenEXR's package.

    Raises OSError, which calls the file `name`, where it is damaged or no such file.
    """

    def __init__(self, path: str, stream: BinaryIO, name: str | None = None) -> None:
        self.path, self.stream, self.name = path, stream, name or path
        if stream.read(4) != b"\x76\x2f\x31\x01":
            raise OSError(f"{self.name!r}: not an OpenEXR file")
        with _damage_is_oserror(self.name):
            self.headers = read_headers(stream)
            self.start, found = self._started()
            self.parts = [_part(i, one, self.headers) for i, one in enumerate(self.headers.parts)]
            _compare(self.parts, found)

    def _started(self) -> tuple[bytes | None, Any]:
        """What OpenEXR's package has to see instead of the headers, None if it takes them, and the
        parts that it finds. It raises whatever pybind11 makes of C++."""
        start = needed_only(self.stream, self.headers)
        if start is None or self.headers.plain:
            try:
                return None, self._open(None, True, 1).parts
            except Exception:
                if start is None:
                    raise
        return start, self._open(start, True, 1).parts

    def copy_to(self, path: str) -> None:
        """Writes a file of the same pixels without what they do not need. Raises OSError."""
        start = self.start or needed_only(self.stream, self.headers)
        self.stream.seek(0)
        with open(path, "wb") as copy:
            shutil.copyfileobj(self.stream, copy)
            if start is not None:
                copy.seek(0)
                copy.write(start)

    def _open(self, start: bytes | None, header_only: bool, threads: int) -> Any:
        import OpenEXR

        self.stream.seek(0)
        source: Any = self.path
        if start is not None:
            source = Covered(self.stream, start)
        elif not is_text(self.path):
            source = self.stream  # streams are slow, but take any name
        return OpenEXR.File(
            source, separate_channels=True, header_only=header_only, num_threads=threads
        )

    def deep_part(self, part: int | str | None) -> Part:
        """The part that is meant, if it is deep, without a layer."""
        found = chosen_part(self.parts, part, self.name)
        if not found.deep:
            raise FragmentsError(
                f"{self.name!r}: not a deep image but a flat one; moit.read_image reads it"
            )
        return found

    def chosen(self, wanted: Wanted) -> Part:
        """The part that is meant, if it can be read, with its layer."""
        part = self.deep_part(wanted.part)
        try:
            return part.of(wanted)
        except FragmentsError as error:
            raise FragmentsError(f"{self.name!r}: {error}") from None
        except ValueError as error:
            raise ValueError(f"{error}, in {self.name!r}") from None

    def pixels(self, part: Part, threads: int) -> dict[str, NDArray[Any]]:
        """The channels of a part as OpenEXR gives them, an array of arrays for each."""
        with _damage_is_oserror(self.name):
            # OpenEXR leaves out parts that it cannot decode.
            for found in self._open(self.start, False, threads).parts:
                if found.part_index == part.index:
                    channels = {str(key): one.pixels for key, one in found.channels.items()}
                    if set(channels) == set(part.readable):
                        own = zip(part.channels, part.readable, strict=True)
                        return {name: channels[key] for name, key in own}
            raise ValueError("its pixels cannot be decoded, or there is no memory for them")

    def size(self) -> int:
        return os.fstat(self.stream.fileno()).st_size


def deep_part(path: str, stream: BinaryIO, wanted: Wanted) -> Part:
    """The part of a file that is meant."""
    return ExrFile(path, stream).chosen(wanted)


def chosen_part(parts: Sequence[Part], part: int | str | None, name: str) -> Part:
    """The part that the argument `part` means: by its index, its name, or its view if only one has
    that; the only deep one if it is None, the first if none is deep."""
    if part is None:
        deep = [one for one in parts if one.deep]
        if len(deep) > 1:
            raise FragmentsError(
                f"part: {name!r} has several deep parts; needed one of "
                f"{', '.join(map(str, deep))}; found None"
            )
        return (deep or list(parts))[0]
    names, views = [one.name for one in parts], [one.view for one in parts]
    return parts[index_of(part, names, views, name)]


def index_of(part: int | str, names: Sequence[str], views: Sequence[str], file: str) -> int:
    """The index of the part that the argument `part` means. Raises TypeError and ValueError."""
    if isinstance(part, str):
        found = [i for i, one in enumerate(names) if part and one == part]
        found = found or [i for i, one in enumerate(views) if part and one == part]
        if len(found) == 1:
            return found[0]
        known = [one for one in names if one]
        end = nearest(part, known) if known else f"; it has {len(names)} without names"
        raise ValueError(f"part: there is no {part!r} in {file!r}{end}")
    try:
        if isinstance(part, bool):
            raise TypeError
        index = operator.index(part)
    except TypeError:
        raise TypeError(f"part: expected an index or a name, got {type(part).__name__}") from None
    if not 0 <= index < len(names):
        raise ValueError(f"part: expected 0 to {len(names) - 1} for {file!r}, got {index}")
    return index


def is_text(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


@contextmanager
def _damage_is_oserror(name: str) -> Iterator[None]:
    """OpenEXR raises whatever pybind11 makes of C++; names in a damaged file may not even be
    Unicode."""
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:
        words = in_one_line(error)
        raise OSError(f"{name!r}: damaged, or beyond OpenEXR: {words}") from error


def _part(index: int, header: Header, headers: Headers) -> Part:
    listed = header.get("channels")
    if listed is None:
        raise HeaderError("there is no list of channels")
    channels = channels_of(listed.data)
    x0, y0, x1, y1 = window_of(header.get("dataWindow"), "dataWindow")
    compression = header.get("compression")
    number = compression.data[0] if compression and compression.data else 0
    known = number < len(COMPRESSIONS)
    compressed = COMPRESSIONS[number] if known else _compression(number)
    views = header.get("multiView")
    several = views.value if views and isinstance(views.value, tuple) else ()
    return Part(
        index,
        header.text("name"),
        header.text("view"),
        _kind(header, headers.flags),
        tuple(decoded(name) for name, _, _ in channels),
        tuple(TYPES[kind] if 0 <= kind < 3 else "unknown" for _, _, kind in channels),
        (x0, y0),
        (x1, y1),
        compressed,
        compressed == "zstd",
        header.frame(),
        headers.plain,
        tuple(map(str, several)),
        readable_channels(listed.data),
    )


def _compare(parts: Sequence[Part], found: Sequence[Any]) -> None:
    """Raises HeaderError where OpenEXR reads the header in another way than we do."""
    ours = [(one.kind, one.first, one.last, one.readable) for one in parts]
    theirs = [
        (
            one.type().name,
            *(tuple(map(int, corner)) for corner in one.header["dataWindow"]),
            tuple(str(channel.name) for channel in one.header["channels"]),
        )
        for one in found
    ]
    if ours != theirs:
        raise HeaderError("what its headers say contradicts itself")


def _kind(header: Header, flags: int) -> str:
    found = header.text("type")
    if found or flags & SEVERAL_FLAG:
        return found
    if flags & DEEP_FLAG:
        return "deepscanline"
    return "tiledimage" if flags & TILED_FLAG else "scanlineimage"


def _compression(number: int) -> str:
    """A compression that came later, by the name that OpenEXR's package has for it."""
    import OpenEXR

    for name in dir(OpenEXR):
        kind, underscore, _ = name.partition("_COMPRESSION")
        if underscore and kind != "NO" and int(getattr(OpenEXR, name)) == number:
            return kind.lower()
    return f"number {number}"
