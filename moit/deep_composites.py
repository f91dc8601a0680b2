"""Composites of deep images that may be larger than memory, band by band."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike, DTypeLike

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.arguments import path_name
from moit.checks.arrays import as_array
from moit.checks.exceptions import FragmentsError
from moit.core.questions import overflow_text
from moit.formats.deep_bands import USUAL_MEMORY, Bands, band_part
from moit.formats.deep_channels import wanted
from moit.formats.images import image_rows
from moit.questions import Asked, composite_and_overflows
from moit.system.progress import Progress

if TYPE_CHECKING:
    from moit.gpu import Device
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any


def composite_deep(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str],
    technique: str | Technique,
    *,
    part: int | str | None = None,
    layer: str | None = None,
    channels: Mapping[str, str] | None = None,
    background: ArrayLike = (0, 0, 0),
    device: str | Device = "cpu",
    exact: bool = False,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
    subimage: int | None = None,
) -> None:
    """Writes the picture that a technique makes of a deep OpenEXR file, however large that is.

    output : an image as `moit.write_image` writes it, .exr or .png; it appears whole or not at all.
    technique : one that is `local`: of the others a pixel's answer hangs on other pixels.
    part, layer, channels, subimage, memory : as `read_deep_bands`.

    Other arguments as `moit.composite`, and the picture is the same to the bit. It lies where the
    deep image lies, by data and display window, and keeps the header's metadata. Raises ValueError
    for a technique that is not local, else as `read_deep_bands`, `composite` and `write_image`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.composite_deep("panes.exr", "picture.exr", "power4")
    >>> moit.read_image("picture.exr").shape
    (6, 8, 4)
    """
    name = path_name(path)
    chosen = technique_named(technique)
    if not chosen.local:
        raise ValueError(
            f"technique: {chosen} lets a pixel hang on others, so an image cannot be composited in "
            "bands; needed one that is local"
        )
    read = band_part(name, wanted(part, layer, channels, subimage))
    width, height = read.size
    if "R" not in read.names:
        raise FragmentsError("color: composite needs the fragments' colour; found None")
    behind = as_array(background, "background")
    by_pixel = behind.ndim == 3
    if by_pixel and behind.shape != (height, width, 3):
        raise ValueError(f"background: expected (3,) or {(height, width, 3)}, got {behind.shape}")
    bands = Bands(name, read, memory).read(progress)
    place: dict[str, Any] = {"origin": read.first[::-1], "frame": read.frame}
    with image_rows(output, (height, width, 4), technique=chosen, **place) as put:
        row = overflows = 0
        for band in bands:
            end = row + band.shape[0]
            asked = Asked.of(band, chosen, threads, dtype, cull_opaque, device, exact=exact)
            image, more = composite_and_overflows(asked, behind[row:end] if by_pixel else behind)
            put(image)
            row, overflows = end, overflows + more
    if overflows:
        warnings.warn(overflow_text(overflows), RuntimeWarning, stacklevel=2)
