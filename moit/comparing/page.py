"""The HTML page of a report: one file that needs no other, no network and no script.

It opens on the answer; then each scene's pictures, curves and costs; the numbers are last.
Everything that comes from names, notes and files is escaped; styles and script are this
package's own files, pasted in.
"""

from __future__ import annotations

from html import escape

from moit.catalog.palette import technique_looks
from moit.comparing.answer import answer
from moit.comparing.opening import opening
from moit.comparing.page_pictures import picture_width, pictures
from moit.comparing.rows import Findings
from moit.comparing.scene_section import scene_section
from moit.comparing.summary import summary
from moit.comparing.tables import full_table
from moit.reports.page import html_page
from moit.reports.tables import html_table


def page(report: Findings, title: str) -> str:
    """The page's text. Where no GPU was asked for, frames are predicted on one all the same."""
    report = report if report.gpu or not report.scenes else report.on_gpu()
    names = list(report.scenes) or list(dict.fromkeys(row["scene"] for row in report.rows))
    labels = list(dict.fromkeys(row["technique"] for row in report.rows))
    palette = dict(zip(labels, technique_looks(labels), strict=True))
    said = answer(report)
    width = picture_width(report)
    top, sections = opening(report, said, None, palette, width), []
    for i, name in enumerate(names):
        keys = {id(result.row): f"{i}-{k}" for k, result in enumerate(report.of_scene(name))}
        shown = pictures(report, name, keys, width)
        if name == said.scene:
            top = opening(report, said, shown, palette, width)
        sections.append(scene_section(report, name, f"scene{i}", shown, keys, palette, said.shown))
    links = {f"scene{i}": name for i, name in enumerate(names)}
    links |= {"times": "Times", "numbers": "Numbers"}
    body = f"""{top}
{"".join(sections)}
{_times(report)}
<section><h2 id="numbers">Numbers</h2>
<p class="faint">{_how_to_read(report)}</p>
<div class="wide few">{html_table(summary(report, palette), page=True)}</div>
<details><summary>All numbers, of each scene and metric</summary>
<p class="faint">T: error of the transmittance in front of each fragment; the best of each scene
is bold.</p>
<div class="wide">{html_table(full_table(report, palette), page=True)}</div></details></section>"""
    return html_page(title, _measured_on(report), links, body)


def _measured_on(report: Findings) -> str:
    reference = f"Reference: {report.reference}, composited in float64."
    return f"{report.machine}. {reference}" if report.machine else reference


def _times(report: Findings) -> str:
    """Where times come from, and what a GPU would take: the place of `gpu-costs`."""
    machine = f" on this machine: {report.machine}" if report.machine else ""
    whole = ""
    if any(row["device"] == "gpu" for row in report.rows):
        whole = " Those of the device gpu are whole calls, with what goes to it and back."
    return (
        '<section><h2 id="times">Times</h2>'
        f"<p>Medians of whole composites{escape(machine)}.{whole} They compare techniques on it, "
        "and on others only roughly.</p>"
        '<div id="gpu-costs"><h3>On a GPU</h3><p>Times differ there, also in their order: memory '
        "that each fragment reads and writes, passes over the geometry and waiting for an order "
        "count more, arithmetic less. <code>moit bench --gpu</code> times the passes of techniques "
        f"on a GPU.</p>{_predicted(report)}</div></section>"
    )


def _predicted(report: Findings) -> str:
    if not any(row.get("gpu_ms") is not None for row in report.rows):
        return ""
    return (
        f"<p><b>Predicted, not measured:</b> the column gpu ms and the last plot of each scene say "
        f"what a frame takes on a {escape(report.gpu)}, by what AMD's compiler makes of the passes "
        "that <code>moit export</code> writes, or papers describe, and by a model of bytes and "
        "cycles. Nothing is predicted of techniques that keep lists of fragments.</p>"
    )


def _how_to_read(report: Findings) -> str:
    upward = [name for name in ("psnr", "ssim") if name in report.metrics]
    but = f", but for {' and '.join(upward)}" if upward else ""
    return escape(
        f"Nearest first; less is better{but}, the best is bold (the reference aside). bits: state "
        "per pixel beyond a colour target. Click a heading to sort; point at a number for all its "
        "digits."
    )
