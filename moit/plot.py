"""Figures of transmittance and error with matplotlib, which `pip install 'moit[plot]'` brings."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from moit import metrics
from moit.catalog import Technique, listed
from moit.catalog.palette import technique_colours
from moit.checks.arguments import whole
from moit.comparing.charts import errors_chart
from moit.comparing.measurement import curve, curve_depths
from moit.comparing.report import Report
from moit.comparing.rows import cost_field
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.reports.charts import CurveChart, Series
from moit.reports.figures import draw
from moit.reports.pictures import error_palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from moit.numerics.report import StabilityReport
else:  # what `typing.get_type_hints` reads, without loading it
    Axes = Figure = StabilityReport = Any

COSTS = {
    "seconds": ("time of a picture (median)", "s"),
    "bits_per_pixel": ("bits per pixel", "bits"),
    "gpu_ms": ("time of a frame on a GPU, predicted", "s"),
}


def curves(
    f: Fragments | str | os.PathLike[str],
    techniques: str | Technique | Iterable[str | Technique] = ("power4", "power6", "power8"),
    pixel: tuple[int, int] | None = None,
    *,
    ax: Axes | None = None,
    part: int | str | None = None,
    layer: str | None = None,
) -> Axes:
    """Transmittance over depth along one ray: the exact one in black, and each technique's.

    f : Fragments, a path or a scene's name.
    techniques : techniques or names, each with a curve.
    pixel : (y, x) in the array; negative numbers count from the end. None: the pixel with the
        most fragments.
    ax : where to draw; None: a new figure.
    part, layer : as `composite`.

    Raises IndexError where there is no such pixel, TypeError for a technique without curve.

    >>> ax = moit.plot.curves(moit.scenes.load("panes", (8, 6)), ["power4", "power8"])
    >>> len(ax.lines)
    3
    """
    fragments = as_fragments(f, part=part, layer=layer)
    if not isinstance(techniques, (str, Technique, Iterable)):
        raise TypeError(
            f"techniques: expected techniques or their names, got {type(techniques).__name__}"
        )
    given = [techniques] if isinstance(techniques, (str, Technique)) else list(techniques)
    chosen = listed(given) if given else []
    at = checked_pixel(fragments, pixel)
    depth = curve_depths(fragments, at)
    held = [(str(one), curve(fragments, one, at, depth)) for one in chosen]
    ax = _new_axes() if ax is None else ax
    colours = technique_colours([name for name, _ in held])
    series = [Series(*one, colour, "") for one, colour in zip(held, colours, strict=True)]
    draw(CurveChart(depth, series, curve(fragments, "sorted", at, depth)), ax)
    ax.set_title(f"pixel x {at[1]}, y {at[0]}: {len(fragments[at]):,} fragments")
    ax.legend(frameon=False)
    return ax


def speed_error(
    report: Report,
    metric: str | None = None,
    by: str = "seconds",
    *,
    scene: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Error over cost, logarithmic, a marker per row; those that nothing beats are joined.

    metric : a metric's name or T_mae, T_p99, T_max; None: FLIP where there is one.
    by : "seconds", "bits", or "gpu", for which see `Report.on_gpu`.
    scene : one scene's name; None: all, each with its marker.
    ax : where to draw; None: a new figure.

    Full markers are the Pareto front, pale ones are beaten. Errors below a thousandth of the
    greatest, such as roundings of `sorted`, stand in a row of their own at the bottom. Names find
    their places when the figure is drawn, those of the front first; a name without room for it is
    left out. Rows without the cost or the error are left out. Raises ValueError for unknown names.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> report = moit.compare(f, ["wboit", "power4"], metrics="mse", repeat=1, progress=False)
    >>> ax = moit.plot.speed_error(report, "mse", by="bits")
    >>> bool(ax.get_xlabel())
    True
    """
    names = _scene_names(report, scene)
    metric = report.main_metric() if metric is None else metric
    labels = list(dict.fromkeys(row["technique"] for row in report.rows))
    palette = dict(zip(labels, technique_colours(labels), strict=True))
    rows = [row for row in report.rows if row["scene"] in names]
    title, unit = COSTS[cost_field(by)]
    factor = 1e-3 if by == "gpu" else 1.0  # times are charted in seconds
    chart = errors_chart(report, rows, metric, by, palette, {}, factor, title, unit)
    ax = _new_axes() if ax is None else ax
    draw(chart, ax)
    return ax


