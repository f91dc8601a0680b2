"""Wavefront OBJ: polygons, their materials, colours of vertices.

As "Advanced Visualizer Manual", appendix B1 has it; colours after positions are a habit of many
programs, and are linear as materials' are.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.normals import facet_normals, smooth_normals
from moit.geometry.polygons import cut
from moit.geometry.reading.materials import UNKNOWN, Material, file_beside, read_materials
from moit.geometry.reading.parts import Part
from moit.reports.pictures import from_srgb

Array = NDArray[Any]
HEADS = {b"v ", b"vn", b"vt", b"f "}
SURFACES = {b"curv", b"curv2", b"surf", b"parm", b"cstype", b"bmat", b"call", b"csh"}


@dataclasses.dataclass
class _Lines:
    """What a file says, by kind. at : where in the file each face stands. states : from which face
    on there is which material, and whether facets are flat."""

    positions: list[bytes] = dataclasses.field(default_factory=list)
    places: list[bytes] = dataclasses.field(default_factory=list)
    normals: list[bytes] = dataclasses.field(default_factory=list)
    faces: list[bytes] = dataclasses.field(default_factory=list)
    at: list[int] = dataclasses.field(default_factory=list)
    states: list[tuple[int, int, bool]] = dataclasses.field(default_factory=list)
    counts: dict[int, tuple[int, int, int]] = dataclasses.field(default_factory=dict)
    names: list[str | None] = dataclasses.field(default_factory=lambda: [None])
    libraries: list[str] = dataclasses.field(default_factory=list)
    lacking: dict[str, None] = dataclasses.field(default_factory=dict)


def read_obj(path: str) -> tuple[list[Part], list[str]]:
    """The parts of a file, one for each run of triangles of one texture, and what is not drawn.

    Raises MeshError, which does not name the file yet.
    """
    with open(path, "rb") as file:
        lines = _lines(file.read())
    if not lines.faces:
        return [], list(lines.lacking)
    positions = _table(lines.positions, "v", (3, 4, 6, 7, 8))
    places = _table(lines.places, "vt", (1, 2, 3))
    normals = _table(lines.normals, "vn", (3,))
    corners, sizes = _corners(lines, (len(positions), len(places), len(normals)))
    materials = _materials(lines, os.path.dirname(path))
    chosen = cut(positions[corners[:, 0], :3], sizes)
    face = np.repeat(np.arange(len(sizes)), sizes)[chosen[:, 0]]
    triangles = corners[chosen]  # (T, 3, 3): position, place, normal
    from_face, materials_on, flat_on = np.array([(0, 0, 0), *lines.states]).T
    state = np.searchsorted(from_face, face, side="right") - 1
    flat = flat_on[state].astype(np.bool_)
    triangles, normals = _with_normals(triangles, positions, normals, flat)
    material = materials_on[state]
    runs = _runs(material, materials)
    parts = [
        _part(triangles[a:b], material[a:b], materials, (positions, places, normals))
        for a, b in runs
    ]
    return parts, list(lines.lacking)


def _lines(content: bytes) -> _Lines:
    found = _Lines()
    content = content.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    joins, comments = b"\\\n" in content, b"#" in content
    known: dict[str, int] = {}
    material, flat = 0, False
    pending = b""
    for number, line in enumerate(content.split(b"\n"), 1):
        if joins:
            line = pending + line
            pending = b""
            if line.endswith(b"\\"):
                pending = line[:-1] + b" "
                continue
        head = line[:2]
        if head not in HEADS:
            line = line.strip()
            words = line.split(None, 1)
            if not words or words[0][:1] == b"#":
                continue
            key, rest = words[0], words[1] if len(words) > 1 else b""
            if key in (b"v", b"vn", b"vt", b"f"):
                head = (key + b" ")[:2]
                line = key + b" " + rest
            elif key == b"usemtl":
                name = _text(rest)
                material = known.setdefault(name, len(found.names))
                if material == len(found.names):
                    found.names.append(name)
                found.states.append((len(found.faces), material, flat))
                continue
            elif key == b"mtllib":
                found.libraries.append(_text(rest))
                continue
            elif key == b"s":
                flat = rest.strip() in (b"off", b"0")
                found.states.append((len(found.faces), material, flat))
                continue
            else:
                if key in SURFACES:
                    found.lacking["curves and surfaces"] = None
                continue
        if comments and b"#" in line:
            line = line[: line.index(b"#")]
        if head == b"v ":
            found.positions.append(line[2:])
        elif head == b"vt":
            found.places.append(line[2:])
        elif head == b"vn":
            found.normals.append(line[2:])
        else:
            if b"-" in line:
                found.counts[len(found.faces)] = (
                    len(found.positions),
                    len(found.places),
                    len(found.normals),
                )
            found.faces.append(line[2:])
            found.at.append(number)
    return found


def _text(name: bytes) -> str:
    return name.strip().decode("utf-8", "surrogateescape")


def _numbers(text: bytes) -> NDArray[np.float64] | None:
    """All numbers of a text; None where it has anything else."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return np.fromstring(text, np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        return None


