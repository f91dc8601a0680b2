"""Writes docs/frontier.md and docs/frontier.png: `python docs/frontier.py [--draw check ...]`.

`python docs/frontier.py --picture` makes the picture alone, from the rows that the page has: where
some were measured later than the others, as the final draw is looked at once. `--gpu` likewise
writes what frames are predicted to take by the costs that are stored now (docs/gpu_costs.md), and
`--rows NAME ..` measures these techniques and writes their rows where they belong.

What was measured is kept in build/frontier, so that an interrupted run goes on; a core that was
built anew measures all anew. The page that is
committed is of the final draw at full size, which is looked at once for each release.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

import moit
from moit.comparing.rows import Row
from moit.judging.draws import KINDS
from moit.judging.fronts import AFFORDED, PASSES, WORDS, Means, falling, known
from moit.judging.page import chart, gpu_time
from moit.judging.registry import aims, registry
from moit.judging.running import SIZES
from moit.judging.sentences import COUNTS
from moit.reports.blocks import Block, Markdown, Paragraph, Plot
from moit.reports.charts import ErrorChart, Point
from moit.reports.figures import draw, marker_of
from moit.system.files import replacing, write_text

DOCS = Path(__file__).resolve().parent
TRIED = DOCS / "frontier_tried.md"  # what numbers of other draws say: the page's end
KEPT = DOCS.parent / "build" / "frontier"
GAIN = 0.25  # of a point over the last that is named: names of all would cover one another
MEASURES = {"flip": "mean FLIP over scenes", "mean_colour": "RMSE of colours, mean over rays' sets"}
NAMED = (
    "Not all have room for their names: of each line those have that err least, or less by "
    f"{GAIN:.0%} than what is named before."
)


def rows_of(page: str) -> list[Row]:
    """What the page's tables say of each technique, as far as the picture shows it."""
    rows: dict[str, Row] = {}
    for line in page.splitlines():
        cells = [one.strip() for one in line.strip("|").split("|")]
        if line.startswith("| technique |"):
            columns = cells
        if not line.startswith("| `") or not {"access", "order"} & set(columns):
            continue
        said = dict(zip(columns, cells, strict=True))
        name = said["technique"].split("`")[1]
        if "access" in said:
            flip = said["FLIP 320x180"].split()[0]
            rows[name] = {
                "technique": name,
                "bytes": float(said["bytes"]),
                "passes": int(said["passes"]),
                "access": said["access"],
                "flip": None if flip == "-" else float(flip),
                "mean_colour": None,
                "random": moit.technique(name).random,
            }
        elif name in rows:
            rows[name]["mean_colour"] = float(said["mean"].split()[0])
    return list(rows.values())


def with_gpu_times(page: str) -> str:
    """The page with what frames are predicted to take now."""
    lines = page.splitlines()
    place = 0
    for i, line in enumerate(lines):
        cells = line.split(" | ")
        if line.startswith("| technique |"):
            place = cells.index("GPU ms") if "GPU ms" in cells else 0
        elif place and line.startswith("| `"):
            cells[place] = gpu_time(moit.technique(line.split("`")[1]))
            lines[i] = " | ".join(cells)
    return "\n".join(lines) + "\n"


def with_rows(page: str, other: str) -> str:
    """The page with the rows of another, which was measured later, where they belong: columns that
    the page has, stars as they are due now. What to take is not said anew."""
    lines = page.splitlines()
    for title in TABLES:
        columns, rows = _table(lines, title)
        more_columns, more = _table(other.splitlines(), title)
        if not columns or not more_columns:
            continue
        found = [lines[i] for i in rows]
        for line in (other.splitlines()[i] for i in more):
            said = dict(zip(more_columns, _cells(line), strict=True))
            own = [said[column] for column in columns]
            same = [_key(row) for row in found]
            found = [row for row, key in zip(found, same, strict=True) if key != _key(line)]
            found.append(f"| {' | '.join(own)} |")
        first = rows[0]
        lines[first : rows[-1] + 1] = sorted(found, key=_place)
    best = {row["technique"] for row in falling(known(rows_of("\n".join(lines)), "flip"), "flip")}
    _, pictures = _table(lines, TABLES[0])
    for i in pictures:
        name, rest = lines[i].split("`")[1], lines[i].split(" | ", 1)[1]
        lines[i] = f"| `{name}`{' *' if name in best else ''} | {rest}"
    told = "\n".join(lines) + "\n"
    count = len(_table(lines, TABLES[0])[1])
    told = re.sub(r"\d+ techniques\.", f"{count} techniques.", told, count=1)
    variants = sum(one.variants for one in registry())
    return re.sub(r"\d+ variants were tried", f"{variants} variants were tried", told, count=1)


TABLES = ("## Pictures", "## Rays", "## What was aimed at")


def _cells(line: str) -> list[str]:
    return [one.strip() for one in line.strip("|").split(" | ")]


