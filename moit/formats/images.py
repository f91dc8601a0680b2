"""Images in files: linear in memory, as they are in OpenEXR, encoded as sRGB in PNG."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import path_name, truth
from moit.checks.arrays import as_array
from moit.checks.exceptions import FragmentsTypeError
from moit.reports.pictures import from_srgb, srgb8
from moit.system.files import replacing

ENDINGS = (".exr", ".png")


def read_image(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """(H, W, 3), or (H, W, 4) where the file has alpha, of an image file; linear float32.

    path : OpenEXR, PNG or what else OpenImageIO reads; the first image in it. Pixels of 8 or 16
        bits are taken as sRGB and decoded (alpha is linear), floats are taken as they are. Colour
        is neither multiplied by alpha nor divided by it.

    Raises OSError where the file is missing, damaged or of no known kind, ValueError where it is
    deep (`read_deep` reads it), has no channels R, G and B or has pixels of another type.

    >>> moit.write_image("red.exr", np.ones((2, 3, 3)) * [1, 0, 0])
    >>> moit.read_image("red.exr")[0, 0].tolist()
    [1.0, 0.0, 0.0]
    """
    name = path_name(path)
    with open(name, "rb"):  # what the system refuses is its own OSError
        pass
    try:
        pixels, encoded = _read(name)
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

    The file appears whole or not at all. Raises OSError where it cannot be written, TypeError or
    ValueError for anything that cannot be an image, for another ending of the name and for
    numbers that the file cannot hold.

    >>> moit.write_image("gray.png", np.full((2, 3, 3), 0.5))
    >>> moit.read_image("gray.png").shape
    (2, 3, 3)
    """
    pixels = _image(image)
    height, width, channels = pixels.shape
    with image_rows(path, (height, width, channels), technique, attributes, half, alpha) as put:
        put(pixels)


@contextmanager
def image_rows(
    path: str | os.PathLike[str],
    shape: tuple[int, int, int],
    technique: object = None,
    attributes: Mapping[str, str | int | float] | None = None,
    half: bool = False,
    alpha: bool | None = None,
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
    header = _header(technique, attributes, text=not exr)
    with _writing(name, (*shape[:2], channels), stored, header) as put:

        def put_converted(rows: NDArray[Any]) -> None:
            kept = rows[..., :channels]
            put(_floats(kept, stored) if exr else _bytes(kept))

        yield put_converted


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
            raise TypeError(f"attributes: expected names that are not empty, got {key!r}")
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise TypeError(
                f"attributes[{key!r}]: expected str, int or float, got {type(value).__name__}"
            )
        if isinstance(value, int) and not -(2**31) <= value < 2**31 and not text:
            raise ValueError(f"attributes[{key!r}]: expected an integer of 32 bits, got {value}")
        header[key] = value
    if text:
        header = {key: str(value) for key, value in header.items()}
        header["oiio:UnassociatedAlpha"] = 1  # else colour is divided by alpha
    return header


def _read(name: str) -> tuple[NDArray[np.float32], bool]:
    """Colour and alpha as stored, integers divided by their greatest value, and whether they are
    sRGB-encoded."""
    import OpenImageIO as oiio

    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)  # else PNG's colour is multiplied by alpha
    file = oiio.ImageInput.open(_unicode(name), as_stored)
    if file is None:
        raise OSError(f"{name!r}: {oiio.geterror() or 'of no known kind'}")
    try:
        spec = file.spec()
        if spec.deep:
            raise ValueError(f"{name!r}: a deep image, not a flat one; moit.read_deep reads it")
        channels = _channels(list(spec.channelnames), name)
        types = {str(spec.channelformat(channel)) for channel in channels}
        encoded = types <= {"uint8", "uint16"}
        if not encoded and not types <= {"half", "float", "double"}:
            found = ", ".join(sorted(types))
            raise ValueError(f"{name!r}: expected floats or pixels of 8 or 16 bits, found {found}")
        pixels = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        error = file.geterror()
    finally:
        file.close()
    if pixels is None:
        raise OSError(f"{name!r}: {error or 'its pixels cannot be read'}")
    return pixels[..., channels], encoded


@contextmanager
def _writing(
    name: str, shape: tuple[int, int, int], dtype: Any, header: Mapping[str, Any]
) -> Iterator[Callable[[NDArray[Any]], None]]:
    import OpenImageIO as oiio

    height, width, count = shape
    spec = oiio.ImageSpec(width, height, count, _TYPES[dtype])
    for key, value in header.items():
        spec.attribute(key, value)
    with replacing(name) as part:
        open(part, "xb").close()  # what the system refuses is its own OSError
        file = oiio.ImageOutput.create(_unicode(part))
        if file is None:
            raise OSError(f"{name!r}: {oiio.geterror()}")

        def must(done: bool) -> None:
            if not done:
                raise OSError(f"{name!r}: {file.geterror() or 'cannot be written'}")

        at = 0

        def put(rows: NDArray[Any]) -> None:
            nonlocal at
            must(file.write_scanlines(at, at + len(rows), 0, rows))
            at += len(rows)

        must(file.open(part, spec))
        try:
            yield put
        except BaseException:
            file.close()  # complains of rows that are missing
            file.geterror()
            raise
        must(file.close())


_TYPES = {np.float32: "float", np.float16: "half", np.uint8: "uint8"}


def _unicode(name: str) -> str:
    try:
        name.encode()
    except UnicodeEncodeError:
        raise OSError(f"{name!r}: OpenImageIO takes Unicode names only") from None
    return name


def _channels(found: list[str], name: str) -> list[int]:
    """Where R, G, B and, if it is there, A are."""
    if not {"R", "G", "B"} <= set(found):
        raise ValueError(f"{name!r}: needed the channels R, G and B; found {', '.join(found)}")
    return [found.index(channel) for channel in "RGBA" if channel in found]
