"""The HTML page of a report: one file that needs no other and no network.

Everything that comes from names, notes and files is escaped; styles and script are this
package's own files, pasted in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from moit import metrics
from moit.catalog.palette import Look, technique_looks
from moit.comparing.charts import errors_chart, scene_curves
from moit.comparing.rows import Findings, Result, Scene
from moit.comparing.tables import full_table
from moit.reports.blocks import WIDEST
from moit.reports.columns import number
from moit.reports.page import html_page
from moit.reports.pictures import Array, data_uri, error_palette, image_png, map_png, png
from moit.reports.svg import svg
from moit.reports.tables import html_table

MOST_PIXELS = 24e6  # of all images together: about as many bytes


def page(report: Findings, title: str) -> str:
    """The page's text."""
    names = list(report.scenes) or list(dict.fromkeys(row["scene"] for row in report.rows))
    labels = list(dict.fromkeys(row["technique"] for row in report.rows))
    palette = dict(zip(labels, technique_looks(labels), strict=True))
    width = _picture_width(report)
    scenes = [_scene(report, name, i, palette, width) for i, name in enumerate(names)]
    body = f"""<h2>All numbers</h2>
<p class="faint">{_how_to_read(report)}</p>
<div class="wide">{html_table(full_table(report, palette), page=True)}</div>
{"".join(scenes)}"""
    links = {f"scene{i}": name for i, name in enumerate(names)}
    return html_page(title, _measured_on(report), links, body)


def _measured_on(report: Findings) -> str:
    reference = f"Reference: {report.reference}, composited in float64."
    return f"{report.machine}. {reference}" if report.machine else reference


def _how_to_read(report: Findings) -> str:
    upward = [name for name in ("psnr", "ssim") if name in report.metrics]
    words = ["Less is better"]
    if upward:
        words.append(f", but for {' and '.join(upward)}")
    words.append(
        ". ms: one composite, median; bits: state per pixel beyond a colour target; T: error of"
        " the transmittance in front of each fragment. The best of each scene is bold (the"
        " reference aside). Click a heading to sort; point at a number for all its digits."
    )
    return escape("".join(words))


# A scene


def _scene(report: Findings, name: str, index: int, palette: dict[str, Look], width: int) -> str:
    scene = report.scenes.get(name)
    results = report.of_scene(name)
    keys = {id(result.row): f"{index}-{k}" for k, result in enumerate(results)}
    head = f'<h2 id="scene{index}">{escape(name)}</h2>'
    if scene is not None:
        mean = scene.fragments / max(scene.shape[0] * scene.shape[1], 1)
        head += (
            f'<p class="faint">{scene.shape[1]} x {scene.shape[0]} pixels, '
            f"{scene.fragments:,} fragments: {number(mean)} a pixel, "
            f"at most {scene.most_layers:,}</p>"
        )
    pictures = [r for r in results if r.image is not None and r.image.size]
    left, gallery = "", ""
    if scene is not None and scene.reference is not None and scene.reference.size and pictures:
        left = _view(scene, width)
        gallery = _gallery(report, scene, pictures, keys, width)
    plots = _plots(report, results, keys, palette)
    curves = "" if scene is None else _curves(scene, results, keys, palette)
    return (
        f'<section class="of-scene">{head}<div class="scene"><div>{left}</div>'
        f'<div class="plots">{plots}</div></div>{curves}{gallery}</section>'
    )


def _view(scene: Scene, width: int) -> str:
    assert scene.reference is not None
    height, across = scene.shape
    source = data_uri(image_png(scene.reference, width))
    smooth = " smooth" if across >= 400 else ""
    modes = (
        ("technique", "Technique"),
        ("reference", "Reference"),
        ("map", "Error map"),
        ("split", "Split"),
        ("flicker", "Flicker"),
    )
    buttons = "".join(f'<button data-mode="{m}">{text}</button>' for m, text in modes)
    # A ray or a strip would be a line or a tower.
    ratio = min(max(across / height, 0.6), 4.0)
    return (
        f'<div class="view" style="aspect-ratio:{ratio:.4f}">'
        f'<img class="reference{smooth}" src="{source}" alt="reference">'
        f'<img class="front{smooth}" alt="chosen technique" hidden>'
        '<div class="seam" hidden></div><span class="tag">reference</span>'
        '<span class="tag right" hidden></span></div>'
        f'<div class="controls">{buttons}</div>'
        '<p class="faint">Choose a technique below or in the plot; click the image to change to '
        "the reference and back.</p>"
    )


