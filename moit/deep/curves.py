"""The transmittance along one ray of a deep file, drawn."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from moit.catalog import Technique, listed
from moit.catalog import techniques as every
from moit.catalog.palette import most_different
from moit.checks.arguments import path_name
from moit.deep.opened import Deep
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.system.files import must_be_writable, write_text
from moit.system.progress import Progress, preparing

# What curves are written as: SVG by moit, the others by matplotlib.
ENDINGS = ("svg", "png", "jpg", "tif", "webp", "pdf", "eps")
MOST_CURVES = 6  # that are drawn where none is named
DOTS_PER_INCH = 150  # to be read on any screen


def curve(
    path: Deep,
    output: str | os.PathLike[str],
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    pixel: tuple[int, int] | None = None,
    *,
    part: int | str | None = None,
    layer: str | None = None,
    channels: Mapping[str, str] | None = None,
    progress: Progress = False,
) -> None:
    """Draws the transmittance over depth along one ray: the exact one, and each technique's.

    path : a deep OpenEXR file, Fragments, or whatever else `composite` takes.
    output : .svg, or with matplotlib .png, .jpg, .tif, .webp, .pdf or .eps. It appears whole or not
        at all.
    techniques : techniques or names, each with a curve. None: six of different ideas.
    pixel : (y, x) in the array; negative numbers count from the end. None: the pixel with the
        most fragments.
    part, layer, channels : as `read_deep`.
    progress : as `moit.compare`; a callable is not told.

    The whole part is read; `moit.plot.curves` draws on matplotlib's Axes.

    Raises ValueError for another ending and for a technique without curve, IndexError where there
    is no such pixel, ImportError where matplotlib is needed and missing, OSError where the file
    cannot be written, else as `read_deep`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.curve("panes.exr", "curve.svg", ["power4", "power8"])
    """
    from moit.plot import checked_pixel

    name = path_name(output, "output")
    ending = os.path.splitext(name)[1][1:].lower()
    if ending not in ENDINGS:
        endings = ", ".join(f".{one}" for one in ENDINGS)
        raise ValueError(
            f"output: expected a name that ends in one of {endings}; got {name!r:.200}"
        )
    must_be_writable(name)
    with preparing(progress, "curve") as doing:
        doing.now("reads Fragments" if not isinstance(path, str) else f"reads {path}")
        f = as_fragments(path, "path", part, layer, channels)
    chosen = _chosen(techniques)
    at = checked_pixel(f, pixel)
    with preparing(progress, "curve") as doing:
        doing.now(f"{len(chosen)} techniques")
        if ending == "svg":
            _write_svg(f, chosen, at, name)
        else:
            _write_figure(f, chosen, at, name, ending)


def _chosen(
    techniques: str | Technique | Iterable[str | Technique] | None,
) -> list[Technique]:
    if techniques is None:
        known = {str(one): one for one in every() if one.has_curve and str(one) != "sorted"}
        return [known[name] for name in most_different(list(known), MOST_CURVES)]
    given = [techniques] if isinstance(techniques, (str, Technique)) else list(techniques)
    chosen = listed(given)
    for technique in chosen:
        if not technique.has_curve:
            raise ValueError(f"{technique} has no transmittance but at fragments, so no curve")
    return chosen


def _write_svg(f: Fragments, chosen: Sequence[Technique], at: tuple[int, int], path: str) -> None:
    from moit.comparing.charts import STANDALONE, curves_chart
    from moit.comparing.measurement import curve, curve_depths
    from moit.reports.svg import standalone, svg

    depth = curve_depths(f, at)
    held = [(str(one), curve(f, one, at, depth)) for one in chosen]
    chart = curves_chart(depth, curve(f, "sorted", at, depth), held)
    write_text(path, standalone(svg(chart, STANDALONE, legend=True)))


def _write_figure(
    f: Fragments, chosen: Sequence[Technique], at: tuple[int, int], path: str, ending: str
) -> None:
    from moit.plot import curves

    figure: Any = curves(f, chosen, at, most=max(len(chosen), 1)).figure
    figure.savefig(path, dpi=DOTS_PER_INCH, format=ending)
