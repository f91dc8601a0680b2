"""Deep OpenEXR files: read as Fragments, and written from them.

Files hold colour multiplied by alpha, and may hold volumes, samples from Z to ZBack. What both
mean is defined by Kainz, Interpreting OpenEXR Deep Pixels.
"""

from __future__ import annotations

import operator
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.arguments import path_name, truth
from moit.checks.exceptions import FragmentsError
from moit.fragments.fragments import Fragments
from moit.system.environment import thread_count
from moit.system.files import writing

Floats = NDArray[np.float32]

COLOR = ("R", "G", "B")
COLORED_ALPHA = ("AR", "AG", "AB", "RA", "GA", "BA")

# Filters and half floats leave alphas that miss [0, 1] by a little; more than this is no rounding.
ALPHA_SLACK = 1e-3

# No file is smaller than its compressed table of sample counts, four bytes a pixel. Deflate makes
# nothing smaller than 1 in 1032; Zstandard reaches more, but not where each line is a chunk with a
# header. A file that claims more pixels is damaged, and believing it could take all memory.
PIXELS_PER_BYTE = 1032 // 4
PIXELS_PER_BYTE_ZSTD = 2**13

# What OpenEXR accepts as a coordinate of a window.
MOST_COORDINATE = 2**30 - 1


def read_deep(path: str | os.PathLike[str], *, subimage: int = 0) -> Fragments:
    """The samples of a deep OpenEXR file, in the file's order, as float32.

    path : a deep scan line or tiled file with the channels A and Z, and R, G and B or none of
        them; other channels are ignored. Without R, G and B color is None.
    subimage : which part of a file of several, counted from 0.

    shape is that of the data window and origin its first pixel; depth_range is the default, the
    least and the greatest depth present. Colour is divided by alpha; where alpha is 0 it is light
    without opacity, which Fragments cannot hold: it is dropped with a UserWarning that counts it.
    Alphas outside [0, 1] by at most 0.001, as filters and half floats leave them, are moved to
    the nearest end with a UserWarning that counts them.

    Volumes (ZBack greater than Z) are split where another sample of their pixel begins or ends,
    and coincident pieces mixed; each piece becomes a fragment at its front. How far a volume
    reaches is lost thereby, so write_deep cannot write such a file back: a UserWarning says so.

    Raises OSError where the file is missing, damaged or not OpenEXR; FragmentsError where it
    is not deep, lacks a channel or holds numbers that Fragments cannot hold; ValueError for a
    subimage that is not there. Messages about a sample name its channel and pixel in the file's
    coordinates. Where memory runs out inside OpenEXR this is an OSError too, or ends the process:
    nothing in Python can prevent that. `read_deep_bands` needs no more memory than it is given.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.read_deep("panes.exr").shape
    (6, 8)
    """
    f, remarks = samples_of(path_name(path), subimage)
    for text in remarks.texts():
        warnings.warn(f"{path_name(path)!r}: {text}", UserWarning, stacklevel=2)
    return f


@dataclass(frozen=True)
class Remarks:
    """What reading changed. Sums of them are what reading all of it changed."""

    moved: int = 0  # alphas that were outside [0, 1], by at most `farthest`
    farthest: float = 0.0
    emitting: int = 0  # samples with colour and without alpha
    volumes: int = 0
    fragments: int = 0

    def __add__(self, other: Remarks) -> Remarks:
        return Remarks(
            self.moved + other.moved,
            max(self.farthest, other.farthest),
            self.emitting + other.emitting,
            self.volumes + other.volumes,
            self.fragments + other.fragments,
        )

    def texts(self) -> Iterator[str]:
        if self.moved:
            yield (
                f"{self.moved} alphas outside [0, 1], by at most {self.farthest:.2g}, were moved "
                "to the nearest end"
            )
        if self.emitting:
            yield (
                f"{self.emitting} samples have colour but alpha 0; this emission was dropped, "
                "since a fragment's colour counts as much as its alpha"
            )
        if self.volumes:
            yield (
                f"{self.volumes} volumes (ZBack > Z) became fragments at their fronts, "
                f"{self.fragments} fragments in all; write_deep cannot write the volumes back"
            )


