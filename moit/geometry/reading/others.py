"""OFF, STL, and whatever else trimesh reads."""

from __future__ import annotations

import re
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.foreign import GREY, foreign_meshes
from moit.geometry.normals import smooth_normals
from moit.geometry.reading.parts import Part
from moit.geometry.reading.polygon_soup import linear, part_of_polygons

Array = NDArray[Any]
Found = tuple[list[Part], list[str]]


def read_by_trimesh(path: str) -> Found:
    """The parts of a file. Raises MeshError, which does not name the file yet."""
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "a mesh file of this kind needs trimesh: pip install 'moit[mesh]' installs it"
        ) from error
    try:
        given = foreign_meshes(trimesh.load_scene(path)) or []
    except MeshError:
        raise
    except Exception as error:  # trimesh and its readers raise anything
        raise MeshError(f"cannot be read as a mesh: {error}") from error
    return [_part(arguments) for arguments in given if len(arguments["triangles"])], []


def _part(arguments: dict[str, Any]) -> Part:
    points = np.asarray(arguments.pop("vertices"), np.float64)
    return Part(points=points, color=np.asarray(arguments.pop("color")), **arguments)


def read_stl(path: str) -> Found:
    """Corners at one place are one vertex, so that round things look round."""
    with open(path, "rb") as file:
        content = file.read()
    count = struct.unpack_from("<I", content, 80)[0] if len(content) >= 84 else -1
    text = content.lstrip()[:5].lower() == b"solid"
    if count >= 0 and (len(content) == 84 + 50 * count or not text):
        if len(content) < 84 + 50 * count:
            raise MeshError(f"ends within its {count} triangles")
        rows = np.frombuffer(
            content, [("", "<f4", 3), ("at", "<f4", (3, 3)), ("", "<u2")], count, 84
        )
        corners = rows["at"].reshape(-1, 3).astype(np.float64)
    elif text:
        number = rb"\s+([-+.\deE]+)"
        found = re.findall(rb"\bvertex" + number * 3, content, re.IGNORECASE)
        try:
            corners = np.array(found, np.bytes_).astype(np.float64).reshape(-1, 3)
        except ValueError:
            raise MeshError("a vertex: needed three numbers") from None
    else:
        raise MeshError("is no STL file: neither text nor triangles of 50 bytes")
    if len(corners) % 3:
        raise MeshError(f"found {len(corners)} corners; needed three for each triangle")
    if not np.isfinite(corners).all():
        raise MeshError("a vertex: found a number that is not finite")
    corners = corners + 0.0  # -0 and 0 are one place
    rows = np.ascontiguousarray(corners).view([("", np.float64)] * 3).reshape(-1)
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    points, triangles = corners[first], which.reshape(-1, 3)
    color = np.full(3, GREY)
    return [Part(points, triangles, color, smooth_normals(points, triangles))], []


def read_off(path: str) -> Found:
    """OFF and its kin with normals, colours and texture coordinates of vertices (Geomview's
    manual); faces' colours of three or four numbers."""
    with open(path, "rb") as file:
        text = file.read()
    if b"\0" in text[:512] or re.match(rb"\s*\w*OFF\s+BINARY", text):
        raise MeshError("is a binary OFF file, which is not read")
    lines = [line.split(b"#")[0].split() for line in text.splitlines()]
    lines = [line for line in lines if line]
    kind = re.fullmatch(rb"(ST)?(C)?(N)?(4)?(n)?OFF", lines[0][0]) if lines else None
    if kind is None:
        raise MeshError("does not begin with OFF")
    if kind.group(4) or kind.group(5):
        raise MeshError("has vertices of other than three dimensions, which are not read")
    lines[0] = lines[0][1:]  # counts may stand in the same line
    lines = lines if lines[0] else lines[1:]
    try:
        vertices, faces = (int(word) for word in lines[0][:2])
    except (ValueError, IndexError):
        raise MeshError("needed the numbers of its vertices and faces") from None
    if vertices < 0 or faces < 0 or len(lines) - 1 < vertices + faces:
        raise MeshError(f"ends within its {vertices} vertices and {faces} faces")
    table = _table(lines[1 : 1 + vertices])
    used = 3 + (3 if kind.group(3) else 0)
    normals = table[:, 3:6] if kind.group(3) and table.shape[1] >= 6 else None
    color = None
    if kind.group(2) or (not kind.group(1) and table.shape[1] - used in (3, 4)):
        width = min(table.shape[1] - used - (2 if kind.group(1) else 0), 4)
        if width in (3, 4):
            color = _shades(table[:, used : used + width], lines[1 : 1 + vertices], used)
    corners, sizes, shades = _faces(lines[1 + vertices : 1 + vertices + faces])
    part = part_of_polygons(
        table[:, :3], corners, sizes, color=color, normals=normals, face_color=shades
    )
    return [part], []


def _table(lines: list[list[bytes]]) -> NDArray[np.float64]:
    width = len(lines[0]) if lines else 3
    try:
        found = np.array(lines, np.bytes_).astype(np.float64).reshape(len(lines), -1)
    except ValueError:
        raise MeshError(f"a vertex: needed {width} numbers, as the first has") from None
    if found.shape[1] < 3:
        raise MeshError(f"a vertex: found {width} numbers; needed three or more")
    return found


def _shades(table: Array, lines: list[list[bytes]], used: int) -> Array:
    """Whole numbers are bytes, others shares of 1."""
    whole = all(b"." not in word for line in lines[:1] for word in line[used:])
    return linear(table, 255.0 if whole and table.max(initial=0) > 1 else 1.0)


def _faces(lines: list[list[bytes]]) -> tuple[Array, Array, Array | None]:
    corners: list[bytes] = []
    sizes: list[int] = []
    shades: list[list[bytes]] = []
    try:
        for line in lines:
            size = int(line[0])
            if not 0 <= size < len(line):
                raise ValueError
            sizes.append(size)
            corners += line[1 : 1 + size]
            shades.append(line[1 + size :])
        found = np.array([int(one) for one in corners], np.int64)
    except (ValueError, OverflowError):
        raise MeshError(f"face {len(sizes)}: needed how many vertices, and these") from None
    if not shades or not all(len(shade) in (3, 4) for shade in shades):
        return found, np.array(sizes, np.int64), None
    width = min(len(shade) for shade in shades)
    try:
        table = np.array([shade[:width] for shade in shades], np.bytes_).astype(np.float64)
    except ValueError:
        raise MeshError("a face: its colour needs to be numbers") from None
    return found, np.array(sizes, np.int64), _shades(table, shades, 0)
