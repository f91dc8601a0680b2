"""Deep OpenEXR files: read as Fragments, and written from them.

Files hold colour multiplied by alpha, and may hold volumes, samples from Z to ZBack. What both
mean is defined by Kainz, Interpreting OpenEXR Deep Pixels.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.arguments import path_name, truth
from moit.checks.exceptions import FragmentsError
from moit.formats.deep_channels import (
    COLOR,
    COLORED_ALPHA,
    Wanted,
    split_colored_alpha,
    wanted,
)
from moit.formats.deep_light import divided, multiplied
from moit.formats.deep_parts import ExrFile, Part
from moit.formats.deep_rows import DeepRows, offsets_of
from moit.formats.deep_source import Source
from moit.formats.exr_headers import MOST_COORDINATE, kept_of, place_for, put_frame
from moit.fragments.fragments import Fragments
from moit.system.environment import thread_count
from moit.system.files import replacing

Floats = NDArray[np.float32]

# Filters and half floats leave alphas that miss [0, 1] by a little; more than this is no rounding.
ALPHA_SLACK = 1e-3


def read_deep(
    path: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    channels: Mapping[str, str] | None = None,
    tidy: bool = True,
    subimage: int | None = None,
) -> Fragments:
    """The samples of a deep OpenEXR file, as float32.

    path : a deep scan line or tiled file.
    part : which part of a file of several: its index from 0, its name, or its view. None: the only
        deep one.
    layer : the prefix of its channels' names: "beauty" for beauty.R, beauty.A and so on, "" for
        those without prefix. What a layer lacks of depth and alpha is that without prefix. None:
        the channels without prefix if they are colour, alpha and depth, else the only layer that
        is. `moit.inspect` lists parts, views and layers.
    channels : names of your own by what they mean: {"A": "alpha", "Z": "depth"}. Keys are R, G, B,
        A, Z, ZBack, and AR, AG, AB.
    tidy : make the image tidy, as `Fragments.tidy` has it: sorted by depth, volumes split where
        samples overlap, and what coincides mixed, as OpenEXR's document on deep pixels says. False:
        all samples as they are, in the file's order.
    subimage : an older name of part, an index only.

    Needed are Z and A, and R, G and B, or Y for grey, or no colour: then color is None. RA, GA, BA
    or AR, AG, AB, an alpha for each colour, become alpha, the greatest of them, and transmission.
    Other channels are ignored, as are attributes of the header that pixels do not need.

    shape is that of the data window, origin its first pixel, and frame has the display window, the
    pixel aspect and the header's metadata. depth_range is the default. Colour is divided by alpha;
    where alpha is 0, or so small that the quotient is beyond float32, it is emission. Volumes
    (ZBack behind Z) have a back; without any, back is None. Alphas outside [0, 1] by at most 0.001,
    as filters and half floats leave them, are moved to the nearest end with a UserWarning that
    counts them. Opaque samples may lie at infinity, as `Fragments` holds them.

    Raises OSError where the file is missing, damaged or not OpenEXR; FragmentsError where it
    is not deep, lacks a channel, holds numbers that Fragments cannot hold, or holds several deep
    parts or layers and none is chosen (the message lists them); ValueError for a part or layer
    that is not there. Messages about a sample name its channel and pixel in the file's
    coordinates. Where memory runs out inside OpenEXR this is an OSError too, or ends the process:
    nothing in Python can prevent that. `read_deep_bands` needs no more memory than it is given.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.read_deep("panes.exr").shape
    (6, 8)
    """
    chosen = wanted(part, layer, channels, subimage)
    f, remarks = samples_of(path_name(path), chosen, tidy=truth("tidy", tidy))
    for text in remarks.texts():
        warnings.warn(f"{path_name(path)!r}: {text}", UserWarning, stacklevel=2)
    return f


@dataclass(frozen=True)
class Remarks:
    """What reading changed. Sums of them are what reading all of it changed."""

    moved: int = 0  # alphas that were outside [0, 1], by at most `farthest`
    farthest: float = 0.0

    def __add__(self, other: Remarks) -> Remarks:
        return Remarks(
            self.moved + other.moved,
            max(self.farthest, other.farthest),
        )

    def texts(self) -> Iterator[str]:
        if self.moved:
            yield (
                f"{self.moved} alphas outside [0, 1], by at most {self.farthest:.2g}, were moved "
                "to the nearest end"
            )


def samples_of(
    path: str, wanted: Wanted, name: str | None = None, tidy: bool = True
) -> tuple[Fragments, Remarks]:
    """What `read_deep` returns, and what it warns of; messages say `name` instead of `path`."""
    name = name or path
    with open(path, "rb") as stream:  # what the system refuses is its own OSError
        file = ExrFile(path, stream, name)
        part = file.chosen(wanted)
        part.window(file.size(), name)
        rows = _decoded_rows(path, part)
        if rows is None:
            rows = _all_rows(file, part, name)
        return fragments_of(rows, part, name, tidy)


def _decoded_rows(path: str, part: Part) -> DeepRows | None:
    """The rows by OpenImageIO, which makes no objects of pixels. None where it has any trouble:
    OpenEXR's package then says what is wrong, or reads it all the same."""
    try:
        with Source(path, part) as source:
            return source.all_rows()
    except OSError:
        return None


