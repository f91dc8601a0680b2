"""Figures of pictures: grids as in papers, and maps of errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import metrics
from moit.catalog import Technique
from moit.checks.arguments import one_of, truth, whole
from moit.comparing.report import Report
from moit.comparing.rows import Result, Scene
from moit.plot.arguments import scene_names, technique_names
from moit.plot.crops import Crop, Crops, checked_crops
from moit.plot.grid import Cell, Grid, Row, draw_grid
from moit.plot.style import Style, checked_style, settings
from moit.reports.columns import number
from moit.showing import show

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:  # what `typing.get_type_hints` reads, without loading it
    Figure = Any

Array = NDArray[Any]

MAPS = ("mse", "rmse", "mae", "flip", "hdr_flip")
MOST = {None: 6, "paper": 3, "paper-double": 6}  # techniques side by side
WORD = "reference"


@dataclass(frozen=True)
class Asked:
    """How pictures are shown. columns : techniques side by side. with_reference : also where a
    technique is what the others are held against, which has the first place anyway."""

    metric: str
    has_maps: bool
    columns: int
    style: Style
    exposure: float = 0.0
    tone: str = "none"
    with_reference: bool = False

    @property
    def called(self) -> str:
        """The metric's name as papers write it."""
        return self.metric.upper().replace("_", "-")

    def pixels(self, image: Any) -> Array:
        """(H, W, 3) bytes of a report's image, which a background is behind already."""
        return show(image[..., :3], exposure=self.exposure, tone=self.tone).pixels[0]


def images(
    report: Report,
    scenes: str | Iterable[str] | None = None,
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    *,
    crops: Crops | Mapping[str, Crops] | None = None,
    errors: bool = True,
    metric: str = "flip",
    columns: int | None = None,
    exposure: float = 0.0,
    tone: str = "none",
    style: str | None = None,
) -> Figure:
    """Pictures as in a paper: a scene a row, the exact picture and a technique a column, with maps
    of errors and the mean error below each.

    report : what `moit.compare` gave.
    scenes, techniques : names as in the report, in the order in which they are shown; None: all.
    crops : parts that are shown larger below each picture, in frames of their colours: (y, x,
        height, width) in the array, at most four a scene; {scene: these} for each its own.
    errors : maps of errors, too.
    metric : mse, rmse, mae, flip or hdr_flip: what is below, and what maps show.
    columns : how many techniques are side by side; more go into further lines. None: 6, and 3 in a
        column of a paper.
    exposure, tone : of pictures, as `moit.show`; errors are those of the images as they are.
    style : "paper" (as wide as a column), "paper-double" (as both), or None: for screens.

    Maps share one scale from 0: to 1 for flip and hdr_flip, else to the greatest 99.9th
    percentile. The Figure's files hold texts as texts, with their fonts. Raises ValueError for
    unknown names, crops that are not within a picture, and where the report has no images.

    >>> f = moit.scenes.load("panes", (16, 12))
    >>> report = moit.compare(f, ["wboit", "power4"], metrics="flip", repeat=1, progress=False)
    >>> figure = moit.plot.images(report, crops=(2, 4, 5, 8), style="paper")
    >>> bool(figure.get_figwidth() == 3.33)
    True
    """
    made = checked_style(style)
    one_of("metric", metric, MAPS)
    has_maps = truth("errors", errors)
    wide = MOST[style] if columns is None else whole("columns", columns, 1)
    names = scene_names(report, scenes, "scenes")
    known = list(dict.fromkeys(_label(one) for one in report.results))
    chosen = technique_names(techniques, known)
    held = {name: _with_images(report, name, "scenes") for name in names}
    if not held:
        raise ValueError("report: it has no rows")
    parts = checked_crops(crops, held)
    asked = Asked(metric, has_maps, wide, made, exposure, tone)
    return _drawn(report, held, chosen, parts, asked).figure


