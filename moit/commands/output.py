"""What commands write into the folder that they are given: pictures, curves, tables, the page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from moit.comparing.report import Report
    from moit.numerics.report import StabilityReport

CURVE_ENDING = ".svg"


def cleared_results(folder: str, resume: bool) -> str:
    """The folder of single results within an output folder; emptied unless resumed."""
    from moit.comparing.results_folder import ResultsFolder

    path = os.path.join(folder, "results")
    kept = ResultsFolder(path)
    if not resume:
        kept.clear()
    return path


def write_images(report: Report, folder: str) -> list[str]:
    """A PNG per scene and technique, at full size."""
    from moit.comparing.results_folder import file_name
    from moit.reports.pictures import image_png
    from moit.system.files import write_bytes

    paths = []
    for result in report.results:
        if result.image is None or not result.image.size:
            continue
        device = "" if result.row["device"] == "cpu" else f"-{result.row['device']}"
        name = file_name(f"{result.row['scene']}-{result.row['technique']}{device}")
        path = os.path.join(folder, "images", f"{name}.png")
        os.makedirs(os.path.dirname(path), exist_ok=True)
        write_bytes(path, image_png(result.image, result.image.shape[1]))
        paths.append(path)
    return paths


def write_curves(report: Report, folder: str) -> list[str]:
    """A plot per scene: its pixel with the most fragments."""
    from moit.comparing.results_folder import file_name
    from moit.reports.charts import Series, colours, curve_chart, standalone
    from moit.system.files import write_text

    paths = []
    for scene in report.scenes.values():
        held = [
            (result.row["technique"], result.curves[0])
            for result in report.of_scene(scene.name)
            if result.curves and result.row["technique"] != "sorted"
        ]
        if not scene.pixels or not held:
            continue
        series = [
            Series(name, curve, colour, str(i))
            for i, ((name, curve), colour) in enumerate(zip(held, colours(len(held)), strict=True))
        ]
        path = os.path.join(folder, "curves", f"{file_name(scene.name)}{CURVE_ENDING}")
        os.makedirs(os.path.dirname(path), exist_ok=True)
        chart = curve_chart(scene.depths[0], scene.curves[0], series, (760, 360), legend=True)
        write_text(path, standalone(chart))
        paths.append(path)
    return paths


def write_report(report: Report, folder: str, title: str, others: Sequence[str]) -> None:
    write_tables(report, folder, "report", title, others)


def write_tables(
    report: Report | StabilityReport,
    folder: str,
    name: str,
    title: str,
    others: Sequence[str] = (),
) -> None:
    """Writes the report's CSV, JSON and page, and prints it and what was written."""
    page, csv, json = (os.path.join(folder, f"{name}.{kind}") for kind in ("html", "csv", "json"))
    report.to_csv(csv)
    report.to_json(json)
    report.to_html(page, title)
    print(report)
    print()
    for path in dict.fromkeys(os.path.dirname(one) for one in others):
        count = sum(os.path.dirname(one) == path for one in others)
        print(f"{path}{os.sep}  ({count} files)")
    for path in (csv, json, page):
        print(path)
