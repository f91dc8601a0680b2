"""Maps of errors as pages show them: all of one scene on one scale."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from moit import metrics
from moit.comparing.rows import Array, Result
from moit.reports.pictures import data_uri, error_palette, png


def error_maps(reference: Array, results: Sequence[Result]) -> tuple[list[Array], str]:
    """(H, W) maps in [0, 1] and what they are."""
    maps: Callable[[Array, Array], Array] = metrics.flip_map
    images = [result.image for result in results if result.image is not None]
    try:
        return [np.asarray(maps(image, reference)) for image in images], "FLIP error"
    except ValueError:  # too small for FLIP, or not finite
        off = [np.abs(image[..., :3] - reference[..., :3]).mean(axis=-1) for image in images]
        off = [np.nan_to_num(one, nan=1.0) for one in off]
        return off, "absolute error"


def map_range(maps: Sequence[Array]) -> float:
    """A round number that few pixels of any map exceed, at most 1."""
    most = max(float(np.percentile(one, 99.9)) for one in maps)
    if most <= 1e-6:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return min([1.0, *(k * power for k in (1, 2, 5, 10) if k * power >= most)])


def scale(most: float, what: str, maps: Sequence[Array]) -> str:
    """A line of HTML that says what the colours of maps mean, from 0 to `most`; what is more in
    any of them looks the same."""
    colours = data_uri(png(np.arange(256, dtype=np.uint8)[None, :], error_palette()))
    more = " or more" if map_range(maps) > most else ""
    return f'{what}: 0 <img class="scale" src="{colours}" alt="from dark to light"> {most:g}{more}'
