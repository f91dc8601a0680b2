"""Deep opacity as moments in a flat file: one size a pixel, with bounds that are certain."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core, moments
from moit.catalog import MomentTechnique, Technique
from moit.catalog import technique as technique_named
from moit.checks.arguments import path_name
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError
from moit.checks.windows import size_of
from moit.deep.opened import Deep, as_file
from moit.formats.deep_bands import USUAL_MEMORY, Bands, band_part
from moit.formats.deep_channels import Wanted
from moit.formats.exr_headers import HeaderError, kept_of, place_for, put_frame, read_headers
from moit.fragments.fragments import Fragments
from moit.fragments.frame import Attribute, Frame
from moit.fragments.ranges import opaque_fragments
from moit.system.environment import thread_count
from moit.system.files import replacing
from moit.system.progress import Progress

TECHNIQUE, RANGE = "moit:moments", "moit:depthRange"
TOTAL, OPAQUE = "b0", "opaque.Z"
NOTHING = float(np.finfo(np.float32).max)  # the depth of a background that is not there


@dataclass(frozen=True)
class MomentImage:
    """Moments of each pixel's absorbance, as `moit.deep.read_moments` gives them.

    technique : which reads them, and `moit.moments` with it.
    b0 : (height, width) total absorbance of what is not opaque, in nepers, float32.
    b : (height, width, m) moments divided by b0; complex of trigonometric ones.
    opaque : (height, width) depth of the first opaque sample, infinity where there is none.
    depth_range : (near, far) that depths are warped by.
    origin, frame : where the image lies; see `Fragments`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.to_moments("panes.exr", "moments.exr", "power4")
    >>> moit.deep.read_moments("moments.exr").transmittance([2.0, 3.0]).shape
    (6, 8, 2)
    """

    technique: Technique
    b0: NDArray[np.float32]
    b: NDArray[Any]
    opaque: NDArray[np.float32]
    depth_range: tuple[float, float]
    origin: tuple[int, int]
    frame: Frame

    def transmittance(self, depth: ArrayLike) -> NDArray[np.float32]:
        """(height, width, K) what the moments reconstruct in front of depths (K,)."""
        z, behind = self._warped(depth)
        b0, b = self._flat()
        found = moments.transmittance(self.technique, b0, b, z)
        return self._shaped(np.where(behind, np.float32(0), found))

    def bounds(self, depth: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(lower, upper), each (height, width, K): the transmittance in front of depths (K,) lies
        in between, whatever the pixel's samples were."""
        z, behind = self._warped(depth)
        found = moments.bounds(self.technique, *self._flat(), z)
        lower, upper = (self._shaped(np.where(behind, np.float32(0), one)) for one in found)
        return lower, upper

    def _flat(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.b0.ravel(), self.b.reshape(self.b0.size, -1)

    def _shaped(self, values: NDArray[Any]) -> NDArray[np.float32]:
        return values.reshape(*self.b0.shape, -1).astype(np.float32)

    def _warped(self, depth: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """(P, K) depths as moments are taken of, and whether they are behind what is opaque."""
        given = finite(as_array(depth, "depth"), "depth", np.float64)
        if given.ndim != 1:
            raise ValueError(f"depth: expected shape (K,), got {given.shape}")
        near, far = self.depth_range
        pixel = Fragments([0, 0], np.zeros(0, "f4"), np.zeros(0, "f4"), depth_range=(near, far))
        fields = self.technique.fields_for(pixel)
        z = _core.warped(pixel, fields, thread_count(None), np.clip(given, near, far))
        every = np.broadcast_to(z, (self.b0.size, len(given)))
        return np.ascontiguousarray(every, np.float32), given > self.opaque.reshape(-1, 1)


def to_moments(
    path: Deep,
    output: str | os.PathLike[str],
    technique: str | Technique = "power8",
    *,
    part: int | str | None = None,
    layer: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes the opacity of a deep OpenEXR file as moments in a flat one: as many numbers for each
    pixel however many samples it has, of which `read_moments` gives bounds that are certain.

    path, part, layer, memory, progress : as `read_deep_bands`.
    technique : one that `moit.moments` reads, of one pass, 32 bits and one depth range for all.
    output : an .exr of float channels: b0 and b.1 to b.m, of complex moments b.1.real and b.1.imag;
        and opaque.Z, the depth of the first opaque sample of each pixel, the greatest float where
        there is none. The header says moit:moments, the technique, and moit:depthRange.

    Volumes are taken in pieces at their fronts, as questions have it, so bounds hold for these.
    Raises ValueError for other techniques, FragmentsError where depths cannot be warped, else as
    `read_deep_bands` and `write_image`.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> moit.write_deep("panes.exr", f)
    >>> moit.deep.to_moments("panes.exr", "moments.exr", "power6")
    >>> lower, upper = moit.deep.read_moments("moments.exr").bounds([2.0])
    >>> lower.shape, bool((lower <= upper).all())
    ((6, 8, 1), True)
    """
    chosen = _checked(technique_named(technique))
    with as_file(path) as name:
        read = band_part(name, Wanted(part, layer))
        arrays, span = _gathered(Bands(name, read, memory).read(progress), chosen, read.size)
    _write(path_name(output), chosen, arrays, span, read.first, read.frame)


def _gathered(
    bands: Iterator[Fragments], technique: MomentTechnique, size: tuple[int, int]
) -> tuple[tuple[NDArray[Any], NDArray[Any], NDArray[Any]], tuple[float, float]]:
    """b0, b and the first opaque depth of a whole image, and its range."""
    width, height = size
    b0 = np.zeros((height, width), np.float32)
    opaque = np.full((height, width), NOTHING, np.float32)
    b: NDArray[Any] | None = None
    span, row = (1.0, 1.0), 0
    for band in bands:
        end = row + band.shape[0]
        own, state = moments.gather(band, technique, dtype=np.float32)
        if b is None:
            b = np.zeros((height, width, state.shape[1]), state.dtype)
        b0[row:end] = own.reshape(-1, width)
        b[row:end] = state.reshape(end - row, width, -1)
        opaque[row:end] = _first_opaque(band)
        span, row = band.depth_range, end
    assert b is not None
    return (b0, b, opaque), span


def read_moments(path: str | os.PathLike[str]) -> MomentImage:
    """The moments that `to_moments` wrote.

    Raises OSError where the file is missing, damaged or not OpenEXR, FragmentsError where it holds
    something else.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.to_moments("panes.exr", "moments.exr", "power4")
    >>> moit.deep.read_moments("moments.exr").b.shape
    (6, 8, 4)
    """
    import OpenEXR

    name = path_name(path)
    try:
        with open(name, "rb") as stream:
            header = read_headers(stream).parts[0]
        pixels = OpenEXR.File(name, separate_channels=True).channels()
    except OSError:
        raise
    except Exception as error:  # OpenEXR raises whatever pybind11 makes of C++
        raise OSError(f"{name!r}: damaged, or not OpenEXR: {error}") from error
    frame = header.frame()
    found, span = frame.metadata.get(TECHNIQUE), frame.metadata.get(RANGE)
    flat = {key: one.pixels for key, one in pixels.items()}
    if not (isinstance(found, str) and isinstance(span, tuple) and {TOTAL, OPAQUE} <= set(flat)):
        raise FragmentsError(f"{name!r}: not a file that moit.deep.to_moments wrote")
    try:
        technique = _checked(technique_named(found))
    except (TypeError, ValueError) as error:
        raise FragmentsError(f"{name!r}: {TECHNIQUE}: {error}") from None
    names = _channels(technique)
    missing = [one for one in names if one not in flat]
    if missing:
        raise FragmentsError(f"{name!r}: {technique} needs the channel {missing[0]}")
    b = np.stack([flat[one] for one in names], axis=-1)
    if technique.moments_are_complex:
        b = np.ascontiguousarray(b).view(np.complex64)
    window = header.get("dataWindow")
    assert window is not None
    opaque = np.where(flat[OPAQUE] == NOTHING, np.float32(np.inf), flat[OPAQUE])
    near, far = span
    size_of(flat[TOTAL].shape)
    origin = (window.value[1], window.value[0])
    return MomentImage(technique, flat[TOTAL], b, opaque, (near, far), origin, frame)


def _checked(technique: Technique) -> MomentTechnique:
    one_size = (
        isinstance(technique, MomentTechnique)
        and technique.moment_sets == 1
        and not technique.keeps_words_of_moments
        and not technique.range_per_pixel
        and technique.local
    )
    if not one_size or technique.fields_for_core(np.dtype(np.float32)).get("bits", 32) != 32:
        raise ValueError(
            f"technique: expected one that stores moments of one pass in 32 bits, with one depth "
            f"range for all pixels, such as power8; got {technique}"
        )
    assert isinstance(technique, MomentTechnique)
    return technique


def _channels(technique: MomentTechnique) -> list[str]:
    names = [f"b.{i}" for i in range(1, technique.moment_count + 1)]
    if technique.moments_are_complex:
        return [f"{name}.{half}" for name in names for half in ("real", "imag")]
    return names


def _first_opaque(band: Fragments) -> NDArray[np.float32]:
    found = np.full(len(band.counts), NOTHING, np.float32)
    opaque = opaque_fragments(band._arrays())
    pixel = np.repeat(np.arange(len(band.counts)), band.counts)
    np.minimum.at(found, pixel[opaque], band.depth[opaque].astype(np.float32))
    return found.reshape(band.shape)


def _write(
    name: str,
    technique: MomentTechnique,
    arrays: tuple[NDArray[Any], NDArray[Any], NDArray[Any]],
    span: tuple[float, float],
    first: tuple[int, int],
    frame: Frame,
) -> None:
    import OpenEXR

    b0, b, opaque = arrays
    if technique.moments_are_complex:
        b = b.view(np.float32)
    channels = {TOTAL: b0, OPAQUE: opaque}
    channels |= {one: np.ascontiguousarray(b[..., i]) for i, one in enumerate(_channels(technique))}
    last = (first[0] + b0.shape[1] - 1, first[1] + b0.shape[0] - 1)
    header: dict[str, Any] = {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "dataWindow": (first, last),
        "displayWindow": ((0, 0), (0, 0)),
    }
    own = (
        Attribute(TECHNIQUE.encode(), b"string", str(technique).encode()),
        Attribute(RANGE.encode(), b"v2d", struct.pack("<2d", *span)),
    )
    kept = tuple(one for one in frame.attributes if one.name not in (TECHNIQUE, RANGE))
    whole = Frame(frame.display_shape, frame.display_origin, frame.pixel_aspect, (*kept, *own))
    lines = kept_of(whole, header)
    with replacing(name) as part:
        try:
            OpenEXR.File(header | place_for(lines), channels).write(part)
            put_frame(part, whole, lines)
        except (OSError, HeaderError):
            raise
        except Exception as error:  # OpenEXR raises whatever pybind11 makes of C++
            raise OSError(f"{name!r}: OpenEXR cannot write it: {error}") from error