def deep_part(path: str, stream: BinaryIO, subimage: int, name: str | None = None) -> Part:
    """The part that subimage means; messages say `name` instead of `path`."""
    name = name or path
    if stream.read(4) != b"\x76\x2f\x31\x01":
        raise OSError(f"{name!r}: not an OpenEXR file")
    return _chosen(_parts(path, stream, name), subimage, name)


def samples_of(path: str, subimage: int, name: str | None = None) -> tuple[Fragments, Remarks]:
    """What `read_deep` returns, and what it warns of; messages say `name` instead of `path`."""
    name, threads = name or path, thread_count(None)
    with open(path, "rb") as stream:  # what the system refuses is its own OSError
        part = deep_part(path, stream, subimage, name)
        (x0, y0), (width, height) = part.window(os.fstat(stream.fileno()).st_size, name)
        channels = _decoded(path, stream, part, threads, name)

    counts, depth = _flat(channels.pop("Z"), (height, width), name)
    offsets = np.zeros(height * width + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])

    def place(sample: int) -> str:
        pixel = int(np.searchsorted(offsets, sample, "right")) - 1
        y, x = divmod(pixel, width)
        return f"pixel x={x0 + x}, y={y0 + y}, sample {sample - offsets[pixel]}"

    def values(channel: str) -> Floats:
        own, flat = _flat(channels.pop(channel), (height, width), name)
        if not np.array_equal(own, counts):
            raise OSError(f"{name!r}: damaged: {channel} and Z have different numbers of samples")
        _require(np.isfinite(flat), flat, "a finite number", f"{name!r}: {channel}", place)
        return flat

    _require(np.isfinite(depth), depth, "a finite number", f"{name!r}: Z", place)
    alpha, remarks = _within_unit(values("A"), f"{name!r}: A", place)
    color = None
    if "R" in channels:
        color, emitting = _divided([values(c) for c in COLOR], alpha, name, place)
        remarks += Remarks(emitting=emitting)
    if "ZBack" in channels:
        back = values("ZBack")
        volumes = int(np.count_nonzero(back > depth))
        if volumes:
            offsets, depth, alpha, color = _core.split_volumes(
                offsets, depth, back, alpha, color, threads
            )
            remarks += Remarks(volumes=volumes)
    f = Fragments(offsets, depth, alpha, color, shape=(height, width), origin=(y0, x0))
    return f, remarks + Remarks(fragments=len(f))


def write_deep(path: str | os.PathLike[str], f: Fragments, *, half: bool = False) -> None:
    """Writes `f` as a deep OpenEXR file of point samples: A and Z, with color R, G and B too.

    f : Fragments of at least one pixel, without transmission: deep OpenEXR has one alpha for all
        colours.
    half : A, R, G and B are half floats, which other programs mostly write; Z stays a float.

    The file holds colour multiplied by alpha: reading it back gives the same depth and alpha, and
    color up to the rounding of a product and a quotient; where alpha is 0 color is lost.
    float64 is rounded to float32. The data window starts at f.origin; depth_range and, of
    Fragments that read_deep made from volumes, their extent are not kept. The file appears whole
    or not at all.

    Raises ValueError for what the file cannot hold, OSError where it cannot be written.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.read_deep("panes.exr").shape
    (6, 8)
    """
    if not isinstance(f, Fragments):
        raise TypeError(f"f: expected Fragments, got {type(f).__name__}")
    if f.transmission is not None:
        raise ValueError(
            "f: deep OpenEXR cannot hold transmission; needed Fragments with transmission=None"
        )
    truth("half", half)
    import OpenEXR

    from moit.system.version import VERSION

    threads, (first, last) = thread_count(None), _corners(f)
    header = {
        "type": OpenEXR.deepscanline,
        "compression": OpenEXR.ZIPS_COMPRESSION,
        "dataWindow": (first, last),
        "displayWindow": (tuple(min(c, 0) for c in first), tuple(max(c, 0) for c in last)),
        "software": f"moit {VERSION}",
    }
    stored = np.float16 if half else np.float32
    arrays = {"Z": _stored(f.depth, np.float32, "depth"), "A": _stored(f.alpha, stored, "alpha")}
    if f.color is not None:
        for i, channel in enumerate(COLOR):
            arrays[channel] = _stored(f.color[:, i] * f.alpha, stored, f"color x alpha, {channel}")
    # An array for each pixel, also an empty one: with None alone a channel would have no type.
    channels = {
        channel: _core.split_pixels(array, f.offsets).reshape(f.shape)
        for channel, array in arrays.items()
    }
    with writing(path) as stream:  # OpenEXR's own stream loses errors of the system
        try:
            OpenEXR.File(header, channels, num_threads=threads).write(stream)
        except OSError:
            raise
        except Exception as error:  # OpenEXR raises whatever pybind11 makes of C++
            raise OSError(f"{path_name(path)!r}: OpenEXR cannot write it: {error}") from error


