"""PLY: polygons, strips, colours and textures. Format by Greg Turk, 1994."""

from __future__ import annotations

import dataclasses
import os
import re
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.reading.materials import file_beside
from moit.geometry.reading.parts import Part
from moit.geometry.reading.pictures import decoded
from moit.geometry.reading.polygon_soup import linear, part_of_polygons
from moit.geometry.textures import Texture

Array = NDArray[Any]

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
SPLATS = ({"scale_0", "rot_0", "opacity"}, {"packed_position", "packed_scale"})
List = tuple[Array, Array]  # all items, and (n,) how many each row has


@dataclasses.dataclass
class _Element:
    """scalars : name to type; lists : name to the types of count and items; in `order`."""

    name: str
    count: int
    scalars: dict[str, str] = dataclasses.field(default_factory=dict)
    lists: dict[str, tuple[str, str]] = dataclasses.field(default_factory=dict)
    order: list[str] = dataclasses.field(default_factory=list)


def read_ply(path: str) -> tuple[list[Part], list[str]]:
    """The part of a file, and what of it is not drawn.

    Raises MeshError, which does not name the file yet.
    """
    with open(path, "rb") as file:
        content = file.read()
    elements, order, start, comments = _header(content)
    vertex = next((one for one in elements if one.name == "vertex"), None)
    if vertex is None:
        raise MeshError("has no vertices")
    if any(names <= {*vertex.scalars} for names in SPLATS):
        raise MeshError(
            f"holds {vertex.count} Gaussian splats (scale, rotation and opacity of each), not "
            "triangles; moit.read_splats reads them"
        )
    held = _rows(content, elements, order, start)
    corners, sizes, faces = _polygons(held)
    if not len(sizes):
        raise MeshError(f"expected triangles, found {vertex.count} points without faces")
    return _part(held["vertex"], vertex, corners, sizes, faces, elements, comments, path)


def read_vertices(content: bytes) -> tuple[dict[str, Any], list[str]]:
    """Of a file's vertices the columns by name, and its comments. Raises MeshError."""
    elements, order, start, comments = _header(content)
    if not any(one.name == "vertex" for one in elements):
        raise MeshError("has no vertices")
    return _rows(content, elements, order, start)["vertex"], comments


def _rows(
    content: bytes, elements: list[_Element], order: str, start: int
) -> dict[str, dict[str, Any]]:
    body = content[start:]
    rows = _ascii(body, elements) if order == "" else _binary(body, elements, order)
    return dict(zip((one.name for one in elements), rows, strict=True))


def _header(content: bytes) -> tuple[list[_Element], str, int, list[str]]:
    found = re.match(rb"ply\s*?\r?\n(.*?)\bend_header[ \t]*(\r\n|\n|\r)", content, re.DOTALL)
    if found is None:
        raise MeshError("has no header of a PLY file")
    elements: list[_Element] = []
    order = None
    comments: list[str] = []
    for line in found.group(1).decode("utf-8", "surrogateescape").splitlines():
        words = line.split()
        if not words or words[0] == "obj_info":
            continue
        if words[0] == "comment":
            comments.append(line.split(None, 1)[1] if len(words) > 1 else "")
        elif words[0] == "format" and len(words) == 3 and words[1] in FORMATS:
            order = FORMATS[words[1]]
        elif words[0] == "element" and len(words) == 3 and re.fullmatch(r"\d{1,18}", words[2]):
            elements.append(_Element(words[1], int(words[2])))
        elif words[0] == "property" and elements and _property(elements[-1], words):
            continue
        else:
            raise MeshError(f"its header has the line {line!r:.80}")
    if order is None:
        raise MeshError("its header names no format")
    return elements, order, found.end(), comments


def _property(element: _Element, words: list[str]) -> bool:
    name = words[-1]
    if name in element.order:
        return False
    if len(words) == 3 and words[1] in TYPES:
        element.scalars[name] = TYPES[words[1]]
    elif len(words) == 5 and words[1] == "list" and words[2] in TYPES and words[3] in TYPES:
        if TYPES[words[2]][0] == "f":
            return False
        element.lists[name] = TYPES[words[2]], TYPES[words[3]]
    else:
        return False
    element.order.append(name)
    return True


# Rows are a dictionary: a scalar is (n,) numbers, a list is a List.