def error_maps(
    report: Report,
    scene: str | None = None,
    metric: str = "flip",
    *,
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    columns: int = 4,
    style: str | None = None,
) -> Any:
    """Each technique's picture on one scene and its map of errors: an array of the maps' Axes,
    (rows, columns), whose `.figure` it is.

    scene : its name; None: the first.
    metric : mse, rmse, mae, flip or hdr_flip.
    techniques : names as in the report; None: all.
    columns : at most so many side by side, beside the exact picture.
    style : as `images`.

    Maps share one scale from 0: to 1 for flip and hdr_flip, else to the greatest 99.9th
    percentile. Raises ValueError for unknown names, or where the report has no images.

    >>> f = moit.scenes.load("panes", (16, 12))
    >>> report = moit.compare(f, ["wboit", "power4"], metrics="flip", repeat=1,
    ...     progress=False)
    >>> moit.plot.error_maps(report).shape
    (1, 2)
    """
    made = checked_style(style)
    one_of("metric", metric, MAPS)
    wide = whole("columns", columns, 1)
    name = next(iter(scene_names(report, scene, "scene")), None)
    if name is None:
        raise ValueError("report: it has no rows")
    found = _with_images(report, name, "scene")
    pictured = [_label(one) for one in report.of_scene(name) if one.image is not None]
    chosen = technique_names(techniques, pictured)
    if not chosen:
        raise ValueError("techniques: expected at least one, got none")
    asked = Asked(metric, True, wide, made, with_reference=True)
    grid = _drawn(report, {name: found}, chosen, {name: []}, asked)
    high = -(-len(chosen) // grid.wide)
    axes = np.full((high, grid.wide), None, object)
    for i in range(axes.size):
        axes.flat[i] = grid.maps[name, chosen[i]] if i < len(chosen) else grid.empty()
    return axes


def _drawn(
    report: Report,
    scenes: Mapping[str, Scene],
    chosen: Sequence[str],
    crops: Mapping[str, Sequence[Crop]],
    asked: Asked,
) -> Grid:
    """The grid of these scenes and techniques."""
    rows = []
    for name, scene in scenes.items():
        results = {_label(one): one for one in report.of_scene(name)}
        cells = [
            _cell(label, results.get(label), scene, asked)
            for label in chosen
            if asked.with_reference or label != report.reference
        ]
        heading, note = ("exact", "") if report.reference == "sorted" else (report.reference, WORD)
        exact = Cell(f"the {WORD}", heading, note, asked.pixels(scene.reference))
        rows.append(Row(name, exact, cells, crops[name]))
    scale = 1.0
    if "flip" not in asked.metric:
        maps = [cell.errors for row in rows for cell in row.cells if cell.errors is not None]
        scale = max((float(np.percentile(one, 99.9)) for one in maps), default=0.0) or 1.0
    with settings(asked.style):
        return draw_grid(rows, asked.style, asked.columns, scale, asked.called, asked.has_maps)


def _cell(label: str, result: Result | None, scene: Scene, asked: Asked) -> Cell:
    if result is None or result.image is None:
        return Cell(label, label, "")
    bits = result.row.get("bits_per_pixel")
    heading = label if bits is None else f"{label}, {bits:g} bits"
    pixels = asked.pixels(result.image)
    if min(scene.shape) < metrics.LEAST_SIDE:
        return Cell(label, heading, f"too small for {asked.called}", pixels)
    pair = result.image, scene.reference
    error = result.row.get(asked.metric)
    if error is None:
        error = getattr(metrics, asked.metric)(*pair)
    errors = getattr(metrics, f"{asked.metric}_map")(*pair) if asked.has_maps else None
    return Cell(label, heading, f"{asked.called} {_digits(float(error))}", pixels, errors)


def _label(result: Result) -> str:
    row = result.row
    return f"{row['technique']}" + ("" if row["device"] == "cpu" else f", {row['device']}")


def _digits(error: float) -> str:
    """Four decimals, so that numbers of a figure line up, but for those that have more to say."""
    return f"{error:.4f}" if 1e-3 <= error < 10 else number(error, 2)


def _with_images(report: Report, name: str, called: str) -> Scene:
    found = report.scenes.get(name)
    pictured = any(one.image is not None for one in report.of_scene(name))
    if found is None or found.reference is None or not pictured:
        raise ValueError(f"{called}: the report has no images of {name!r:.80}")
    return found
