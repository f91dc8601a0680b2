"""show: linear images as a screen shows them, in Jupyter or into a file."""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import one_of, truth, whole
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsTypeError
from moit.formats.images import read_image
from moit.reports.pictures import from_srgb, srgb8
from moit.reports.shown_images import ShownImage
from moit.reports.tones import TONES, toned

Array = NDArray[Any]

MOST_STOPS = 100.0
LEAST_SIDE = 256  # screen pixels that the longer side of a tiny image gets, or nearly
MOST_SCALE = 64
A_LINE = 3  # pictures side by side, where nothing is said
SQUARE = 8  # pixels of a checkerboard's squares
BOARD = (0.6, 0.3)  # linear
ROWS = 32
LOST = (255, 0, 255)  # what is not finite: magenta, which no error map and few scenes have


@runtime_checkable
class HasImage(Protocol):
    """What carries a picture: a `moit.Rendering`, a `moit.Choice`."""

    @property
    def image(self) -> Any:
        """(height, width, 4) linear, or None."""


One = ArrayLike | HasImage | str | os.PathLike[str]


def show(
    image: One | Sequence[One] | Mapping[str, One],
    *,
    exposure: float = 0.0,
    tone: str = "none",
    background: ArrayLike | str | os.PathLike[str] | None = None,
    premultiplied: bool = True,
    titles: str | Sequence[str] | None = None,
    columns: int | None = None,
    scale: int | None = None,
) -> ShownImage:
    """A linear image as a screen shows it: in Jupyter a picture, elsewhere an object to save.

    image : (H, W), (H, W, 3) or (H, W, 4), linear floats, as `composite` gives them; truth values;
        or uint8 and uint16, which are sRGB-encoded already. A `moit.Rendering` or `moit.Choice`, or
        the path of an image file. A list of these or a dict {title: one of these}: side by side.
    exposure : in stops, -100 to 100: radiance times 2^exposure.
    tone : how radiance above 1 is shown. "none": as 1. "reinhard": L / (1 + L) of the luminance
        (Reinhard et al. 2002, equation 3). "aces": the curve of the Academy Color Encoding System
        as Narkowicz has it (2016), which HDR-FLIP sees images by.
    background : what is seen where alpha is below 1: linear radiance, (3,) or (H, W, 3), exposed as
        the image is; the path of an image; or "checkerboard". None: colour as it is, as over black,
        and right too where `composite` has put a background behind.
    premultiplied : whether colour is multiplied by alpha, as `composite` and OpenEXR have it.
        False: as most programs write PNG.
    titles : one for each image; None: a dict's keys, and the names of files in a list.
    columns : how many stand side by side; None: at most three.
    scale : as how many pixels a side each pixel is shown, 1 to 64, nearest. None: so many that a
        tiny image is about 256 pixels long; large ones are as they are.

    Pixels with a number that is not finite are magenta, and the text beside the picture says how
    many there are. In Jupyter pictures are shrunk to 960 pixels' width; what is saved is whole.

    Raises TypeError and ValueError for what cannot be an image, naming the argument; OSError where
    a file cannot be read.

    >>> image = moit.composite("panes", "power4")
    >>> shown = moit.show({"linear": image, "filmic": image}, exposure=1, tone="aces")
    >>> shown.titles, shown.columns
    (('linear', 'filmic'), 2)
    >>> shown.save("panes.png")
    """
    several, named = _each(image)
    stops = _stops(exposure)
    one_of("tone", tone, TONES)
    truth("premultiplied", premultiplied)
    behind = _behind(background)
    chosen = _titles(titles, named)
    line = min(A_LINE, len(several)) if columns is None else whole("columns", columns, 1)
    times = None if scale is None else whole("scale", scale, 1, MOST_SCALE)
    pictures, lost = [], []
    for name, one in several.items():
        radiance, alpha = _radiance(one, name)
        if not premultiplied and alpha is not None:
            radiance = radiance * alpha[..., None]
        pixels, bad = _screen(radiance, alpha, behind, 2.0**stops, tone, name)
        pictures.append(pixels)
        lost.append(bad)
    scales = tuple(times or _scale(one.shape) for one in pictures)
    return ShownImage(tuple(pictures), chosen, scales, min(line, len(pictures)), tuple(lost))


def _each(image: Any) -> tuple[dict[str, Any], list[str]]:
    """The images by what messages call them, and their own titles."""
    if isinstance(image, Mapping):
        for title in image:
            if not isinstance(title, str):
                raise TypeError(f"image: expected titles as str, got {type(title).__name__}")
        found = {f"image[{title!r:.80}]": one for title, one in image.items()}
        titles = list(image)
    elif isinstance(image, list | tuple):
        found = {f"image[{i}]": one for i, one in enumerate(image)}
        titles = [_file(one) for one in image]
    else:
        return {"image": image}, [""]
    if not found:
        raise ValueError("image: expected at least one, got none")
    return found, titles


def _file(one: Any) -> str:
    return os.path.basename(os.fspath(one)) if isinstance(one, str | os.PathLike) else ""


