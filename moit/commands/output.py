"""What commands write into the folder that they are given: pictures, curves, tables, the page."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from moit.system.files import write_bytes, write_text

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
    from moit.comparing.charts import STANDALONE, curves_chart
    from moit.comparing.results_folder import file_name
    from moit.reports.svg import standalone, svg

    paths = []
    for scene in report.scenes.values():
        held = [
            (result.row["technique"], result.curves[0])
            for result in report.of_scene(scene.name)
            if result.curves and result.row["technique"] != "sorted"
        ]
        if not scene.pixels or not held:
            continue
        path = os.path.join(folder, "curves", f"{file_name(scene.name)}{CURVE_ENDING}")
        os.makedirs(os.path.dirname(path), exist_ok=True)
        chart = curves_chart(scene.depths[0], scene.curves[0], held)
        write_text(path, standalone(svg(chart, STANDALONE, legend=True)))
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
    paths = _tables(report, folder, name, title)
    print(report)
    print()
    for line in [*folders(others), *paths]:
        print(line)


def _tables(report: Report | StabilityReport, folder: str, name: str, title: str) -> list[str]:
    """The paths of the report's CSV, JSON and page, which are written."""
    csv, json, page = (os.path.join(folder, f"{name}.{kind}") for kind in ("csv", "json", "html"))
    report.to_csv(csv)
    report.to_json(json)
    report.to_html(page, title)
    return [csv, json, page]


def folders(paths: Sequence[str]) -> list[str]:
    """A line for each folder that files lie in."""
    counts = Counter(os.path.dirname(one) for one in paths)
    return [
        f"{folder}{os.sep}  ({count} {'file' if count == 1 else 'files'})"
        for folder, count in counts.items()
    ]


def write_demo(
    report: Report, folder: str, images: Sequence[str], curves: Sequence[str], kept: str
) -> None:
    """Writes the demo's report; prints its table, and of all that there is what it is.

    images, curves : what was written before; kept : the folder of single results.
    """
    csv, json, page = _tables(report, folder, "report", "moit demo")
    single = [os.path.join(at, name) for at, _, names in os.walk(kept) for name in names]
    told = [(page, "open this: the answer, pictures, curves and the table")]
    told += [(line, "each scene by each technique, at full size") for line in folders(images)]
    told += [(line, "transmittance along a ray of each scene") for line in folders(curves)]
    told += [
        (csv, "the table, for spreadsheets"),
        (json, "the table and the machine it was measured on, for programs"),
        (f"{kept}{os.sep}  ({len(single)} files)", "single measurements, which nobody need open"),
    ]
    width = max(len(path) for path, _ in told)
    print(report)
    print()
    for path, words in told:
        print(f"{path:<{width}}  {words}")