def _table(lines: Sequence[str], title: str) -> tuple[list[str], list[int]]:
    """Columns of the table under a title, and which lines are its rows."""
    if title not in lines:
        return [], []
    first = lines.index(title)
    heads = next(i for i in range(first, len(lines)) if lines[i].startswith("| technique |"))
    end = next((i for i in range(heads, len(lines)) if not lines[i].startswith("|")), len(lines))
    return _cells(lines[heads]), list(range(heads + 2, end))


def _key(line: str) -> tuple[str, str]:
    """What a row is of: a technique, and where several are of one, its measure."""
    measure = _cells(line)[1]
    return line.split("`")[1], "" if measure[0].isdigit() else measure


def _place(line: str) -> tuple[float, ...] | tuple[int, float, str]:
    name, measure = _key(line)
    if measure:
        names = [(one.technique, one.measure.replace("_", " ").lower()) for one in aims()]
        return (float(names.index((name, measure.lower()))),)
    one = moit.technique(name)
    return AFFORDED.index(one.access), one.bits_per_pixel or 0, name


def with_fewer_names(shown: ErrorChart) -> ErrorChart:
    """Of each front named are the best, and what errs less by GAIN than what is named before."""
    points: list[Point] = []
    for access in shown.groups:
        own = sorted((p for p in shown.shown if p.front == access), key=lambda p: (p.x, -p.y))
        best = min((p.y for p in own if p.on_front), default=0.0)
        named = float("inf")
        for p in own:
            worth = p.on_front and (p.y <= named * (1 - GAIN) or p.y == best)
            named = p.y if worth else named
            points.append(p if worth else dataclasses.replace(p, name=""))
    return dataclasses.replace(shown, points=points)


def picture(rows: Sequence[Row], path: Path) -> None:
    """Error over bytes: a column for each number of passes, a row for pictures and one for rays."""
    figure, axes = plt.subplots(
        len(MEASURES),
        len(PASSES),
        figsize=(16.5, 10.5),
        dpi=80,
        layout="constrained",
        sharey="row",
        sharex=True,
    )
    for row, (measure, title) in zip(axes, MEASURES.items(), strict=True):
        for ax, passes in zip(row, PASSES, strict=True):
            allowed = [one for one in known(rows, measure) if Means(passes).allow(one)]
            shown = chart(allowed, passes, measure)
            draw(with_fewer_names(shown), ax, named=())
            ax.margins(x=0.1, y=0.08)
            ax.set_title(f"up to {COUNTS[passes]}" if passes > 1 else COUNTS[1])
            ax.set(ylabel=title if passes == PASSES[0] else "", xlabel="")
            if measure == list(MEASURES)[-1]:
                ax.set_xlabel("bytes a pixel keeps")
    marks = [
        Line2D([], [], color="0.3", marker=marker_of(i), linestyle="", label=WORDS[access])
        for i, access in enumerate(AFFORDED)
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=len(marks), frameon=False)
    with replacing(path) as part:
        figure.savefig(part)


def is_plot(block: Block) -> bool:
    return isinstance(block, Plot)


def with_picture(blocks: Iterator[Block]) -> Iterator[Block]:
    """The page's blocks, with one picture in place of its charts."""
    there = False
    for block in blocks:
        if not is_plot(block):
            yield block
        elif not there:
            there = True
            yield Paragraph("![Error over bytes by passes and access](frontier.png)")
            yield Paragraph(NAMED)


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/frontier.md and docs/frontier.png.")
    parser.add_argument("--draw", default="final", choices=tuple(KINDS))
    parser.add_argument("--size", default="full", choices=tuple(SIZES))
    parser.add_argument("-o", "--output", type=Path, default=DOCS, metavar="DIR")
    parser.add_argument("--picture", action="store_true", help="alone, of the page that is there")
    parser.add_argument(
        "--rows", nargs="+", default=[], metavar="NAME", help="of these, measured now, in the page"
    )
    parser.add_argument("--gpu", action="store_true", help="times of frames alone, likewise")
    given = parser.parse_args()
    if given.gpu:
        page = (given.output / "frontier.md").read_text(encoding="utf-8")
        write_text(given.output / "frontier.md", with_gpu_times(page))
        return
    if given.rows:
        later = moit.frontier(given.rows, draw=given.draw, size=given.size, out=KEPT)
        page = (given.output / "frontier.md").read_text(encoding="utf-8")
        other = Markdown(str(given.output))(one for one in later.blocks() if not is_plot(one))
        write_text(given.output / "frontier.md", with_rows(page, other))
        return
    if given.picture:
        page = (given.output / "frontier.md").read_text(encoding="utf-8")
        picture(rows_of(page), given.output / "frontier.png")
        return
    found = moit.frontier(draw=given.draw, size=given.size, out=KEPT)
    picture(found.rows, given.output / "frontier.png")
    text = Markdown(str(given.output))(with_picture(found.blocks()))
    write_text(given.output / "frontier.md", f"{text}\n\n{TRIED.read_text(encoding='utf-8')}")


if __name__ == "__main__":
    main()
