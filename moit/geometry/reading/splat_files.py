"""Files of Gaussian splats: PLY as 3D Gaussian Splatting writes it, .splat and .spz."""

from __future__ import annotations

import gzip
import io
import os
import re
import struct
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import path_name
from moit.checks.exceptions import MeshError, SplatsError
from moit.geometry.reading.ply import read_vertices
from moit.geometry.splats import ARRAYS, CONVENTIONS, DEGREES, OF_DEGREE_0, Splats
from moit.system.files import write_bytes

Array = NDArray[Any]
Arrays = dict[str, Any]  # as Splats takes them, in a file's axes

# Half a turn about x, which leads from axes right, down, forward to right, up, back: what it makes
# of the spherical harmonics up to degree 3, each of which has y and z to even or odd powers.
TURNED = np.array([1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1], np.float64)


def read_splats(path: str | os.PathLike[str], *, convention: str = "3dgs") -> Splats:
    """The splats of a file: PLY as 3D Gaussian Splatting writes it, .splat or .spz.

    path : .ply has x y z, f_dc_0..2, f_rest_* of degree 0 to 3, opacity (a logit), scale_0..2
        (logarithms; a third that is missing, as 2D splats have it, is 0) and rot_0..3 (w x y z). A
        filter_3D, as Mip-Splatting has it, makes splats larger, and as much less opaque. Comments
        may say "SplatRenderMode: mip" or "antialiased 1": then splats are antialiased
        (`moit.Splats`), as where an .spz says so; or "SplatRenderMode: 2dgs": then their third
        scale is 0.
        .splat has 32 bytes a splat, no harmonics; .spz is read in versions 1 to 4, the last by the
        package zstandard.
    convention : as of `moit.Splats`.

    Axes of .ply and .splat, right, down, forward, are turned to those of moit.Camera, y up; those
    of .spz are so already. Splats whose numbers are not finite are refused, not dropped.

    Raises FileNotFoundError where there is no such file, SplatsError (a ValueError) that names the
    file where it cannot be read or holds none, and ImportError where a package is missing.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9])
    >>> moit.write_splats("ball.ply", ball)
    >>> moit.read_splats("ball.ply")
    Splats(1, degree 0, convention '3dgs')
    """
    name = path_name(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in READERS:
        raise SplatsError(f"{name!r}: expected a file {', '.join(READERS)}, got {ending!r}")
    with open(name, "rb") as file:
        content = file.read()
    try:
        arrays: dict[str, Any] = READERS[ending](content)
        return Splats(**arrays, convention=convention)
    except (MeshError, SplatsError, ValueError) as error:
        if convention not in CONVENTIONS:
            raise
        raise SplatsError(f"{name!r}: {error}") from None


def holds_splats(path: str) -> bool:
    """Whether a file is one of splats, and not of a mesh."""
    ending = os.path.splitext(path)[1].lower()
    if ending != ".ply":
        return ending in READERS
    with open(path, "rb") as file:
        header = file.read(1 << 16).partition(b"end_header")[0].split()
    return {b"scale_0", b"rot_0", b"opacity"} <= set(header)


def write_splats(path: str | os.PathLike[str], splats: Splats) -> None:
    """Writes a .ply as 3D Gaussian Splatting does, whole or not at all.

    Opacities are held within what a logit in float32 can say, 1 and 0 but for 1e-7, and scales not
    below 1e-30. Raises TypeError, ValueError and OSError.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9], colors=(0.8, 0.3, 0.1))
    >>> moit.write_splats("ball.ply", ball)
    >>> moit.read_splats("ball.ply").opacities.round(6)
    array([0.9], dtype=float32)
    """
    name = path_name(path)
    if not isinstance(splats, Splats):
        raise TypeError(f"splats: expected Splats, got {type(splats).__name__}")
    if os.path.splitext(name)[1].lower() != ".ply":
        raise SplatsError(f"path: expected a file .ply, got {name!r}")
    turned = _turned({name: getattr(splats, name) for name in ARRAYS})
    shares = np.clip(turned["opacities"].astype(np.float64), 1e-7, 1 - 1e-7)
    rest = turned["sh"][:, 1:].transpose(0, 2, 1).reshape(len(splats), -1)
    columns = {
        "x y z": turned["means"],
        "nx ny nz": np.zeros((len(splats), 3)),
        "f_dc_0 f_dc_1 f_dc_2": turned["sh"][:, 0],
        " ".join(f"f_rest_{k}" for k in range(rest.shape[1])): rest,
        "opacity": np.log(shares / (1 - shares))[:, None],
        "scale_0 scale_1 scale_2": np.log(np.maximum(turned["scales"].astype(np.float64), 1e-30)),
        "rot_0 rot_1 rot_2 rot_3": turned["rotations"],
    }
    names = [one for some in columns for one in some.split()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(["comment SplatRenderMode: mip"] if splats.antialiased else []),
        f"element vertex {len(splats)}",
        *(f"property float {one}" for one in names),
        "end_header\n",
    ]
    rows = np.concatenate([some.astype("<f4") for some in columns.values()], axis=1)
    write_bytes(name, "\n".join(header).encode() + rows.tobytes())


def _turned(arrays: Arrays) -> Arrays:
    """Half a turn about x: from axes right, down, forward to right, up, back, and the other way."""
    w, x, y, z = arrays["rotations"].T
    return arrays | {
        "means": arrays["means"] * (1, -1, -1),
        "rotations": np.stack([-x, w, -z, y], axis=1),
        "sh": arrays["sh"] * TURNED[: arrays["sh"].shape[1], None],
    }


def _of_ply(content: bytes) -> Arrays:
    rows, comments = read_vertices(content)
    mode = _mode_of(comments)

    def columns(*names: str) -> Array:
        missing = [one for one in names if not isinstance(rows.get(one), np.ndarray)]
        if missing:
            raise SplatsError(f"has no property {missing[0]!r} of splats")
        return np.stack([rows[one].astype(np.float64) for one in names], axis=1)

    rest = sorted((one for one in rows if re.fullmatch(r"f_rest_\d+", one)), key=_number_of)
    if len(rest) % 3 or 1 + len(rest) // 3 not in DEGREES:
        raise SplatsError(f"has {len(rest)} properties f_rest_*; needed 0, 9, 24 or 45")
    flat = mode == "2dgs" or "scale_2" not in rows
    scales = columns("scale_0", "scale_1", *([] if flat else ["scale_2"]))
    with np.errstate(over="ignore"):
        scales = np.exp(scales)
        shares = 1 / (1 + np.exp(-columns("opacity")[:, 0]))
    if isinstance(rows.get("filter_3D"), np.ndarray):
        larger = np.hypot(scales, columns("filter_3D"))
        ratio = np.divide(scales, larger, out=np.ones_like(scales), where=larger > 0)
        scales, shares = larger, shares * ratio.prod(axis=1)
    first = columns("f_dc_0", "f_dc_1", "f_dc_2")[:, None]
    others = columns(*rest).reshape(len(first), 3, -1) if rest else np.zeros((len(first), 3, 0))
    return _turned(
        {
            "means": columns("x", "y", "z"),
            "scales": np.pad(scales, ((0, 0), (0, int(flat)))),
            "rotations": columns("rot_0", "rot_1", "rot_2", "rot_3"),
            "opacities": shares,
            "sh": np.concatenate([first, others.transpose(0, 2, 1)], axis=1),
            "antialiased": mode == "mip",
        }
    )


def _mode_of(comments: list[str]) -> str:
    """How splats are drawn by the last of the comments that says so, as Brush and Postshot write
    them: "mip", "2dgs" or another word."""
    mode = "default"
    says = re.compile(r"\s*(?:SplatRenderMode:\s*(\w+)|antialiased\s+([01])\b)", re.IGNORECASE)
    for comment in comments:
        if found := says.match(comment):
            mode = (found[1] or ("default", "mip")[int(found[2])]).lower()
    return mode


def _number_of(name: str) -> int:
    return int(name.rpartition("_")[2])


def _of_splat(content: bytes) -> Arrays:
    row = np.dtype(
        [("mean", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("rotation", "u1", 4)]
    )
    if len(content) % row.itemsize:
        raise SplatsError(f"has {len(content)} bytes; needed a multiple of {row.itemsize}")
    rows = np.frombuffer(content, row)
    color = rows["color"] / 255
    return _turned(
        {
            "means": rows["mean"].astype(np.float64),
            "scales": rows["scale"].astype(np.float64),
            "rotations": (rows["rotation"].astype(np.float64) - 128) / 128,
            "opacities": color[:, 3],
            "sh": ((color[:, :3] - 0.5) / OF_DEGREE_0)[:, None],
        }
    )


# ---- .spz: https://github.com/nianticlabs/spz ---------------------------------------------------

MAGIC = b"NGSP"
MOST_SPLATS = 100_000_000  # more than that is no count but a damaged header


def _of_spz(content: bytes) -> Arrays:
    packed = content[:2] == b"\x1f\x8b"
    stream = gzip.GzipFile(fileobj=io.BytesIO(content)) if packed else io.BytesIO(content)
    if packed:
        content = _read(stream, 16)
    if len(content) < 16 or content[:4] != MAGIC:
        raise SplatsError("has no header of an .spz file")
    version, count, degree, bits, flags, streams = struct.unpack_from("<IIBBBB", content, 4)
    if not 1 <= version <= 4:
        raise SplatsError(f"is of version {version}; versions 1 to 4 are known")
    if count > MOST_SPLATS or degree > 3:
        raise SplatsError(f"says that it holds {count} splats of degree {degree}")
    others = (degree + 1) ** 2 - 1
    sizes = [6 if version == 1 else 9, 1, 3, 3, 3 if version < 3 else 4, 3 * others]
    if version == 4:
        parts = _unpacked(content, streams, [count * size for size in sizes])
    else:
        # no more than the header says: what is packed may be endless
        whole = _read(stream, count * sum(sizes)) if packed else content[16:]
        body, parts = np.frombuffer(whole, np.uint8), []
        if len(body) < count * sum(sizes):
            raise SplatsError(f"ends within its {count} splats")
        for size in sizes:
            parts.append(body[: count * size])
            body = body[count * size :]
    place, alpha, color, scale, turn, rest = (
        part.reshape(count, size) for part, size in zip(parts, sizes, strict=True)
    )
    first = (color / 255 - 0.5) / 0.15
    more = (rest.astype(np.float64) - 128) / 128
    return {
        "means": place.copy().view("<f2").astype(np.float64)
        if version == 1
        else _fixed(place) / 2.0**bits,
        "scales": np.exp(scale / 16 - 10),
        "rotations": _first_three(turn) if version < 3 else _smallest_three(turn),
        "opacities": alpha[:, 0] / 255,
        "sh": np.concatenate([first[:, None], more.reshape(count, others, 3)], axis=1),
        "antialiased": bool(flags & 1),
    }


def _read(stream: io.BufferedIOBase, size: int) -> bytes:
    try:
        return stream.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise SplatsError(f"cannot be unpacked: {error}") from None


def _unpacked(content: bytes, streams: int, sizes: list[int]) -> list[Array]:
    """The streams of version 4, each packed by Zstandard, by the table that the header names."""
    try:
        import zstandard
    except ImportError as error:
        raise ImportError(
            "an .spz file of version 4 needs zstandard: pip install 'moit[mesh]' installs it"
        ) from error
    needed = [size for size in sizes if size]
    if len(content) < 20 or streams < len(needed):
        raise SplatsError(f"has {streams} streams; needed {len(needed)}")
    at = struct.unpack_from("<I", content, 16)[0]
    if at + 16 * streams > len(content):
        raise SplatsError("ends within its table of streams")
    table = np.frombuffer(content, "<u8", 2 * streams, at).reshape(streams, 2)
    start = at + 16 * streams
    found: list[Array] = []
    for (packed, raw), size in zip(table.tolist(), needed, strict=False):
        if raw != size or packed > len(content) - start:
            raise SplatsError(f"has a stream of {raw} bytes; needed {size}")
        try:
            body = zstandard.ZstdDecompressor().decompress(
                content[start : start + packed], max_output_size=size
            )
        except zstandard.ZstdError as error:
            raise SplatsError(f"cannot be unpacked: {error}") from None
        if len(body) != size:
            raise SplatsError(f"has a stream of {len(body)} bytes; needed {size}")
        found.append(np.frombuffer(body, np.uint8))
        start += packed
    return found + [np.zeros(0, np.uint8)] * (len(sizes) - len(needed))


def _fixed(places: Array) -> Array:
    """(N, 9) bytes as (N, 3) signed numbers of 24 bits."""
    low, middle, high = (places.reshape(-1, 3, 3)[:, :, k].astype(np.int64) for k in range(3))
    number = low | middle << 8 | high << 16
    return np.where(number >= 1 << 23, number - (1 << 24), number).astype(np.float64)


def _first_three(turns: Array) -> Array:
    """x y z of quaternions w x y z whose w is not negative."""
    xyz = turns / 127.5 - 1
    w = np.sqrt(np.maximum(0, 1 - (xyz * xyz).sum(axis=1)))
    return np.concatenate([w[:, None], xyz], axis=1)


def _smallest_three(turns: Array) -> Array:
    """Of x y z w the index of the largest, and the others in sign and 9 bits."""
    word = turns.copy().view("<u4")[:, 0].astype(np.int64)
    largest = word >> 30
    found = np.zeros((len(word), 4))
    for k in (3, 2, 1, 0):
        other = largest != k
        size = (word & 511) / 511 * np.sqrt(0.5)
        found[:, k] = np.where(other, np.where(word >> 9 & 1, -size, size), 0)
        word = np.where(other, word >> 10, word)
    rest = np.sqrt(np.maximum(0, 1 - (found * found).sum(axis=1)))
    found[np.arange(len(word)), largest] = rest
    return found[:, [3, 0, 1, 2]]


READERS: dict[str, Callable[[bytes], Arrays]] = {
    ".ply": _of_ply,
    ".splat": _of_splat,
    ".spz": _of_spz,
}