def _rows(rows: list[bytes], width: int) -> NDArray[np.float64] | None:
    """(n, width) numbers; None where a row has more, fewer, or anything else."""
    found = _numbers(b" nan ".join(rows) + b" nan ")  # what no row has keeps them apart
    if found is None or found.size != len(rows) * (width + 1):
        return None
    table = found.reshape(-1, width + 1)
    good = np.isnan(table[:, width]).all() and not np.isnan(table[:, :width]).any()
    return table[:, :width] if good else None


def _table(rows: list[bytes], name: str, widths: tuple[int, ...]) -> NDArray[np.float64]:
    """(n, most numbers in a row); NaN where a row has fewer."""
    if not rows:
        return np.zeros((0, widths[0]))
    width = len(rows[0].split())
    found = _rows(rows, width) if width in widths else None
    if found is not None and np.isfinite(found).all():
        return found
    table = np.full((len(rows), max(widths)), np.nan)  # rows differ, or one is wrong
    for i, row in enumerate(rows):
        numbers = _numbers(row)
        if (
            numbers is None
            or len(numbers) not in widths
            or not np.isfinite(numbers).all()
            or not row.strip()
        ):
            raise MeshError(
                f"{name} {i + 1}: found {row.strip().decode('utf-8', 'replace')!r:.80}; needed "
                f"{widths[0]} finite numbers" + (" or more" if len(widths) > 1 else "")
            )
        table[i, : len(numbers)] = numbers
    return table


# What a corner of a face is made of, and how each way of writing is told from the others: by how
# many slashes there are to a corner, and how many pairs of them.
FORMS = {(0, 0): (0,), (1, 0): (0, 1), (2, 1): (0, 2), (2, 0): (0, 1, 2)}


def _corners(lines: _Lines, counts: tuple[int, int, int]) -> tuple[Array, NDArray[np.int64]]:
    """(N, 3) position, place and normal of each corner, from 0, -1 for none; and sizes of faces."""
    alike = _alike(lines.faces)
    corners, sizes = _unlike(lines) if alike is None else alike
    start = np.cumsum(sizes) - sizes
    total = np.tile(np.array(counts), (len(corners), 1))
    for i, known in lines.counts.items():
        total[start[i] : start[i] + sizes[i]] = known
    resolved = np.where(corners > 0, corners - 1, np.where(corners < 0, total + corners, -1))
    wrong = (resolved >= np.array(counts)) | ((corners < 0) & (resolved < 0))
    wrong[:, 0] |= corners[:, 0] == 0
    if wrong.any():
        row, column = np.unravel_index(int(wrong.argmax()), wrong.shape)
        which = int(np.searchsorted(start, row, side="right")) - 1
        kind = ("v", "vt", "vn")[int(column)]
        raise MeshError(
            f"line {lines.at[which]}: found {kind} {corners[row, column]}; needed one of "
            f"{counts[int(column)]}, from 1"
        )
    return resolved, sizes