def _all_rows(file: ExrFile, part: Part, name: str) -> DeepRows:
    """The channels that have roles in a part, by OpenEXR's package."""
    (x0, y0), (width, height) = part.window(file.size(), name)
    pixels = file.pixels(part, thread_count(None))
    channels: dict[str, NDArray[Any]] = {}
    counts: NDArray[np.int64] | None = None
    depth = part.names["Z"]
    for channel in dict.fromkeys((depth, *part.names.values())):
        own, channels[channel] = _flat(pixels.pop(channel), (height, width), name)
        if counts is None:
            counts = own
        elif not np.array_equal(own, counts):
            raise OSError(
                f"{name!r}: damaged: {channel} and {depth} have different numbers of samples"
            )
    assert counts is not None
    return DeepRows((height, width), (y0, x0), offsets_of(counts), channels)


def fragments_of(
    rows: DeepRows, part: Part, name: str, tidy: bool = True
) -> tuple[Fragments, Remarks]:
    """The samples of rows of a part as Fragments, and what was changed for it."""
    offsets, (y0, x0), (height, width) = rows.offsets, rows.origin, rows.shape
    channels = {
        role: rows.channels[channel].astype(np.float32, copy=False)
        for role, channel in part.names.items()
    }
    depth = channels.pop("Z")

    def place(sample: int) -> str:
        pixel = int(np.searchsorted(offsets, sample, "right")) - 1
        y, x = divmod(pixel, width)
        return f"pixel x={x0 + x}, y={y0 + y}, sample {sample - offsets[pixel]}"

    def called(role: str) -> str:
        return f"{name!r}: {part.names[role]}"

    def values(role: str) -> Floats:
        flat = channels.pop(role)
        _require(np.isfinite(flat), flat, "a finite number", called(role), place)
        return flat

    transmission = None
    if "AR" in channels:
        each, remarks = [], Remarks()
        for role in COLORED_ALPHA:
            own, changed = _within_unit(values(role), called(role), place)
            each.append(own)
            remarks += changed
        alpha, transmission = split_colored_alpha(each)
    else:
        alpha, remarks = _within_unit(values("A"), called("A"), place)
    depth = _within_reach(depth, alpha, transmission)
    needed = "a finite number, or infinity where it is opaque"
    _require(np.isfinite(depth), depth, needed, called("Z"), place)
    color = emission = back = None
    if "R" in channels:
        color, emission = divided([values(c) for c in COLOR], alpha)
    if "ZBack" in channels:
        back = _within_reach(channels.pop("ZBack"), alpha, transmission)
        _require(np.isfinite(back), back, needed, called("ZBack"), place)
        back = np.maximum(back, depth) if (back > depth).any() else None
    f = Fragments(
        offsets,
        depth,
        alpha,
        color,
        transmission=transmission,
        back=back,
        emission=emission,
        shape=(height, width),
        origin=(y0, x0),
        frame=part.frame,
    )
    return f.tidy() if tidy else f, remarks


