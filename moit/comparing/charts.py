"""Charts of what was compared; colours are handed in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from moit.catalog.palette import Look, technique_looks
from moit.comparing.rows import HIGHER_IS_BETTER, Array, Findings, Result, Row, Scene, cost_field
from moit.reports.charts import CurveChart, ErrorChart, Point, Series

STANDALONE = (760, 360)  # pixels of a curve's chart in a file of its own


def curves_chart(depth: Array, exact: Array, curves: Sequence[tuple[str, Array]]) -> CurveChart:
    """Curves of one ray that stand alone."""
    looks = technique_looks([name for name, _ in curves])
    series = [
        Series(name, y, look.colour, str(i), look.line)
        for i, ((name, y), look) in enumerate(zip(curves, looks, strict=True))
    ]
    return CurveChart(depth, series, exact)


def scene_curves(
    scene: Scene, results: Sequence[Result], palette: Mapping[str, Look], keys: Mapping[int, str]
) -> list[CurveChart]:
    """A chart for each of the scene's pixels, of all results that have curves, in their order."""
    named = [(r.row["technique"], r) for r in results if r.curves is not None]
    held = [(name, r) for name, r in named if name != "sorted"]
    charts = []
    for i in range(len(scene.pixels)):
        series = [
            Series(name, r.curves[i], palette[name].colour, keys[id(r.row)], palette[name].line)
            for name, r in held
            if r.curves is not None
        ]
        charts.append(CurveChart(scene.depths[i], series, scene.curves[i]))
    return charts


def errors_chart(
    report: Findings,
    rows: Iterable[Row],
    metric: str,
    by: str,
    colours: Mapping[str, str],
    keys: Mapping[int, str],
    factor: float = 1.0,
    title: str = "",
    unit: str = "",
) -> ErrorChart:
    """An error over a cost, with a front for each scene and device; of rows that have both.

    by : "seconds", "bits" or "gpu". factor : from the cost to what is shown; title : what that is;
    unit : as in ErrorChart.
    """
    cost = cost_field(by)
    front = {id(row) for row in report.pareto(metric, by)}
    points = [
        Point(
            row["technique"] + ("" if row["device"] == "cpu" else f", {row['device']}"),
            row[cost] * factor,
            row[metric],
            colours[row["technique"]],
            keys.get(id(row), ""),
            id(row) in front,
            row["scene"] + ("" if row["device"] == "cpu" else f", {row['device']}"),
            row["technique"],
        )
        for row in rows
        if row.get(cost) is not None and row.get(metric) is not None
    ]
    return ErrorChart(points, title, metric, unit, metric in HIGHER_IS_BETTER)