def _ascii(body: bytes, elements: list[_Element]) -> list[dict[str, Any]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            numbers = np.fromstring(body, np.float64, sep=" ") if body.strip() else np.zeros(0)
    except (ValueError, DeprecationWarning):
        raise MeshError("has something else than numbers after its header") from None
    at = 0
    found = []
    for element in elements:
        least = len(element.order)
        if element.count * least > len(numbers) - at:
            raise MeshError(f"ends within its {element.count} rows of {element.name!r}")
        if not element.lists:
            block = numbers[at : at + element.count * least].reshape(element.count, least)
            found.append({name: block[:, k] for k, name in enumerate(element.order)})
            at += element.count * least
            continue
        rows, at = _lists_of_numbers(numbers, at, element)
        found.append(rows)
    return found


def _lists_of_numbers(numbers: Array, at: int, element: _Element) -> tuple[dict[str, Any], int]:
    count = element.count
    if element.order == [*element.lists][:1] and count:  # a list and nothing else, often as long
        size = int(numbers[at])
        end = at + count * (size + 1)
        if size >= 0 and end <= len(numbers):
            block = numbers[at:end].reshape(count, size + 1)
            if (block[:, 0] == size).all():
                items = block[:, 1:].reshape(-1)
                return {element.order[0]: (items, np.full(count, size))}, end
    columns: dict[str, list[Any]] = {name: [] for name in element.order}
    sizes: dict[str, list[int]] = {name: [] for name in element.lists}
    for _ in range(count):
        for name in element.order:
            if at >= len(numbers):
                raise MeshError(f"ends within its {count} rows of {element.name!r}")
            if name not in element.lists:
                columns[name].append(numbers[at])
                at += 1
                continue
            size = int(numbers[at]) if 0 <= numbers[at] <= len(numbers) else -1
            if size < 0 or at + 1 + size > len(numbers):
                raise MeshError(f"{element.name}: found a list of {numbers[at]:g} items")
            columns[name].append(numbers[at + 1 : at + 1 + size])
            sizes[name].append(size)
            at += 1 + size
    return _gathered(columns, sizes), at


def _gathered(columns: dict[str, list[Any]], sizes: dict[str, list[int]]) -> dict[str, Any]:
    return {
        name: (np.concatenate([np.zeros(0), *column]), np.array(sizes[name], np.int64))
        if name in sizes
        else np.array(column)
        for name, column in columns.items()
    }


def _binary(body: bytes, elements: list[_Element], order: str) -> list[dict[str, Any]]:
    at = 0
    found: list[dict[str, Any]] = []
    for element in elements:
        if not element.order:
            found.append({})
            continue
        fields: Any = [
            (name, order + (element.scalars.get(name) or element.lists[name][0]))
            for name in element.order
        ]
        size = np.dtype(fields).itemsize * element.count
        if size > len(body) - at:
            raise MeshError(f"ends within its {element.count} rows of {element.name!r}")
        if not element.lists:
            rows = np.frombuffer(body, np.dtype(fields), element.count, at)
            found.append({name: rows[name] for name in element.order})
            at += size
            continue
        some, at = _lists_of_bytes(body, at, element, order)
        found.append(some)
    return found


def _lists_of_bytes(
    body: bytes, at: int, element: _Element, order: str
) -> tuple[dict[str, Any], int]:
    count = element.count
    kinds = {name: np.dtype(order + kind) for name, kind in element.scalars.items()}
    pairs = {
        name: (np.dtype(order + length), np.dtype(order + item))
        for name, (length, item) in element.lists.items()
    }
    uniform = _uniform(body, at, element, kinds, pairs) if count else None
    if uniform is not None:
        return uniform
    columns: dict[str, list[Any]] = {name: [] for name in element.order}
    sizes: dict[str, list[int]] = {name: [] for name in element.lists}
    try:
        for _ in range(count):
            for name in element.order:
                if name in kinds:
                    columns[name].append(np.frombuffer(body, kinds[name], 1, at)[0])
                    at += kinds[name].itemsize
                    continue
                length, item = pairs[name]
                size = int(np.frombuffer(body, length, 1, at)[0])
                at += length.itemsize
                if size < 0:
                    raise MeshError(f"{element.name}: found a list of {size} items")
                columns[name].append(np.frombuffer(body, item, size, at) if size else ())
                sizes[name].append(size)
                at += size * item.itemsize
    except ValueError as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"ends within its {count} rows of {element.name!r}") from None
    return _gathered(columns, sizes), at


def _uniform(
    body: bytes, at: int, element: _Element, kinds: dict[str, Any], pairs: dict[str, Any]
) -> tuple[dict[str, Any], int] | None:
    """Where all lists of a name are as long as the first."""
    fields: list[Any] = []
    lengths: dict[str, int] = {}
    first = at
    for k, name in enumerate(element.order):
        if name in kinds:
            fields.append((name, kinds[name]))
            first += kinds[name].itemsize
            continue
        length, item = pairs[name]
        if first + length.itemsize > len(body):
            return None
        size = int(np.frombuffer(body, length, 1, first)[0])
        if not 0 <= size * item.itemsize <= len(body):
            return None
        lengths[name] = size
        fields += [(f"{k} long", length), (name, item, (size,))]
        first += length.itemsize + size * item.itemsize
    dtype = np.dtype(fields)
    if dtype.itemsize * element.count > len(body) - at:
        return None
    rows = np.frombuffer(body, dtype, element.count, at)
    for k, name in enumerate(element.order):
        if name in lengths and (rows[f"{k} long"] != lengths[name]).any():
            return None
    found: dict[str, Any] = {
        name: (rows[name].reshape(-1), np.full(element.count, lengths[name]))
        if name in lengths
        else rows[name]
        for name in element.order
    }
    return found, at + dtype.itemsize * element.count


