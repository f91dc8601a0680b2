"""Charts of what was compared; colours are handed in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from moit.comparing.rows import HIGHER_IS_BETTER, Array, Findings, Result, Row, Scene, cost_field
from moit.reports.charts import CurveChart, ErrorChart, Point, Series, colours


def curves_chart(depth: Array, exact: Array, curves: Sequence[tuple[str, Array]]) -> CurveChart:
    """Curves of one ray that stand alone."""
    found = zip(curves, colours(len(curves)), strict=True)
    series = [Series(name, y, colour, str(i)) for i, ((name, y), colour) in enumerate(found)]
    return CurveChart(depth, series, exact)


def scene_curves(
    scene: Scene, results: Sequence[Result], palette: Mapping[str, str], keys: Mapping[int, str]
) -> list[CurveChart]:
    """A chart for each of the scene's pixels, of all that have curves."""
    held = [r for r in results if r.curves is not None and r.row["technique"] != "sorted"]
    charts = []
    for i in range(len(scene.pixels)):
        series = [
            Series(r.row["technique"], r.curves[i], palette[r.row["technique"]], keys[id(r.row)])
            for r in held
            if r.curves is not None
        ]
        charts.append(CurveChart(scene.depths[i], series, scene.curves[i]))
    return charts


def errors_chart(
    report: Findings,
    rows: Iterable[Row],
    metric: str,
    by: str,
    palette: Mapping[str, str],
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
            palette[row["technique"]],
            keys.get(id(row), ""),
            id(row) in front,
            row["scene"] + ("" if row["device"] == "cpu" else f", {row['device']}"),
        )
        for row in rows
        if row.get(cost) is not None and row.get(metric) is not None
    ]
    return ErrorChart(points, title, metric, unit, metric in HIGHER_IS_BETTER)