def stability(
    report: StabilityReport,
    column: str = "T_p99",
    techniques: str | Iterable[str] | None = None,
    precision: str | None = None,
) -> Any:
    """A column over the dial, a panel per family: an array of Axes, (rows, 3).

    column : one of numbers of the report, such as T_p99, own_p99, jump, bias_needed.
    techniques : names as in the report; None: all.
    precision : "16 bit", "float32" or "float64"; None: all, dotted, solid and dashed.

    Settings of a dial are evenly spaced. What is as good as 0 stands in a row of its own.
    Raises ValueError for unknown names, or where nothing is left to show.

    >>> report = moit.stability("power4", rays=2, progress=False)
    >>> moit.plot.stability(report).shape[1]
    3
    """
    from moit.numerics.charts import dial_chart
    from moit.numerics.columns import NUMBERS, PRECISIONS
    from moit.numerics.report import StabilityReport

    if not isinstance(report, StabilityReport):
        raise TypeError(f"report: expected a StabilityReport, got {type(report).__name__}")
    if not isinstance(column, str) or column not in NUMBERS:
        raise ValueError(f"column: expected one of {', '.join(NUMBERS)}, got {column!r:.80}")
    if precision is not None and precision not in PRECISIONS:
        raise ValueError(f"precision: expected one of {PRECISIONS} or None, got {precision!r:.80}")
    known = list(dict.fromkeys(row["technique"] for row in report.rows))
    names = known if techniques is None else _wanted(techniques, known)
    rows = [
        row
        for row in report.rows
        if row["technique"] in names
        and precision in (None, row["precision"])
        and row[column] is not None
    ]
    if not rows:
        raise ValueError(f"column: no row has {column}")
    families = list(dict.fromkeys(row["family"] for row in rows))
    colours = dict(zip(names, technique_colours(names), strict=True))
    lines = dict(zip(PRECISIONS, ("dotted", "solid", "dashed"), strict=True))
    high = math.ceil(len(families) / 3)
    figure = _figure((13.0, 3.2 * high + 0.6))
    axes = figure.subplots(high, 3, squeeze=False)
    for ax in axes.flat[len(families) :]:
        ax.set_axis_off()
    for ax, family in zip(axes.flat, families, strict=False):
        own = [row for row in rows if row["family"] == family]
        draw(dial_chart(own, column, colours, dict.fromkeys(names, ""), lines), ax)
        ax.set_title(family, fontsize=9)
    shown = {
        label: line
        for ax in axes.flat
        for line, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        shown.values(), shown.keys(), loc="outside lower center", ncols=6, frameon=False, fontsize=7
    )
    figure.suptitle(column if precision is None else f"{column}, {precision}", fontsize=10)
    return axes


def _wanted(names: str | Iterable[str], known: list[str]) -> list[str]:
    if not isinstance(names, Iterable):
        raise TypeError(f"techniques: expected names, got {type(names).__name__}")
    found = [names] if isinstance(names, str) else [str(one) for one in names]
    for name in found:
        if name not in known:
            raise ValueError(f"techniques: expected one of {', '.join(known)}; got {name!r:.80}")
    return list(dict.fromkeys(found))


