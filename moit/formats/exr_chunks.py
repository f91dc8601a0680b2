"""Chunks of OpenEXR files of several parts: where they are, copied as they are.

A chunk of such a file begins with its part's index; what follows is as in a file of one part.
OpenEXR File Layout, openexr.com.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from typing import BinaryIO

from moit.formats.exr_headers import Header, HeaderError, Headers

# Of each kind of part: the bytes of a chunk's place in the image, and how its lengths are stored.
KINDS = {
    "scanlineimage": (4, "<i"),
    "tiledimage": (16, "<i"),
    "deepscanline": (4, "<3Q"),
    "deeptile": (16, "<3Q"),
}


def chunk_count(header: Header) -> int:
    found = header.get("chunkCount")
    count = found.value if found else None
    if not isinstance(count, int) or count < 0:
        raise HeaderError("a part has no number of chunks")
    return count


def chunks_of(stream: BinaryIO, headers: Headers, index: int) -> Iterator[bytes]:
    """The chunks of a part of a file of several, in the order of its table, without the part's
    index. Raises HeaderError where one is not in the file."""
    counts = [chunk_count(one) for one in headers.parts]
    table = headers.parts[-1].end + 2 + 8 * sum(counts[:index])
    stream.seek(table)
    places = struct.unpack(f"<{counts[index]}Q", _taken(stream, 8 * counts[index]))
    kind = headers.parts[index].text("type")
    if kind not in KINDS:
        raise HeaderError(f"a part is of no known kind: {kind!r:.80}")
    begin, lengths = KINDS[kind]
    size = stream.seek(0, os.SEEK_END)
    for place in places:
        if not table < place < size:
            raise HeaderError("a chunk lies outside of the file")
        stream.seek(place)
        start = _taken(stream, 4 + begin + struct.calcsize(lengths))
        (part,) = struct.unpack_from("<i", start)
        given = struct.unpack_from(lengths, start, 4 + begin)
        length = sum(given[:2])  # of deep ones the third is that before compression
        if part != index or not 0 <= length <= size - stream.tell():
            raise HeaderError("a chunk is not what its table says")
        yield start[4:] + _taken(stream, length)


def _taken(stream: BinaryIO, count: int) -> bytes:
    found = stream.read(count)
    if len(found) != count:
        raise HeaderError("the file ends within a chunk")
    return found