def _alike(faces: list[bytes]) -> tuple[Array, NDArray[np.int64]] | None:
    """Corners as they are written, and sizes, where all faces are written as the first: most files;
    None where they are not."""
    words = faces[0].split()
    slashes = words[0].count(b"/") if words else 0
    columns = FORMS.get((slashes, words[0].count(b"//"))) if words else None
    if columns is None:
        return None
    text = b"\n".join([face.strip() for face in faces]) + b"\n"
    corner = b"//" if columns == (0, 2) else b"/" * slashes
    form = b" ".join([corner] * len(words)) + b"\n"
    if text.translate(None, b"0123456789-") != form * len(faces):
        return None
    found = _numbers(text.replace(b"/", b" "))
    if found is None or found.size != len(faces) * len(words) * len(columns):
        return None
    if np.abs(found).max() >= 2**53:
        return None
    corners = np.zeros((len(faces) * len(words), 3), np.int64)
    corners[:, columns] = found.astype(np.int64).reshape(len(corners), -1)
    return corners, np.full(len(faces), len(words))


def _unlike(lines: _Lines) -> tuple[Array, NDArray[np.int64]]:
    """The same of faces in several forms."""
    sizes = np.array([len(face.split()) for face in lines.faces], np.int64)
    forms: dict[tuple[int, ...], list[int]] = {}
    for i, face in enumerate(lines.faces):
        size, slashes = int(sizes[i]), face.count(b"/")
        form: tuple[int, ...] | None = (0,)
        if slashes:
            per_corner = (slashes // size, face.count(b"//") // size)
            whole = slashes % size == 0 and face.count(b"//") in (0, size)
            form = FORMS.get(per_corner) if whole else None
        forms.setdefault(form or (), []).append(i)
    start = np.cumsum(sizes) - sizes
    corners = np.zeros((int(sizes.sum()), 3), np.int64)
    for columns, faces in forms.items():
        own = sizes[faces]
        rows = np.repeat(start[faces] - (np.cumsum(own) - own), own) + np.arange(int(own.sum()))
        found = None
        if columns:
            words = b" ".join([lines.faces[i] for i in faces]).split()
            found = _rows([word.replace(b"/", b" ") for word in words], len(columns))
        if found is not None and (found == np.rint(found)).all() and np.abs(found).max() < 2**53:
            corners[np.ix_(rows, np.array(columns))] = found.astype(np.int64)
            continue
        one_by_one = [_corner(word, lines.at[i]) for i in faces for word in lines.faces[i].split()]
        corners[rows] = np.array(one_by_one, np.int64).reshape(-1, 3)
    return corners, sizes


def _corner(word: bytes, line: int) -> tuple[int, int, int]:
    """A corner as 1/2/3, 1//3, 1/2 or 1; 0 for what it has not."""
    parts = word.split(b"/")
    try:
        numbers = [int(part) if part else 0 for part in parts]
        if len(numbers) > 3 or not all(-(2**53) < one < 2**53 for one in numbers):
            raise ValueError
    except ValueError:
        raise MeshError(
            f"line {line}: found {word.decode('utf-8', 'replace')!r:.40}; needed a corner such as "
            "1, 1/2, 1//3 or 1/2/3"
        ) from None
    position, place, normal = [*numbers, 0, 0][:3]
    return position, place, normal


def _materials(lines: _Lines, folder: str) -> list[Material]:
    """By number; 0 is of faces without one."""
    known: dict[str, Material] = {}
    for library in dict.fromkeys(lines.libraries):
        whole = file_beside(folder, library)
        names = [library] if whole else library.split()
        for name in names:
            path = file_beside(folder, name)
            if path is None:
                lines.lacking[f"the materials of {name!r}, which is not there"] = None
                continue
            known |= read_materials(path, lines.lacking)
    if not lines.libraries:
        return [UNKNOWN] * len(lines.names)
    for wanted in lines.names:
        if wanted is not None and wanted not in known:
            lines.lacking[f"the material {wanted!r}, which is not there"] = None
    return [UNKNOWN if name is None else known.get(name, UNKNOWN) for name in lines.names]


def _with_normals(
    triangles: Array, positions: Array, normals: Array, flat: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Corners that have no normal get one: the facet's where smoothing is off, else the mean of
    those round the position."""
    lack = triangles[..., 2] < 0
    if not lack.any():
        return triangles, normals
    triangles = triangles.copy()
    places = triangles[..., 0]
    smooth = lack & ~flat[:, None]
    more = [normals]
    if smooth.any():
        more.append(smooth_normals(positions[:, :3], places[~flat]))
        triangles[..., 2] = np.where(smooth, len(normals) + places, triangles[..., 2])
    if (lack & flat[:, None]).any():
        first = sum(len(one) for one in more)
        more.append(facet_normals(positions[:, :3][places]))
        own = np.broadcast_to(first + np.arange(len(triangles))[:, None], places.shape)
        triangles[..., 2] = np.where(lack & flat[:, None], own, triangles[..., 2])
    return triangles, np.concatenate(more)


def _runs(material: Array, materials: list[Material]) -> list[tuple[int, int]]:
    """Where triangles of one texture begin and end."""
    looks: dict[tuple[Any, ...], int] = {}
    numbers = np.array(
        [looks.setdefault((id(m.texture), m.scale, m.move), len(looks)) for m in materials]
    )
    of_triangle = numbers[material]
    ends = np.flatnonzero(np.diff(of_triangle)) + 1
    edges = [0, *ends.tolist(), len(material)]
    return [(a, b) for a, b in itertools.pairwise(edges) if b > a]


def _part(
    triangles: Array, material: Array, materials: list[Material], tables: tuple[Array, ...]
) -> Part:
    positions, places, normals = tables
    look = materials[int(material[0])]
    textured = look.texture is not None and bool((triangles[..., 1] >= 0).any())
    keys = [triangles[..., 0], triangles[..., 2], np.repeat(material[:, None], 3, axis=1)]
    if textured:
        keys.append(triangles[..., 1])
    rows = np.stack([key.reshape(-1) for key in keys], axis=1)
    rows, corners = _unique(rows)
    own = np.array([one.color for one in materials])[rows[:, 2]]
    color = own * _colors(positions[rows[:, 0]], rows[:, 2] == 0)
    uv = None
    if textured:
        given = rows[:, 3] >= 0
        found = places[np.maximum(rows[:, 3], 0)]
        if found.shape[1] < 2:
            found = np.concatenate([found, np.zeros((len(found), 1))], axis=1)
        found = np.where(given[:, None], np.nan_to_num(found[:, :2]), 0.0)
        uv = (found * look.scale + look.move) * (1, -1) + (0, 1)  # v runs up in these files
    return Part(
        points=positions[rows[:, 0], :3],
        triangles=corners.reshape(-1, 3),
        color=color,
        normals=normals[rows[:, 1]],
        uv=uv,
        texture=look.texture if textured else None,
    )


def _unique(rows: Array) -> tuple[Array, Array]:
    """Rows of integers without repetition, and which of these each was."""
    key = np.zeros(len(rows), np.int64)
    for column in rows.T:
        low, span = int(column.min()), int(column.max()) - int(column.min()) + 1
        if span > 1 and int(key.max(initial=0)) + 1 > 2**62 // span:
            key = np.unique(key, return_inverse=True)[1].reshape(-1)
        key = key * span + (column - low)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return rows[first], which.reshape(-1)


def _colors(positions: Array, bare: NDArray[np.bool_]) -> Array:
    """(n, 4): what the numbers after positions make of the colour of materials. bare : vertices
    without a material, whose own colour replaces grey."""
    found = np.ones((len(positions), 4))
    width = positions.shape[1]
    if width < 6:
        return found
    colored = np.isfinite(positions[:, 5])
    shades = positions[:, 3:6]
    if (shades[colored] < 0).any():
        raise MeshError("v: found a colour below 0 after a position; needed numbers in [0, 1]")
    if (shades[colored] > 1).any():  # bytes of a picture's colours
        shades = from_srgb(shades / 255)
    found[:, :3] = np.where(colored[:, None], shades, 1.0)
    if width >= 7:
        alpha = positions[:, 6]
        known = colored & np.isfinite(alpha)
        found[:, 3] = np.where(known, np.clip(np.nan_to_num(alpha), 0, 1), 1.0)
    found[:, :3] /= np.where(colored & bare, UNKNOWN.color[0], 1.0)[:, None]
    return found