def _polygons(held: dict[str, dict[str, Any]]) -> tuple[Array, Array, dict[str, Any]]:
    """(N,) corners, (P,) sizes, and the rows of faces."""
    faces = held.get("face", {})
    for name in ("vertex_indices", "vertex_index"):
        if isinstance(faces.get(name), tuple):
            corners, sizes = faces[name]
            return _whole(corners), sizes, faces
    strips = held.get("tristrips", {}).get("vertex_indices")
    if not isinstance(strips, tuple):
        return np.zeros(0, np.int64), np.zeros(0, np.int64), {}
    corners, sizes = _whole(strips[0]), strips[1]
    found = [np.zeros((0, 3), np.int64)]
    for row in np.split(corners, np.cumsum(sizes)[:-1]):
        for strip in np.split(row, np.flatnonzero(row < 0)):
            strip = strip[strip >= 0]
            if len(strip) > 2:
                triangles = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
                triangles[1::2] = triangles[1::2, [0, 2, 1]]  # each other one is turned over
                found.append(triangles)
    triangles = np.concatenate(found)
    return triangles.reshape(-1), np.full(len(triangles), 3), {}


def _whole(numbers: Array) -> NDArray[np.int64]:
    if numbers.dtype.kind == "f" and not (
        np.isfinite(numbers).all() and (np.abs(numbers) < 2**53).all()
    ):
        raise MeshError("a face: found a vertex that is no number of one")
    return np.asarray(numbers, np.int64)


def _columns(rows: dict[str, Any], *choices: str) -> list[str] | None:
    """The names, of each choice given with spaces between, that are all there."""
    for choice in choices:
        if all(isinstance(rows.get(name), np.ndarray) for name in choice.split()):
            return choice.split()
    return None


def _stacked(rows: dict[str, Any], names: list[str]) -> NDArray[np.float64]:
    return np.stack([np.asarray(rows[name], np.float64) for name in names], axis=1)


def _color(rows: dict[str, Any], kinds: dict[str, str]) -> Array | None:
    names = _columns(
        rows,
        "red green blue alpha",
        "red green blue",
        "diffuse_red diffuse_green diffuse_blue",
        "r g b a",
        "r g b",
    )
    if names is None:
        return None
    most = {"u1": 255.0, "u2": 65535.0, "i4": 255.0, "u4": 255.0}.get(kinds[names[0]], 1.0)
    return linear(_stacked(rows, names), most)


def _part(
    rows: dict[str, Any],
    vertex: _Element,
    corners: Array,
    sizes: Array,
    faces: dict[str, Any],
    elements: list[_Element],
    comments: list[str],
    path: str,
) -> tuple[list[Part], list[str]]:
    if _columns(rows, "x y z") is None:
        raise MeshError("its vertices have no x, y and z")
    normals = _columns(rows, "nx ny nz")
    uv = _columns(rows, "u v", "s t", "texture_u texture_v")
    per_corner = faces.get("texcoord")
    kinds = next((one.scalars for one in elements if one.name == "face"), {})
    face_color = _color(faces, kinds)
    corner_uv = None
    if isinstance(per_corner, tuple) and (per_corner[1] == 2 * sizes).all():
        corner_uv = np.asarray(per_corner[0], np.float64).reshape(-1, 2) * (1, -1) + (0, 1)
    texture, lacking = None, []
    named = [one.split(None, 1)[1] for one in comments if re.match(r"TextureFile\s+\S", one)]
    if named and (uv is not None or corner_uv is not None):
        picture = file_beside(os.path.dirname(path), named[0])
        if picture is None:
            lacking.append(f"the texture {named[0]!r}, which is not there")
        elif len(named) > 1:
            lacking.append("textures beyond the first")
        if picture is not None:
            with open(picture, "rb") as file:
                texture = Texture(decoded(file.read(), repr(picture)), color_space="srgb")
    part = part_of_polygons(
        _stacked(rows, ["x", "y", "z"]),
        corners,
        sizes,
        color=_color(rows, vertex.scalars),
        normals=None if normals is None else _stacked(rows, normals),
        face_color=face_color,
        uv=None if uv is None else _stacked(rows, uv) * (1, -1) + (0, 1),  # v runs up there
        corner_uv=corner_uv,
        texture=texture,
    )
    return [part], lacking