def error_maps(
    report: Report, scene: str | None = None, metric: str = "flip", *, columns: int = 4
) -> Any:
    """Each technique's map of errors on one scene: an array of Axes, (rows, columns).

    scene : its name; None: the first.
    metric : mse, rmse, mae, flip or hdr_flip.

    Maps share one scale from 0: to 1 for flip and hdr_flip, else to the greatest 99.9th
    percentile. Raises ValueError for unknown names, or where the report has no images.

    >>> f = moit.scenes.load("panes", (16, 12))
    >>> report = moit.compare(f, ["wboit", "power4"], metrics="flip", repeat=1,
    ...     progress=False)
    >>> moit.plot.error_maps(report).shape
    (1, 2)
    """
    known = ("mse", "rmse", "mae", "flip", "hdr_flip")
    if not isinstance(metric, str) or metric not in known:
        raise ValueError(f"metric: expected one of {', '.join(known)}, got {metric!r:.80}")
    most_columns = whole("columns", columns, 1)
    name = next(iter(_scene_names(report, scene)), None)
    if name is None:
        raise ValueError("report: it has no rows")
    found = report.scenes.get(name)
    images = [(r.row["technique"], r.image) for r in report.of_scene(name) if r.image is not None]
    if found is None or found.reference is None or not images:
        raise ValueError(f"scene: the report has no images of {name!r:.80}")
    error_map = getattr(metrics, f"{metric}_map")
    maps = [(label, error_map(image, found.reference)) for label, image in images]
    most = 1.0
    if "flip" not in metric:
        most = max(float(np.percentile(one, 99.9)) for _, one in maps) or 1.0
    wide = min(most_columns, len(maps))
    high = math.ceil(len(maps) / wide)
    ratio = found.shape[0] / found.shape[1]
    figure = _figure((2.6 * wide + 0.8, min(2.6 * wide * ratio * high / wide + 0.4 * high, 60)))
    axes = figure.subplots(high, wide, squeeze=False)
    from matplotlib.colors import ListedColormap

    colours = ListedColormap(error_palette() / 255.0, name="moit-error")
    for ax in axes.flat:
        ax.set_axis_off()
    for ax, (label, one) in zip(axes.flat, maps, strict=False):
        picture = ax.imshow(one, cmap=colours, vmin=0, vmax=most)
        ax.set_title(label, fontsize=8)
    figure.colorbar(picture, ax=axes, label=f"{metric} on {name}", shrink=0.8)
    return axes


def checked_pixel(f: Fragments, pixel: tuple[int, int] | None) -> tuple[int, int]:
    """A pixel of `f` as (y, x), both at least 0; for None the one with the most fragments.

    >>> moit.plot.checked_pixel(moit.scenes.load("panes", (8, 6)), (-1, 0))
    (5, 0)
    """
    height, width = f.shape
    if pixel is None:
        if not height * width:
            raise IndexError("pixel: there are no pixels")
        most = int(np.argmax(f.counts))
        return most // width, most % width
    try:
        y, x = (one.__index__() for one in pixel)
    except (AttributeError, TypeError, ValueError):
        raise TypeError(f"pixel: expected two integers (y, x), got {pixel!r}") from None
    if not (-height <= y < height and -width <= x < width):
        raise IndexError(
            f"pixel: (y, x) = ({y}, {x}) is outside {height} x {width} (height x width)"
        )
    return y % height, x % width


def _scene_names(report: Report, scene: str | None) -> list[str]:
    if not isinstance(report, Report):
        raise TypeError(f"report: expected a Report, got {type(report).__name__}")
    names = list(dict.fromkeys(row["scene"] for row in report.rows))
    if scene is None:
        return names
    if not isinstance(scene, str) or scene not in names:
        raise ValueError(f"scene: expected one of {', '.join(names)}; got {scene!r:.80}")
    return [scene]


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            f"moit.plot needs matplotlib ({error}); install it with: pip install 'moit[plot]'"
        ) from error
    return pyplot


def _figure(size: tuple[float, float]) -> Figure:
    figure: Figure = _pyplot().figure(figsize=size, layout="constrained")
    return figure


def _new_axes() -> Axes:
    axes: Axes = _figure((7.0, 4.2)).subplots()
    return axes
