"""Images in files: linear in memory, as they are in OpenEXR, encoded as sRGB in PNG."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import nearest, path_name, truth
from moit.checks.arrays import as_array
from moit.checks.exceptions import FragmentsTypeError
from moit.checks.windows import origin_of
from moit.formats.deep_channels import Wanted, layers, wanted
from moit.formats.deep_parts import index_of
from moit.formats.exr_headers import (
    MOST_COORDINATE,
    HeaderError,
    kept_of,
    place_for,
    put_frame,
    read_headers,
)
from moit.formats.limits import TooMuchMemory, memory_for
from moit.fragments.frame import Attribute, Frame
from moit.reports.pictures import from_srgb, srgb8
from moit.system.files import lost, replacing
from moit.system.image_library import Written, complaint, image_library

ENDINGS = (".exr", ".png")


def read_image(
    path: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    memory: int | None = None,
) -> NDArray[np.float32]:
    """(H, W, 3), or (H, W, 4) where the file has alpha, of an image file; linear float32.

    path : OpenEXR, PNG or what else OpenImageIO reads. Pixels of 8 or 16 bits are taken as sRGB
        and decoded (alpha is linear), floats are taken as they are. Colour is neither multiplied
        by alpha nor divided by it.
    part : which image of a file of several: its index from 0, its name or its view. None: the
        first that is not deep.
    layer : the prefix of its channels' names, "" for none. None: the channels without prefix if
        R, G and B are there, else the only layer that has them.
    memory : bytes that its pixels may take, as float32 with all channels; by default 1 GiB, or 64
        times the file's size where that is more.

    Raises OSError where the file is missing, damaged or of no known kind, ValueError where it is
    deep (`read_deep` reads it), has no channels R, G and B, has pixels of another type or needs
    more memory, and for a part or layer that is not there or not clear.

    >>> moit.write_image("red.exr", np.ones((2, 3, 3)) * [1, 0, 0])
    >>> moit.read_image("red.exr")[0, 0].tolist()
    [1.0, 0.0, 0.0]
    """
    name = path_name(path)
    with open(name, "rb") as file:  # what the system refuses is its own OSError
        most = memory_for(memory, os.fstat(file.fileno()).st_size)
    try:
        pixels, encoded = _read(name, wanted(part, layer), most)
    except UnicodeDecodeError as error:  # names in a damaged file may be any bytes
        raise OSError(f"{name!r}: damaged: {error}") from error
    image = np.ascontiguousarray(pixels)
    if encoded:
        image[..., :3] = from_srgb(image[..., :3])
    return image


def write_image(
    path: str | os.PathLike[str],
    image: ArrayLike,
    *,
    technique: object = None,
    attributes: Mapping[str, str | int | float] | None = None,
    half: bool = False,
    alpha: bool | None = None,
    origin: Sequence[int] = (0, 0),
    frame: Frame | None = None,
) -> None:
    """Writes an image as OpenEXR (.exr) or as PNG (.png).

    image : (H, W, 3) or (H, W, 4), linear floats. OpenEXR holds them as float32. PNG holds 8 bits
        of them clipped to [0, 1] and encoded as sRGB; it cannot hold NaN.
    technique : what made the image. The header keeps its name as moit:technique and all its
        parameters as moit:parameters; moit:version is always kept.
    attributes : more for the header, by name. Names that OpenImageIO knows, such as compression,
        mean there what they mean to it. PNG keeps them as text.
    half : OpenEXR holds half floats instead, with an error of up to 1/2048 of each value.
    alpha : whether a fourth channel is written: by default in OpenEXR, not in PNG, since programs
        lay a PNG with alpha over a background and a composite is over its own already. Colour is
        never multiplied by alpha.
    origin : (y, x) on the display of the first pixel, such as `Fragments.origin`: where OpenEXR's
        data window starts.
    frame : OpenEXR's display window, pixel aspect and metadata, such as `Fragments.frame`: a
        picture of a deep image lies where that lay. Metadata that are unknown here are kept as
        they are; `attributes` and moit's own come before those of the same name. None: a display
        window from the display's first pixel to the image's last. PNG holds the numbers and words
        of the metadata as text, and no windows.

    The file appears whole or not at all. Raises OSError where it cannot be written, TypeError or
    ValueError for anything that cannot be an image, for another ending of the name and for
    numbers that the file cannot hold.

    >>> moit.write_image("gray.png", np.full((2, 3, 3), 0.5))
    >>> moit.read_image("gray.png").shape
    (2, 3, 3)
    """
    pixels = _image(image)
    height, width, channels = pixels.shape
    size = (height, width, channels)
    with image_rows(path, size, technique, attributes, half, alpha, origin, frame) as put:
        put(pixels)


@contextmanager
def image_rows(
    path: str | os.PathLike[str],
    shape: tuple[int, int, int],
    technique: object = None,
    attributes: Mapping[str, str | int | float] | None = None,
    half: bool = False,
    alpha: bool | None = None,
    origin: Sequence[int] = (0, 0),
    frame: Frame | None = None,
) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Writes an image of `shape` row by row: gives a function that takes the next rows of it.

    Other arguments and errors as `write_image`.
    """
    name = path_name(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        raise ValueError(f"path: expected a name that ends in .exr or .png, got {name!r}")
    truth("half", half)
    if alpha is not None:
        truth("alpha", alpha)
    exr = ending == ".exr"
    if half and not exr:
        raise ValueError("half: PNG has 8 bits; expected False, or a name that ends in .exr")
    channels = min(shape[2], 4 if (exr if alpha is None else alpha) else 3)
    stored: Any = (np.float16 if half else np.float32) if exr else np.uint8
    if frame is not None and not isinstance(frame, Frame):
        raise TypeError(f"frame: expected a Frame, got {type(frame).__name__}")
    header = _header(technique, attributes, text=not exr)
    if not exr:
        header = _as_text(frame) | header
    first = _first_pixel(origin, shape)
    place = (first, frame) if exr else ((0, 0), None)
    with _writing(name, (*shape[:2], channels), stored, header, *place) as put:

        def put_converted(rows: NDArray[Any]) -> None:
            kept = rows[..., :channels]
            put(_floats(kept, stored) if exr else _bytes(kept))

        yield put_converted


def _first_pixel(origin: Sequence[int], shape: tuple[int, int, int]) -> tuple[int, int]:
    y, x = origin_of(origin)
    last = (y + shape[0] - 1, x + shape[1] - 1)
    if min(y, x) < -MOST_COORDINATE or max(last) > MOST_COORDINATE:
        raise ValueError(
            f"origin: OpenEXR's coordinates end at {MOST_COORDINATE}; found a window from {(y, x)} "
            f"to {last} (y, x)"
        )
    return y, x


def _as_text(frame: Frame | None) -> dict[str, Any]:
    """Metadata as PNG can hold them."""
    found = frame.metadata.items() if frame else ()
    return {
        name: str(value)
        for name, value in found
        if name.isprintable() and not isinstance(value, bytes)
    }


def _image(image: ArrayLike) -> NDArray[Any]:
    try:
        pixels = as_array(image, "image")
    except FragmentsTypeError as error:
        raise TypeError(*error.args) from error
    if pixels.dtype.kind != "f":
        raise TypeError(f"image: expected linear floats, got {pixels.dtype}")
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or not pixels.size:
        raise ValueError(
            f"image: expected (height, width, 3 or 4) with at least one pixel, got {pixels.shape}"
        )
    return pixels


def _floats(pixels: NDArray[Any], dtype: Any) -> NDArray[Any]:
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        stored = pixels.astype(dtype)
    _require(np.isfinite(stored) | ~np.isfinite(pixels), pixels, f"what {np.dtype(dtype)} holds")
    return np.ascontiguousarray(stored)


def _bytes(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    _require(~np.isnan(pixels), pixels, "a number, since PNG cannot hold NaN")
    rgb = srgb8(pixels)
    if pixels.shape[2] == 3:
        return rgb
    a = np.rint(255.0 * np.clip(pixels[..., 3:].astype(np.float64), 0.0, 1.0))
    return np.concatenate([rgb, a.astype(np.uint8)], axis=2)


def _require(fit: NDArray[np.bool_], pixels: NDArray[Any], needed: str) -> None:
    if not fit.all():
        at = np.unravel_index(int(fit.argmin()), fit.shape)
        where = ", ".join(str(int(i)) for i in at)
        raise ValueError(f"image[{where}]: found {pixels[at]}; needed {needed}")


def _header(
    technique: object, attributes: Mapping[str, str | int | float] | None, text: bool
) -> dict[str, Any]:
    from moit.system.version import VERSION

    header: dict[str, Any] = {"Software": f"moit {VERSION}", "moit:version": VERSION}
    if technique is not None:
        header["moit:technique"] = str(technique)
        if not isinstance(technique, str):
            header["moit:parameters"] = repr(technique)
    if attributes is not None and not isinstance(attributes, Mapping):
        raise TypeError(f"attributes: expected a dict, got {type(attributes).__name__}")
    for key, value in dict(attributes or {}).items():
        if not isinstance(key, str) or not key or "\0" in key:
            raise TypeError(f"attributes: expected names that are not empty, got {key!r:.80}")
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise TypeError(
                f"attributes[{key!r:.80}]: expected str, int or float, got {type(value).__name__}"
            )
        if isinstance(value, int) and not -(2**31) <= value < 2**31 and not text:
            raise ValueError(
                f"attributes[{key!r:.80}]: expected an integer of 32 bits, got {value}"
            )
        header[key] = value
    if text:
        header = {key: str(value) for key, value in header.items()}
        header["oiio:UnassociatedAlpha"] = 1  # else colour is divided by alpha
    return header


def _read(name: str, chosen: Wanted, most: int) -> tuple[NDArray[np.float32], bool]:
    """Colour and alpha as stored, integers divided by their greatest value, and whether they are
    sRGB-encoded."""
    oiio = image_library()
    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)  # else PNG's colour is multiplied by alpha
    file = oiio.ImageInput.open(_unicode(name), as_stored)
    if file is None:
        raise OSError(f"{name!r}: {complaint(oiio) or 'of no known kind'}")
    try:
        index = _image_of(file, chosen.part, name)
        spec = file.spec()
        if spec.deep:
            raise ValueError(f"{name!r}: a deep image, not a flat one; moit.read_deep reads it")
        channels = _channels(list(spec.channelnames), chosen.layer, name)
        types = {str(spec.channelformat(channel)) for channel in channels}
        encoded = types <= {"uint8", "uint16"}
        if not encoded and not types <= {"half", "float", "double"}:
            found = ", ".join(sorted(types))
            raise ValueError(f"{name!r}: expected floats or pixels of 8 or 16 bits, found {found}")
        needed = 4 * spec.nchannels * spec.width * spec.height * max(spec.depth, 1)
        if needed > most:
            raise ValueError(f"{name!r}: {TooMuchMemory(needed, most).with_argument()}")
        pixels = file.read_image(index, 0, 0, spec.nchannels, oiio.FLOAT)
        error = complaint(file)
    finally:
        file.close()
    if pixels is None:
        raise OSError(f"{name!r}: {error or 'its pixels cannot be read'}")
    return pixels[..., channels], encoded


@contextmanager
def _writing(
    name: str,
    shape: tuple[int, int, int],
    dtype: Any,
    header: Mapping[str, Any],
    origin: tuple[int, int],
    frame: Frame | None,
) -> Iterator[Callable[[NDArray[Any]], None]]:
    spec = _spec(shape, dtype, header, origin)
    _unicode(name)
    with replacing(name) as part:
        open(part, "xb").close()  # what the system refuses is its own OSError
        kept: tuple[Attribute, ...] = ()
        if frame is not None:
            # What OpenImageIO writes of its own accord, and under which names, it shows by doing.
            Written(part, name, spec).give_up()
            try:
                with open(part, "rb") as stream:
                    written = read_headers(stream).parts[0].attributes
            except (OSError, HeaderError) as error:
                raise lost(part, name, str(error)) from None
            kept = kept_of(frame, [one.name for one in written])
            for key, text in place_for(kept).items():
                spec.attribute(key, text)
        file = Written(_unicode(part), name, spec)
        try:
            yield file.put
        except BaseException:
            file.give_up()
            raise
        file.finish()
        if frame is not None:
            put_frame(part, frame, kept)


def _spec(
    shape: tuple[int, int, int], dtype: Any, header: Mapping[str, Any], origin: tuple[int, int]
) -> Any:
    (height, width, count), (y, x) = shape, origin
    spec = image_library().ImageSpec(width, height, count, _TYPES[dtype])
    spec.x, spec.y = x, y
    spec.full_x, spec.full_y = min(x, 0), min(y, 0)
    spec.full_width = max(x + width, 1) - spec.full_x
    spec.full_height = max(y + height, 1) - spec.full_y
    for key, value in header.items():
        spec.attribute(key, value)
    return spec


_TYPES = {np.float32: "float", np.float16: "half", np.uint8: "uint8"}


def _unicode(name: str) -> str:
    try:
        name.encode()
    except UnicodeEncodeError:
        raise OSError(f"{name!r}: OpenImageIO takes Unicode names only") from None
    return name


def _image_of(file: Any, part: int | str | None, name: str) -> int:
    """The index of the image that is meant; the file is left there. Raises OSError for damage."""
    deep: list[bool] = []
    names: list[str] = []
    views: list[str] = []
    while file.seek_subimage(len(deep), 0):
        spec = file.spec()
        deep.append(spec.deep)
        names.append(spec.get_string_attribute("oiio:subimagename"))
        views.append(spec.get_string_attribute("view"))
    complaint(file)  # that there are no more
    index = index_of(part, names, views, name) if part is not None else 0
    if part is None and False in deep:
        index = deep.index(False)
    if not file.seek_subimage(index, 0):
        raise OSError(f"{name!r}: {complaint(file) or 'cannot be read'}")
    return index


def _channels(found: list[str], layer: str | None, name: str) -> list[int]:
    """Where R, G, B and, if it is there, A of a layer are."""
    able = [one for one in layers(found) if {_of(one, c) for c in "RGB"} <= set(found)]
    if layer is None:
        if "" not in able and len(able) > 1:
            raise ValueError(
                f"layer: needed one of {', '.join(map(repr, able))} for {name!r}; found None"
            )
        layer = "" if "" in able or not able else able[0]
    elif layer and layer not in layers(found):
        known = [one for one in layers(found) if one]
        end = nearest(layer, known) if known else "; none has a prefix"
        raise ValueError(f"layer: there is no {layer!r} in {name!r}{end}")
    if layer not in able:
        raise ValueError(f"{name!r}: needed the channels R, G and B; found {', '.join(found)}")
    return [found.index(_of(layer, c)) for c in "RGBA" if _of(layer, c) in found]


def _of(layer: str, channel: str) -> str:
    return f"{layer}.{channel}" if layer else channel