def _corners(f: Fragments) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first and the last (x, y) of the data window."""
    (height, width), (y, x) = f.shape, f.origin
    if not len(f.counts):
        raise ValueError(f"f: OpenEXR cannot hold an image of {height} x {width} pixels")
    first, last = (x, y), (x + width - 1, y + height - 1)
    if min(first) < -MOST_COORDINATE or max(last) > MOST_COORDINATE:
        raise ValueError(
            f"f: OpenEXR's coordinates end at {MOST_COORDINATE}; found a window from {first} to "
            f"{last} (x, y)"
        )
    return first, last


def _stored(numbers: NDArray[Any], dtype: Any, name: str) -> NDArray[Any]:
    with np.errstate(over="ignore", under="ignore"):
        stored = numbers.astype(dtype)
    lost = ~np.isfinite(stored)
    if lost.any():
        at = int(lost.argmax())
        raise ValueError(
            f"{name}: found {numbers[at]} at fragment {at}, too large for {np.dtype(dtype)}"
        )
    return stored


@dataclass(frozen=True)
class Part:
    index: int
    deep: bool
    channels: list[str]
    first: tuple[int, int]  # (x, y) of the data window's corners
    last: tuple[int, int]
    zstd: bool

    def window(self, file_size: int, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
        """(x, y) of the data window's first pixel and its (width, height)."""
        width, height = (b - a + 1 for a, b in zip(self.first, self.last, strict=True))
        most = file_size * (PIXELS_PER_BYTE_ZSTD if self.zstd else PIXELS_PER_BYTE)
        if not (0 < width and 0 < height and width * height <= most):
            raise OSError(
                f"{name!r}: damaged: {file_size} bytes cannot hold {height} x {width} deep pixels"
            )
        return self.first, (width, height)


def _open(name: str, stream: BinaryIO, header_only: bool, threads: int) -> Any:
    import OpenEXR

    stream.seek(0)
    return OpenEXR.File(
        name if _is_text(name) else stream,  # streams are slow, but take any name
        separate_channels=True,
        header_only=header_only,
        num_threads=threads,
    )


@contextmanager
def _damage_is_oserror(name: str) -> Iterator[None]:
    """OpenEXR raises whatever pybind11 makes of C++; names in a damaged file may not even be
    Unicode."""
    try:
        yield
    except Exception as error:
        raise OSError(f"{name!r}: damaged, or beyond OpenEXR: {error}") from error


def _parts(path: str, stream: BinaryIO, name: str) -> list[Part]:
    import OpenEXR

    with _damage_is_oserror(name):
        parts = []
        for index, part in enumerate(_open(path, stream, True, 1).parts):
            header = part.header
            first, last = ((int(x), int(y)) for x, y in header["dataWindow"])
            parts.append(
                Part(
                    index,
                    part.type() in (OpenEXR.deepscanline, OpenEXR.deeptile),
                    [str(channel.name) for channel in header["channels"]],
                    first,
                    last,
                    header["compression"] == getattr(OpenEXR, "ZSTD_COMPRESSION", None),
                )
            )
        return parts


