"""Whether an image file ends where its own numbers say: what a full disk tore does not.

Libraries that buffer what they write may lose the last of it without a word. To decode all of it
would take half as long as writing it; the lengths and check sums in the file say the same at once.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from collections.abc import Callable
from itertools import pairwise
from typing import BinaryIO

PNG_START = b"\x89PNG\r\n\x1a\n"
DEEP = 1 << 11  # of the flags behind OpenEXR's version


def is_whole(path: str) -> bool:
    """Whether all of a .png or .exr (of one part, of scan lines) is there."""
    check = _CHECKS[os.path.splitext(path)[1].lower()]
    try:
        with open(path, "rb") as file:
            return check(file, os.fstat(file.fileno()).st_size)
    except (struct.error, IndexError, ValueError, OSError):  # it ends early, or in nonsense
        return False


def _png(file: BinaryIO, size: int) -> bool:
    """W3C, Portable Network Graphics (Third Edition), 5: chunks, each with its check sum."""
    if file.read(len(PNG_START)) != PNG_START:
        return False
    name = b""
    while name != b"IEND":
        length, name = struct.unpack(">I4s", file.read(8))
        content = file.read(min(length, size))
        if struct.unpack(">I", file.read(4))[0] != zlib.crc32(content, zlib.crc32(name)):
            return False
    return file.tell() == size


def _exr(file: BinaryIO, size: int) -> bool:
    """OpenEXR File Layout: attributes, a table of places, and chunks one behind the other."""
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        at = 8  # behind the magic number and the version
        while content[at]:
            for _ in ("name", "type"):
                at = content.find(b"\0", at) + 1
            at += 4 + struct.unpack_from("<I", content, at)[0]
        at += 1
        first = struct.unpack_from("<Q", content, at)[0]
        if not at < first < size or (first - at) % 8:
            return False
        places = [*struct.unpack_from(f"<{(first - at) // 8}Q", content, at), size]
        length = _deep_chunk if struct.unpack_from("<4xI", content)[0] & DEEP else _flat_chunk
        return all(place + length(content, place) == end for place, end in pairwise(places))


def _flat_chunk(content: mmap.mmap, at: int) -> int:
    return 8 + int(struct.unpack_from("<4xI", content, at)[0])


def _deep_chunk(content: mmap.mmap, at: int) -> int:
    counts, samples, _ = struct.unpack_from("<4x3Q", content, at)
    return 28 + int(counts + samples)


_CHECKS: dict[str, Callable[[BinaryIO, int], bool]] = {".png": _png, ".exr": _exr}