def write_deep(path: str | os.PathLike[str], f: Fragments, *, half: bool = False) -> None:
    """Writes `f` as a deep OpenEXR file: A and Z, of volumes ZBack, with color R, G and B too.

    f : Fragments of at least one pixel. With transmission there are AR, AG and AB, an alpha for
        each colour, and A is their mean, for programs that know one only.
    half : A, R, G and B are half floats, which other programs mostly write; depths stay floats.

    The file holds colour multiplied by alpha: reading it back gives the same depth and alpha, and
    color up to the rounding of a product and a quotient; where alpha is 0 color is lost. Emission
    is added to the product: where alpha is 0 it comes back, else as a part of color. Of
    transmission the file keeps what each channel passes, alpha (1 - transmission), and reading
    back gives the alpha and color with which the least transmission is 0. float64 is rounded to
    float32. The data window starts at f.origin; display window, pixel aspect and metadata are
    those of f.frame. depth_range is not kept. The file appears whole or not at all.

    Raises ValueError for what the file cannot hold, OSError where it cannot be written.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.read_deep("panes.exr").shape
    (6, 8)
    """
    if not isinstance(f, Fragments):
        raise TypeError(f"f: expected Fragments, got {type(f).__name__}")
    truth("half", half)
    if f.deviation is not None and f.deviation.any():
        raise ValueError(
            "f: OpenEXR has no Gaussians, found deviations above 0; needed surfaces and volumes, "
            "as f.tidy() makes of them"
        )
    import OpenEXR

    from moit.system.version import VERSION

    threads, (first, last) = thread_count(None), _corners(f)
    header: dict[str, Any] = {
        "type": OpenEXR.deepscanline,
        "compression": OpenEXR.ZIPS_COMPRESSION,
        "dataWindow": (first, last),
        "displayWindow": (tuple(min(c, 0) for c in first), tuple(max(c, 0) for c in last)),
        "software": f"moit {VERSION}",
    }
    kept = kept_of(f.frame, header) if f.frame else ()
    header |= place_for(kept)
    stored = np.float16 if half else np.float32
    arrays = {"Z": _stored(f.depth, np.float32, "depth")}
    arrays["A"] = _stored(f.coverage, stored, "alpha")
    if f.transmission is not None:
        for i, channel in enumerate(COLORED_ALPHA):
            passed = f.transmission[:, i].astype(np.float64)
            arrays[channel] = _stored(f.alpha * (1 - passed), stored, channel)
    if f.back is not None:
        arrays["ZBack"] = _stored(f.back, np.float32, "back")
    for i, channel in enumerate(COLOR if f.color is not None else ()):
        arrays[channel] = _stored(multiplied(f, i), stored, f"color x alpha, {channel}")
    # An array for each pixel, also an empty one: with None alone a channel would have no type.
    channels = {
        channel: _core.split_pixels(array, f.offsets).reshape(f.shape)
        for channel, array in arrays.items()
    }
    with replacing(path) as part:
        with open(part, "xb") as stream:  # OpenEXR's own stream loses errors of the system
            try:
                OpenEXR.File(header, channels, num_threads=threads).write(stream)
            except OSError:
                raise
            except Exception as error:  # OpenEXR raises whatever pybind11 makes of C++
                raise OSError(f"{path_name(path)!r}: OpenEXR cannot write it: {error}") from error
        if f.frame:
            put_frame(part, f.frame, kept)


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


def _flat(
    pixels: NDArray[Any], shape: tuple[int, int], name: str
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """The number of samples of each pixel, and all samples, of what OpenEXR gives for a channel:
    an array of arrays, with None for a pixel without samples."""
    if pixels.shape != shape:
        raise OSError(f"{name!r}: a channel has {pixels.shape} pixels, the image {shape}")
    counts, samples = _core.join_pixels(pixels)
    return counts, samples


def _require(
    fit: NDArray[np.bool_], values: Floats, needed: str, what: str, place: Callable[[int], str]
) -> None:
    if not fit.all():
        at = int(fit.argmin())
        raise FragmentsError(f"{what} of {place(at)}: found {values[at]}; needed {needed}")


def _within_reach(depth: Floats, alpha: Floats, transmission: Floats | None) -> Floats:
    """Depths with the greatest that there is for infinity where a sample is opaque: it is the
    background, behind everything."""
    beyond = np.isposinf(depth) & (alpha == 1)
    if transmission is not None:
        beyond &= ~transmission.any(axis=1)
    return np.where(beyond, np.finfo(np.float32).max, depth) if beyond.any() else depth


def _within_unit(alpha: Floats, what: str, place: Callable[[int], str]) -> tuple[Floats, Remarks]:
    outside = (alpha < 0) | (alpha > 1)
    count = int(np.count_nonzero(outside))
    if not count:
        return alpha, Remarks()
    near = (alpha >= -ALPHA_SLACK) & (alpha <= 1 + ALPHA_SLACK)
    _require(near, alpha, "a number in [0, 1]", what, place)
    worst = float(np.maximum(-alpha, alpha - 1).max())
    return np.clip(alpha, 0, 1), Remarks(moved=count, farthest=worst)