def _decoded(
    path: str, stream: BinaryIO, part: Part, threads: int, name: str
) -> dict[str, NDArray[Any]]:
    """The channels of a part as OpenEXR gives them, an array of arrays for each."""
    with _damage_is_oserror(name):
        # OpenEXR leaves out parts that it cannot decode.
        for found in _open(path, stream, False, threads).parts:
            if found.part_index == part.index:
                channels = {str(key): channel.pixels for key, channel in found.channels.items()}
                if set(channels) == set(part.channels):
                    return channels
        raise ValueError("its pixels cannot be decoded, or there is no memory for them")


def _is_text(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _chosen(parts: list[Part], subimage: int, name: str) -> Part:
    """The part that subimage means, if read_deep can read it."""
    try:
        index = operator.index(subimage)
    except TypeError:
        raise TypeError(f"subimage: expected an integer, got {type(subimage).__name__}") from None
    if not 0 <= index < len(parts):
        raise ValueError(f"subimage: expected 0 to {len(parts) - 1} for {name!r}, got {index}")
    part = parts[index]
    if not part.deep:
        raise FragmentsError(f"{name!r}: not a deep image but a flat one; moit.read_image reads it")
    needed = _needed(part.channels)
    if needed:
        found = ", ".join(part.channels) or "none"
        raise FragmentsError(f"{name!r}: needed {needed}; found {found}")
    return part


def _needed(found: list[str]) -> str:
    """What is wrong with these channels; nothing if empty."""
    colors = [channel for channel in COLOR if channel in found]
    if "Z" not in found:
        return "the channel Z, the depth of each sample"
    if any(channel in found for channel in COLORED_ALPHA):
        return "one channel A for all colours, not an alpha for each"
    if "A" not in found:
        return "the channel A, the opacity of each sample"
    if "Y" in found and not colors:
        return "the channels R, G and B, not the luminance Y"
    if len(colors) not in (0, 3):
        return "the channels R, G and B, or none of them"
    return ""


def _flat(
    pixels: NDArray[Any], shape: tuple[int, int], name: str
) -> tuple[NDArray[np.int64], Floats]:
    """The number of samples of each pixel, and all samples, of what OpenEXR gives for a channel:
    an array of arrays, with None for a pixel without samples."""
    if pixels.shape != shape:
        raise OSError(f"{name!r}: a channel has {pixels.shape} pixels, the image {shape}")
    counts, samples = _core.join_pixels(pixels)
    return counts, samples.astype(np.float32, copy=False)


def _require(
    fit: NDArray[np.bool_], values: Floats, needed: str, what: str, place: Callable[[int], str]
) -> None:
    if not fit.all():
        at = int(fit.argmin())
        raise FragmentsError(f"{what} of {place(at)}: found {values[at]}; needed {needed}")


def _within_unit(alpha: Floats, what: str, place: Callable[[int], str]) -> tuple[Floats, Remarks]:
    outside = (alpha < 0) | (alpha > 1)
    count = int(np.count_nonzero(outside))
    if not count:
        return alpha, Remarks()
    near = (alpha >= -ALPHA_SLACK) & (alpha <= 1 + ALPHA_SLACK)
    _require(near, alpha, "a number in [0, 1]", what, place)
    worst = float(np.maximum(-alpha, alpha - 1).max())
    return np.clip(alpha, 0, 1), Remarks(moved=count, farthest=worst)


def _divided(
    premultiplied: list[Floats],
    alpha: Floats,
    name: str,
    place: Callable[[int], str],
) -> tuple[Floats, int]:
    """(N, 3) colour divided by alpha, black where alpha is 0, and how many have colour there."""
    seen = alpha > 0
    color = np.zeros((len(alpha), 3), np.float32)
    emits = np.zeros(len(alpha), np.bool_)
    with np.errstate(over="ignore", under="ignore"):
        for i, (channel, values) in enumerate(zip(COLOR, premultiplied, strict=True)):
            np.divide(values, alpha, out=color[:, i], where=seen)
            emits |= ~seen & (values != 0)
            what = f"{name!r}: {channel} / A"
            _require(np.isfinite(color[:, i]), color[:, i], "a finite number", what, place)
    return color, int(np.count_nonzero(emits))
