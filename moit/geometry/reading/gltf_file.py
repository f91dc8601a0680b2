"""A glTF 2.0 file (.gltf, .glb): its JSON, its bytes, and the numbers of its accessors.

As the specification of the Khronos Group has them, sections 3.6 and 4; every offset and count is
held against the bytes there are.
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import struct
import urllib.parse
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.reading.json_values import Entry

Array = NDArray[Any]

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
SHAPES = {
    "SCALAR": (1, 1),
    "VEC2": (1, 2),
    "VEC3": (1, 3),
    "VEC4": (1, 4),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}
MOST_ZEROS = 2**24  # numbers of an accessor without bytes: a few letters could ask for any


class GltfFile:
    """What a file holds. Raises MeshError, which does not name the file yet."""

    def __init__(self, path: str) -> None:
        self.folder = os.path.dirname(path)
        with open(path, "rb") as file:
            content = file.read()
        text, self._chunk = _chunks(content) if content[:4] == b"glTF" else (content, None)
        try:
            found = json.loads(text.decode("utf-8-sig"))
        except (ValueError, RecursionError) as error:
            raise MeshError(f"its JSON is damaged: {error}") from None
        if not isinstance(found, dict):
            raise MeshError(f"found {type(found).__name__}; needed a JSON object")
        self.root = Entry(found)
        version = self.root.entry("asset").text("version")
        if not version.startswith("2."):
            raise MeshError(f"asset.version: found {version!r}; only 2.x is read")
        self.buffers = self.root.entries("buffers")
        self.views = self.root.entries("bufferViews")
        self.accessors = self.root.entries("accessors")
        self._held: dict[int, memoryview] = {}

    def _buffer(self, index: int) -> memoryview:
        if index not in self._held:
            self._held[index] = self._bytes_of(index)
        return self._held[index]

    def _bytes_of(self, index: int) -> memoryview:
        entry = self.buffers[index]
        length = entry.integer("byteLength", least=1)
        uri = entry.text("uri", None)
        if uri is not None:
            found = self.resource(uri, entry.place("uri"))
        elif index == 0 and self._chunk is not None:
            found = self._chunk
        else:
            raise MeshError(f"{entry.where}: has no bytes: neither a uri nor the file's own chunk")
        if len(found) < length:
            raise MeshError(
                f"{entry.where}: has {len(found)} bytes; needed its byteLength, {length}"
            )
        return memoryview(found)[:length]

    def resource(self, uri: str, where: str) -> bytes | memoryview:
        """What a URI leads to: data of its own, or a file beside this one."""
        if uri.startswith("data:"):
            head, comma, data = uri.partition(",")
            if not comma:
                raise MeshError(f"{where}: found a data URI without data")
            if not head.endswith(";base64"):
                return urllib.parse.unquote_to_bytes(data)
            try:
                return base64.b64decode(urllib.parse.unquote(data) if "%" in data else data)
            except (binascii.Error, ValueError) as error:
                raise MeshError(f"{where}: its base64 is damaged: {error}") from None
        name = urllib.parse.unquote(uri)
        if urllib.parse.urlsplit(uri).scheme or os.path.isabs(name) or "\0" in name:
            raise MeshError(f"{where}: found {uri!r:.80}; needed data or a file beside this one")
        path = os.path.join(self.folder, name)
        if not os.path.isfile(path):
            raise MeshError(f"{where}: there is no file {path!r}")
        with open(path, "rb") as file:
            return file.read()

    def view(self, index: int) -> memoryview:
        """The bytes of a buffer view."""
        entry = self.views[index]
        held = self._buffer(entry.index("buffer", len(self.buffers)))
        start = entry.integer("byteOffset", 0)
        length = entry.integer("byteLength", least=1)
        if start + length > len(held):
            raise MeshError(
                f"{entry.where}: ends at byte {start + length} of a buffer of {len(held)}"
            )
        return held[start : start + length]

    def numbers(self, index: int) -> Array:
        """(count, components) of an accessor; those that are normalised as float64 fractions, all
        else in its own type. A matrix is components column by column."""
        entry = self.accessors[index]
        component = entry.integer("componentType")
        if component not in COMPONENTS:
            raise MeshError(f"{entry.place('componentType')}: found {component}, which is unknown")
        kind = entry.text("type")
        if kind not in SHAPES:
            raise MeshError(f"{entry.place('type')}: found {kind!r:.80}, which is unknown")
        columns, rows = SHAPES[kind]
        count = entry.integer("count", least=1)
        dtype = np.dtype(COMPONENTS[component])
        column = rows * dtype.itemsize
        if columns > 1:
            column = -(-column // 4) * 4  # columns of matrices start at multiples of four bytes
        size = (columns - 1) * column + rows * dtype.itemsize
        if "bufferView" in entry:
            found = self._strided(entry, (count, columns, rows), (size, column), dtype)
        elif count * columns * rows <= MOST_ZEROS:
            found = np.zeros((count, columns * rows), dtype)
        else:
            raise MeshError(f"{entry.where}: found {count} elements without bytes")
        if "sparse" in entry:
            found = self._with_exceptions(entry.entry("sparse"), found, (columns, rows), dtype)
        if entry.value.get("normalized") is True and dtype.kind != "f":
            found = np.maximum(found / np.float64(np.iinfo(dtype).max), -1.0)
        return found

    def _strided(
        self, entry: Entry, shape: tuple[int, int, int], sizes: tuple[int, int], dtype: Any
    ) -> Array:
        index = entry.index("bufferView", len(self.views))
        held = self.view(index)
        size, column = sizes
        stride = self.views[index].integer("byteStride", 0)
        step = stride or -(-size // dtype.itemsize) * dtype.itemsize
        if shape[1] > 1 and not stride:
            step = shape[1] * column
        if step < size and shape[0] > 1:
            raise MeshError(f"{self.views[index].place('byteStride')}: {step} is less than {size}")
        start = entry.integer("byteOffset", 0)
        end = start + step * (shape[0] - 1) + size
        if end > len(held):
            raise MeshError(
                f"{entry.where}: {shape[0]} elements end at byte {end} of a view of {len(held)}"
            )
        spread = np.ndarray(shape, dtype, held, start, (step, column, dtype.itemsize))
        return spread.reshape(shape[0], -1)

    def _with_exceptions(
        self, sparse: Entry, found: Array, shape: tuple[int, int], dtype: np.dtype[Any]
    ) -> Array:
        count = sparse.integer("count", least=1, most=len(found))
        places = self._packed(sparse.entry("indices"), count, (1, 1), None)[:, 0].astype(np.int64)
        values = self._packed(sparse.entry("values"), count, shape, dtype)
        if places.max() >= len(found):
            place = sparse.place("indices")
            raise MeshError(f"{place}: found {places.max()}; needed one of {len(found)}, from 0")
        found = found.copy()
        found[places] = values
        return found

    def _packed(
        self, entry: Entry, count: int, shape: tuple[int, int], dtype: np.dtype[Any] | None
    ) -> Array:
        if dtype is None:
            component = entry.integer("componentType")
            if component not in (5121, 5123, 5125):
                raise MeshError(f"{entry.place('componentType')}: found {component}")
            dtype = np.dtype(COMPONENTS[component])
        columns, rows = shape
        column = rows * dtype.itemsize
        if columns > 1:
            column = -(-column // 4) * 4
        size = (columns - 1) * column + rows * dtype.itemsize
        return self._strided(entry, (count, columns, rows), (size, column), dtype)


def _chunks(content: bytes) -> tuple[bytes, memoryview | None]:
    """The JSON and the bytes of a GLB file."""
    if len(content) < 20:
        raise MeshError("ends within its header")
    version, length = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise MeshError(f"found version {version} of GLB; only 2 is read")
    if length > len(content):
        raise MeshError(f"has {len(content)} bytes; its header says {length}")
    at, text, binary = 12, None, None
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", content, at)
        if at + 8 + size > length:
            raise MeshError(f"a chunk ends at byte {at + 8 + size} of {length}")
        if text is None:
            if kind != b"JSON":
                raise MeshError(f"its first chunk is {kind!r}; needed JSON")
            text = content[at + 8 : at + 8 + size]
        elif binary is None and kind == b"BIN\0":
            binary = memoryview(content)[at + 8 : at + 8 + size]
        at += 8 + size
    if text is None:
        raise MeshError("has no JSON")
    return text, binary