def _titles(given: str | Sequence[str] | None, named: list[str]) -> tuple[str, ...]:
    if given is None:
        return tuple(named)
    if isinstance(given, bytes | Mapping) or not isinstance(given, Iterable):
        raise TypeError(f"titles: expected str, or a sequence of these, got {type(given).__name__}")
    titles = (given,) if isinstance(given, str) else tuple(given)
    for title in titles:
        if not isinstance(title, str):
            raise TypeError(f"titles: expected str, got {type(title).__name__}")
    if len(titles) != len(named):
        raise ValueError(f"titles: expected {len(named)}, one for each image, got {len(titles)}")
    return titles


def _stops(exposure: float) -> float:
    array = as_array(exposure, "exposure")
    if array.dtype.kind not in "fiu" or array.shape != ():
        raise TypeError(f"exposure: expected a number of stops, got {exposure!r:.80}")
    stops = float(array)
    if not -MOST_STOPS <= stops <= MOST_STOPS:
        raise ValueError(f"exposure: expected from -100 to 100 stops, got {stops}")
    return stops


def _behind(background: Any) -> Any:
    """None, "checkerboard", or linear floats, (3,) or (H, W, 3)."""
    if background is None:
        return None
    if isinstance(background, str | os.PathLike):
        if background == "checkerboard":
            return background
        if not os.path.exists(background):
            raise FileNotFoundError(
                errno.ENOENT, "background: neither 'checkerboard' nor a file", os.fspath(background)
            )
        return read_image(background)[..., :3]
    array = as_array(background, "background")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"background: expected real numbers, got {array.dtype}")
    if array.shape != (3,) and not (array.ndim == 3 and array.shape[2] == 3):
        raise ValueError(f"background: expected (3,) or (height, width, 3), got {array.shape}")
    return finite(array, "background", np.float64)


def _radiance(one: Any, name: str) -> tuple[Array, Array | None]:
    """Linear floats (H, W, 3), and alpha, (H, W) or None."""
    if isinstance(one, str | os.PathLike):
        array: Array = read_image(one)
    else:
        carries = isinstance(one, HasImage)
        held = one.image if carries else one
        if carries and held is None:
            raise ValueError(f"{name}: expected a picture, got a {type(one).__name__} without one")
        try:
            array = as_array(held, name)
        except FragmentsTypeError as error:
            raise TypeError(*error.args) from error
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)):
        kind = f" {type(one).__name__}" if array.dtype == object else f" shape {array.shape}"
        raise (TypeError if array.dtype == object else ValueError)(
            f"{name}: expected (height, width), (height, width, 3) or (height, width, 4), got{kind}"
        )
    if not array.size:
        raise ValueError(f"{name}: expected at least one pixel, got {array.shape}")
    if array.dtype == bool:
        array = array.astype(np.float32)
    elif array.dtype in (np.uint8, np.uint16):
        array = (array / np.iinfo(array.dtype).max).astype(np.float32)
        array[..., :3] = from_srgb(array[..., :3])
    elif array.dtype.kind != "f":
        raise TypeError(
            f"{name}: expected floats, uint8 or uint16, got {array.dtype}; numbers that are linear "
            "radiance become floats by .astype(float)"
        )
    exact = np.float64 if array.dtype.itemsize > 4 else np.float32
    array = array.astype(exact, copy=False)
    if array.ndim == 2:
        return np.broadcast_to(array[..., None], (*array.shape, 3)), None
    return array[..., :3], array[..., 3] if array.shape[2] == 4 else None


def _screen(
    radiance: Array, alpha: Array | None, behind: Any, factor: float, tone: str, name: str
) -> tuple[NDArray[np.uint8], int]:
    """sRGB bytes, and how many pixels are not finite."""
    shape = radiance.shape[:2]
    under = None
    if behind is not None and alpha is not None:
        under = _board(shape) if isinstance(behind, str) else behind * factor
        if under.ndim == 3 and under.shape[:2] != shape:
            raise ValueError(
                f"background: with {name} of {shape} (height, width), it must be (3,) or "
                f"{(*shape, 3)}; got {under.shape}"
            )
    pixels = np.empty((*shape, 3), np.uint8)
    lost = 0
    for top in range(0, shape[0], ROWS):  # that many at once stay in cache
        rows = slice(top, top + ROWS)
        light: Array = radiance[rows]
        good = np.asarray(np.isfinite(light).all(axis=2))
        with np.errstate(all="ignore"):  # what becomes infinite is as bright as a screen can be
            light = light * light.dtype.type(factor)
            if alpha is not None:
                good &= np.isfinite(alpha[rows])
                if under is not None:
                    seen = (1.0 - np.clip(alpha[rows], 0.0, 1.0))[..., None]
                    below = under[rows] if under.ndim == 3 else under
                    light = light + seen * below.astype(light.dtype)
            pixels[rows] = srgb8(toned(np.where(good[..., None], light, 0.0), tone))
        pixels[rows][~good] = LOST
        lost += int(good.size - np.count_nonzero(good))
    return pixels, lost


def _board(shape: tuple[int, ...]) -> Array:
    """(H, W, 1) of two greys; tiny images have small squares."""
    side = max(1, min(SQUARE, max(shape) // SQUARE))
    rows = np.arange(shape[0])[:, None, None] // side
    columns = np.arange(shape[1])[None, :, None] // side
    return np.where((rows + columns) % 2 == 1, *BOARD)


def _scale(shape: tuple[int, ...]) -> int:
    return min(MOST_SCALE, max(1, math.floor(LEAST_SIDE / max(shape[:2]))))