def _gallery(
    report: Findings, scene: Scene, results: Sequence[Result], keys: dict[int, str], width: int
) -> str:
    assert scene.reference is not None
    maps, what = error_maps(scene.reference, results)
    most = map_range(maps)
    first = _shown_first(report, results)
    cards = []
    for result, errors in zip(results, maps, strict=True):
        assert result.image is not None
        row = result.row
        image = data_uri(image_png(result.image, width))
        error = data_uri(map_png(errors / most, width))
        numbers = ", ".join(
            f"{metric} {number(row[metric])}"
            for metric in ("flip", "ssim", "psnr", "rmse", *report.metrics)[:2]
            if row.get(metric) is not None
        )
        name = escape(row["technique"])
        cards.append(
            f'<div class="card" tabindex="0" role="button" data-key="{keys[id(result.row)]}" '
            f'data-name="{name}"{" data-first" if result is first else ""}>'
            f'<div class="pair"><img src="{image}" alt="{name}" loading="lazy">'
            f'<img src="{error}" alt="error of {name}" loading="lazy"></div>'
            f'<div class="name">{name}</div><div class="numbers faint">{escape(numbers)}</div>'
            "</div>"
        )
    return (
        f'<p class="faint" style="margin-top:16px">Each technique and its {what} '
        f'0 <img class="scale" src="{_scale()}" alt="dark to light"> {most:g}</p>'
        f'<div class="gallery">{"".join(cards)}</div>'
    )


def error_maps(reference: Array, results: Sequence[Result]) -> tuple[list[Array], str]:
    """(H, W) maps in [0, 1] and what they are."""
    maps: Callable[[Array, Array], Array] = metrics.flip_map
    images = [result.image for result in results if result.image is not None]
    try:
        return [np.asarray(maps(image, reference)) for image in images], "FLIP error:"
    except ValueError:  # too small for FLIP, or not finite
        off = [np.abs(image[..., :3] - reference[..., :3]).mean(axis=-1) for image in images]
        off = [np.nan_to_num(one, nan=1.0) for one in off]
        return off, "absolute error:"


def map_range(maps: Sequence[Array]) -> float:
    """A round number that few pixels of any map exceed, at most 1."""
    most = max(float(np.percentile(one, 99.9)) for one in maps)
    if most <= 1e-6:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return min([1.0, *(k * power for k in (1, 2, 5, 10) if k * power >= most)])


def _shown_first(report: Findings, results: Sequence[Result]) -> Result:
    """The technique that the view begins with: the best that is not the reference."""
    metric = report.main_metric()
    others = [r for r in results if r.row["technique"] != report.reference] or list(results)
    known = [r for r in others if isinstance(r.row.get(metric), (int, float))]
    return min(known, key=lambda r: float(r.row[metric])) if known else others[0]


def _scale() -> str:
    return data_uri(png(np.arange(256, dtype=np.uint8)[None, :], error_palette()))


def _picture_width(report: Findings) -> int:
    """So wide that all images of the page stay below MOST_PIXELS."""
    total = 0.0
    for scene in report.scenes.values():
        height, width = scene.shape
        used = min(width, WIDEST)
        count = 1 + 2 * len(report.of_scene(scene.name))
        total += count * used * used * height / max(width, 1)
    return max(96, round(WIDEST * min(1.0, math.sqrt(MOST_PIXELS / max(total, 1.0)))))


# The plots


def _plots(
    report: Findings, results: Sequence[Result], keys: dict[int, str], palette: dict[str, Look]
) -> str:
    metric = report.main_metric()
    rows = [result.row for result in results]
    colours = {name: look.colour for name, look in palette.items()}
    parts = []
    for by, factor, words in (("seconds", 1e3, "milliseconds"), ("bits", 1.0, "bits per pixel")):
        chart = errors_chart(report, rows, metric, by, colours, keys, factor, words)
        if chart.points:
            parts.append(f"<h3>{escape(metric)} against {words}</h3>{svg(chart, (600, 320))}")
    return "".join(parts)


def _curves(
    scene: Scene, results: Sequence[Result], keys: dict[int, str], palette: dict[str, Look]
) -> str:
    charts = [
        f"<div><h3>Transmittance at x {x}, y {y}</h3>{svg(chart, (420, 240))}</div>"
        for (y, x), chart in zip(
            scene.pixels, scene_curves(scene, results, palette, keys), strict=True
        )
    ]
    return f'<div class="plots three">{"".join(charts)}</div>' if charts else ""
