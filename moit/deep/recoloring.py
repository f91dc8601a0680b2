"""Deep opacity with the colour of a flat picture."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import path_name, truth
from moit.checks.arrays import finite
from moit.deep.opened import Deep, Opened, bands_of, dimmed_by, opened
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_channels import COLOR
from moit.formats.deep_output import deep_output
from moit.formats.deep_rows import DeepRows, as_held
from moit.formats.images import read_image
from moit.formats.inspection import inspect
from moit.system.progress import Progress

Floats = NDArray[np.float64]


def recolor(
    path: Deep,
    picture: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    match_alpha: bool = False,
    part: int | str | None = None,
    layer: str | None = None,
    picture_part: int | str | None = None,
    picture_layer: str | None = None,
    half: bool = True,
    compression: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes a deep image of a flat picture's colours and a deep file's opacities.

    path, part, layer : the deep file, as `read_deep`; its colour is not read and may be missing.
    picture, picture_part, picture_layer : the flat picture, as `read_image`, of colour multiplied
        by alpha. Its pixels lie where its data window does; what it does not cover is black.
    match_alpha : False: opacities stay as they are, and flattened the colour is the picture's.
        True: they become such that flattened the alpha is the picture's too: the absorbance of a
        pixel's samples is multiplied by what it lacks. The picture needs an alpha then.
    half : whether R, G and B are half floats.
    output, compression, memory, progress : as `moit.deep.merge`.

    Each sample gets the share of the picture's light that its alpha has in the pixel: light =
    picture alpha / A, where A is the alpha of the whole pixel. So surfaces that the picture has
    seen behind one another get one colour, which is all that a flat picture knows. Where A is 0 and
    the picture is not black there is no sample to colour, of all channels or of one: a UserWarning
    counts such pixels. Windows
    and metadata are those of `path`, as are all its channels but R, G, B and, with `match_alpha`,
    alpha.

    Raises ValueError for numbers of the picture that are not finite, and for colours too large for
    half; else as `read_deep`, `read_image` and `write_deep`.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> moit.write_deep("panes.exr", f)
    >>> moit.write_image("flat.exr", moit.composite(f, "sorted"))
    >>> moit.deep.recolor("panes.exr", "flat.exr", "colored.exr")
    >>> moit.read_deep("colored.exr").shape
    (6, 8)
    """
    truth("match_alpha", match_alpha)
    truth("half", half)
    name = path_name(picture)
    image = read_image(name, part=picture_part, layer=picture_layer)
    finite(image, f"picture {name!r}", image.dtype)
    if match_alpha and image.shape[2] < 4:
        raise ValueError(f"match_alpha: needed a picture with alpha; {name!r} has none")
    corner = _origin(name, picture_part)
    lost = 0
    with opened(path, part, layer) as seen:
        top, height = seen.origin[0], seen.shape[0]
        place = seen.place()
        prefix = f"{seen.part.layer}." if seen.part.layer else ""
        colors = [f"{prefix}{one}" for one in COLOR]
        types = seen.types | dict.fromkeys(colors, np.float16 if half else np.float32)
        with deep_output(os.fspath(output), place, types, compression) as out:
            for (rows,) in bands_of([seen], top, top + height, memory, progress):
                flat = _window(image, corner, rows.shape, rows.origin)
                colored, without = recolored(seen, rows, flat, types, colors, match_alpha)
                lost += without
                out.put(colored)
    if lost:
        warnings.warn(
            f"{name!r}: {lost} pixels that are not black have no deep sample with alpha to colour",
            UserWarning,
            stacklevel=2,
        )


def recolored(
    seen: Opened,
    rows: DeepRows,
    flat: Floats,
    types: dict[str, Any],
    colors: list[str],
    match_alpha: bool,
) -> tuple[DeepRows, int]:
    """Rows with the colour of (P, channels) of a picture, and how many pixels have none to take
    it."""
    counts = np.diff(rows.offsets)
    alpha = seen.samples(rows).alpha.astype(np.float64)
    channels = dict(rows.channels)
    absorbed = np.stack([_sums(_absorbance(one), rows) for one in alpha])
    hidden = -np.expm1(-absorbed)
    if match_alpha:
        wanted = np.clip(flat[:, 3], 0.0, 1.0)
        alpha = _matched(alpha, absorbed, wanted, counts)
        hidden = np.where(absorbed > 0, wanted, 0.0)
        for name, values in zip(seen.alphas(), alpha, strict=True):
            channels[name] = as_held(values, types[name], name)
        net = seen.net_alpha()
        if net:
            channels[net] = as_held(alpha.mean(axis=0), types[net], net)
    without = np.zeros(len(flat), bool)
    for c, name in enumerate(colors):
        k = dimmed_by(name, len(alpha)) or 0
        share = np.divide(flat[:, c], hidden[k], out=np.zeros(len(flat)), where=hidden[k] > 0)
        channels[name] = as_held(np.repeat(share, counts) * alpha[k], types[name], name)
        without |= (hidden[k] == 0) & (flat[:, c] != 0)
    return rows.with_channels(channels), int(np.count_nonzero(without))


def _absorbance(alpha: Floats) -> Floats:
    """As great for what is opaque as doubles tell it from what is not."""
    absorbance: Floats = -np.log1p(-np.minimum(alpha, 1 - 2.0**-53))
    return absorbance


def _sums(values: NDArray[Any], rows: DeepRows) -> Floats:
    """(P,) the sum over each pixel's samples."""
    found = np.zeros(len(rows.offsets) - 1)
    some = np.diff(rows.offsets) > 0
    if some.any():
        found[some] = np.add.reduceat(values, rows.offsets[:-1][some])
    return found


def _matched(alpha: Floats, absorbed: Floats, wanted: Floats, counts: Any) -> Floats:
    """Alphas of which each pixel's whole alpha is the one wanted, as far as it has any."""
    power = np.ones_like(absorbed)
    np.divide(_absorbance(wanted), absorbed, out=power, where=absorbed > 0)
    power[(absorbed >= _absorbance(np.ones(1))) & (wanted == 1)] = 1  # opaque as they are
    each = np.repeat(power, counts, axis=1)
    return np.where(each == 1, alpha, -np.expm1(-each * _absorbance(alpha)))


def _origin(name: str, part: int | str | None) -> tuple[int, int]:
    """(y, x) of a picture's first pixel."""
    if not name.lower().endswith(".exr"):
        return 0, 0
    parts = inspect(name, samples=False).parts
    flat = [one for one in parts if one.kind in ("scanlineimage", "tiledimage")] or list(parts)
    if part is not None:
        flat = [one for one in parts if part in (one.index, one.name, one.view)]
    return flat[0].origin


def _window(
    image: NDArray[Any], corner: tuple[int, int], shape: tuple[int, int], origin: tuple[int, int]
) -> Floats:
    """(P, channels) of a picture in a window, black where it has no pixels."""
    height, width = shape
    found = np.zeros((height, width, image.shape[2]))
    top, left = origin[0] - corner[0], origin[1] - corner[1]
    y0, x0 = max(top, 0), max(left, 0)
    y1, x1 = min(top + height, image.shape[0]), min(left + width, image.shape[1])
    if y0 < y1 and x0 < x1:
        found[y0 - top : y1 - top, x0 - left : x1 - left] = image[y0:y1, x0:x1]
    return found.reshape(height * width, -1)
