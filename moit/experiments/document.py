"""A result as a document: one list of blocks, written as text, as Markdown and as HTML."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

from moit.experiments.description import Array, Chart, Picture, Section
from moit.experiments.result import ExperimentResult
from moit.reports.charts import standalone
from moit.reports.page import html_page
from moit.reports.pictures import data_uri, image_jpeg, image_png, map_png
from moit.reports.tables import UNITS, aligned, number
from moit.system.files import write_bytes, write_text

WORDS = frozenset({"scene", "technique", "note", "claim", "where", "verdict", "numbers"})
HEADINGS = {
    "T_mae": "T mae",
    "T_p99": "T 99 %",
    "T_max": "T max",
    "T_rmse": "T rmse",
    "bits_per_texel": "bits",
    "curve_mean": "curve, mean",
    "curve_max": "curve, max",
    "light": "signed",
    "first_ms": "pass 1 ms",
    "second_ms": "pass 2 ms",
    "diff_ms": "diff ms",
}
MEMORY = ("bits", "bytes")  # hangs on no machine
WIDEST = 640  # pixels of a picture in a page
IN_NOTEBOOK = 160


@dataclass(frozen=True)
class Heading:
    level: int
    text: str


@dataclass(frozen=True)
class Paragraph:
    text: str


@dataclass(frozen=True)
class Grid:
    """A table. words : which columns are texts. groups : a line is drawn where it changes."""

    heads: list[str]
    cells: list[list[str]]
    words: list[bool]
    groups: list[object]


@dataclass(frozen=True)
class Gallery:
    pictures: Sequence[Picture]


Block = Heading | Paragraph | Grid | Gallery | Chart


def blocks(result: ExperimentResult) -> Iterator[Block]:
    """What a result says, in order."""
    described = result.experiment
    yield Heading(1, f"{described.paper}, {described.figure}: {described.title}")
    yield Paragraph(described.about)
    yield Paragraph(_measured(result))
    if result.claims:
        yield Heading(2, "What the paper says of it")
        yield claims_grid(result)
    for section in result.sections:
        yield Heading(2, section.title)
        yield from section_blocks(section)


def section_blocks(section: Section) -> Iterator[Block]:
    """What a section shows below its title."""
    if section.text:
        yield Paragraph(section.text)
    yield from section.charts
    for row in section.gallery:
        yield Gallery(row)
    if section.rows:
        yield _table(section)


def _measured(result: ExperimentResult) -> str:
    device = "" if result.device == "cpu" else f", {result.device}"
    return (
        f"moit experiment {result.experiment.name} --size {result.size}{device}; "
        f"{result.seconds:.0f} s on {result.machine}."
    )


def claims_grid(result: ExperimentResult) -> Grid:
    """The claims with verdicts."""
    cells = [[one.claim.text, one.claim.where, one.verdict, one.numbers] for one in result.claims]
    heads = ["claim", "where", "verdict", "numbers"]
    return Grid(heads, cells, [True] * 4, [0] * len(cells))


def _table(section: Section) -> Grid:
    columns = [
        column
        for column in section.columns
        if any(row.get(column) is not None for row in section.rows)
    ]
    if len({row.get("scene") for row in section.rows}) == 1 and "scene" in columns:
        columns.remove("scene")
    notes = any(row.get("note") for row in section.rows)
    columns += ["note"] if notes and "note" not in columns else []
    return Grid(
        [heading(section, column) for column in columns],
        [[shown(column, row.get(column)) for column in columns] for row in section.rows],
        [column in WORDS for column in columns],
        [(row.get("scene"), row.get("setting")) for row in section.rows],
    )


def heading(section: Section, column: str) -> str:
    """A column's name; of published ones with the machine."""
    if column.startswith("paper_"):
        own = heading(section, column.removeprefix("paper_"))
        machine = "" if section.published is None else section.published.machine
        return f"{own}, paper ({machine})" if machine and own not in MEMORY else f"{own}, paper"
    if column in UNITS:
        return UNITS[column][0]
    return HEADINGS.get(column, column)


def shown(column: str, value: object) -> str:
    """A field with three digits; "-" for None."""
    if value is None:
        return "-"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if column in UNITS:
        value = value * UNITS[column][1]
    if isinstance(value, int) or column == "setting" or not math.isfinite(value) or value == 0:
        return f"{value:g}"
    if column.removeprefix("paper_") in ("bits_per_pixel", "bits_per_texel", "bytes"):
        return f"{value:g}"
    return number(float(f"{value:.2e}")) if abs(value) < 1e-3 else f"{value:.3g}"


# As text


def text(result: ExperimentResult) -> str:
    """Tables and claims, aligned."""
    lines = []
    for block in blocks(result):
        if isinstance(block, Heading):
            lines += ["", block.text, ("=" if block.level == 1 else "-") * len(block.text)]
        elif isinstance(block, Paragraph):
            lines += [block.text]
        elif isinstance(block, Grid) and block.heads[0] != "claim":
            lines += ["", aligned(block.heads, block.cells, block.words, block.groups)]
        elif isinstance(block, Grid):
            for claim, where, verdict, numbers in block.cells:
                lines += [f"{verdict:<13}  {claim} ({where})", f"{'':15}{numbers}"]
    return "\n".join(lines).strip("\n")


# As Markdown


def markdown(result: ExperimentResult, folder: str, width: int, below: str = "") -> str:
    """The text, its pictures and charts written to `folder`, named relative to `below`."""
    parts = []
    for block in blocks(result):
        if isinstance(block, Heading):
            parts.append(f"{'#' * block.level} {block.text}")
        elif isinstance(block, Paragraph):
            parts.append(block.text)
        elif isinstance(block, Grid):
            parts.append(markdown_table(block))
        elif isinstance(block, Gallery):
            parts.append(markdown_gallery(block.pictures, folder, width, below))
        else:
            parts.append(markdown_chart(block, folder, below))
    return "\n\n".join(parts) + "\n"


def markdown_table(grid: Grid) -> str:
    def line(texts: Sequence[str]) -> str:
        return f"| {' | '.join(text.replace('|', chr(92) + '|') for text in texts)} |"

    rule = [":--" if word else "--:" for word in grid.words]
    return "\n".join([line(grid.heads), line(rule), *map(line, grid.cells)])


def markdown_gallery(
    pictures: Sequence[Picture],
    folder: str,
    width: int,
    below: str,
    most: int = 4,
    ending: str = "png",
) -> str:
    """Pictures in tables of at most that many columns; those of colour may end in "jpg"."""
    encoded = picture_png if ending == "png" else picture_jpeg
    os.makedirs(folder, exist_ok=True)
    tables = []
    for begin in range(0, len(pictures), most):
        group = pictures[begin : begin + most]
        images = []
        for one in group:
            name = f"{link_name(one.name)}.{ending}"
            write_bytes(os.path.join(folder, name), encoded(one.image, width))
            images.append(f"![{one.caption}]({below}{name})")
        captions = [one.caption.replace("|", " ") for one in group]
        tables.append(
            f"| {' | '.join(captions)} |\n|{'---|' * len(group)}\n| {' | '.join(images)} |"
        )
    return "\n\n".join(tables)


def markdown_chart(chart: Chart, folder: str, below: str) -> str:
    name = f"{link_name(chart.name)}.svg"
    os.makedirs(folder, exist_ok=True)
    write_text(os.path.join(folder, name), standalone(chart.svg))
    return f"{chart.caption}\n\n![{chart.caption}]({below}{name})"


def link_name(text: str) -> str:
    """A file's name that Markdown takes in a link as it stands."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", text).strip("-")


def picture_png(image: Array, width: int) -> bytes:
    return map_png(image, width) if image.ndim == 2 else image_png(image, width)


def picture_jpeg(image: Array, width: int) -> bytes:
    """Where bytes count: a picture as JPEG, a map as PNG."""
    return map_png(image, width) if image.ndim == 2 else image_jpeg(image, width)


# As HTML


def page(result: ExperimentResult) -> str:
    """One page that needs no other file."""
    parts, links = [], {}
    title = ""
    for i, block in enumerate(blocks(result)):
        if isinstance(block, Heading) and block.level == 1:
            title = block.text
        elif isinstance(block, Heading):
            links[f"part{i}"] = block.text
            parts.append(f'<h2 id="part{i}">{escape(block.text)}</h2>')
        else:
            parts.append(html(block, WIDEST))
    return html_page(title, result.experiment.name, links, "\n".join(parts))


def fragment(result: ExperimentResult) -> str:
    """The same for a notebook: small pictures, and no maps of errors."""
    return _small(blocks(result))


def section_fragment(section: Section) -> str:
    """A section for a notebook."""
    return _small(section_blocks(section))


def _small(shown: Iterable[Block]) -> str:
    parts = []
    for block in shown:
        if isinstance(block, Heading):
            parts.append(f"<h{block.level + 2}>{escape(block.text)}</h{block.level + 2}>")
        elif isinstance(block, Gallery):
            pictures = [one for one in block.pictures if one.image.ndim == 3]
            parts.append(_html_gallery(pictures, IN_NOTEBOOK, picture_jpeg))
        else:
            parts.append(html(block, IN_NOTEBOOK))
    return f"<div>{''.join(parts)}</div>"


def html(block: Block, width: int) -> str:
    """One block; pictures of at most that width."""
    if isinstance(block, Paragraph):
        return f"<p>{escape(block.text)}</p>"
    if isinstance(block, Grid):
        return _html_table(block)
    if isinstance(block, Gallery):
        return _html_gallery(block.pictures, width)
    if isinstance(block, Chart):
        return f'<h3>{escape(block.caption)}</h3><div class="plots">{block.svg}</div>'
    return f"<h{block.level}>{escape(block.text)}</h{block.level}>"


def _html_table(grid: Grid) -> str:
    def cell(tag: str, word: bool, text: str) -> str:
        side = "left" if word else "right"
        return f'<{tag} style="text-align:{side}">{escape(text)}</{tag}>'

    def line(tag: str, texts: Sequence[str]) -> str:
        return "".join(cell(tag, word, one) for word, one in zip(grid.words, texts, strict=True))

    body = []
    for i, texts in enumerate(grid.cells):
        first = i and grid.groups[i] != grid.groups[i - 1]
        body.append(f"<tr{' class=first' if first else ''}>{line('td', texts)}</tr>")
    return (
        f'<div class="wide"><table><thead><tr>{line("th", grid.heads)}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )


def _html_gallery(
    pictures: Sequence[Picture],
    width: int,
    encoded: Callable[[Array, int], bytes] = picture_png,
) -> str:
    cells = []
    for one in pictures:
        source = data_uri(encoded(one.image, width))
        shown = min(width, 320)
        cells.append(
            f'<figure style="margin:0 8px 8px 0;display:inline-block;width:{shown}px">'
            f'<img src="{source}" alt="{escape(one.caption)}" style="width:100%">'
            f'<figcaption class="faint">{escape(one.caption)}</figcaption></figure>'
        )
    return f"<div>{''.join(cells)}</div>"


# As files


def write(result: ExperimentResult, folder: str) -> list[str]:
    """NAME.md with its pictures and charts in `pictures`, NAME.csv and NAME.html."""
    os.makedirs(folder, exist_ok=True)
    stem = os.path.join(folder, result.experiment.name)
    result.to_csv(f"{stem}.csv")
    write_text(f"{stem}.html", page(result))
    pictures = os.path.join(folder, "pictures")
    write_text(f"{stem}.md", markdown(result, pictures, WIDEST, "pictures/"))
    return [f"{stem}.md", f"{stem}.csv", f"{stem}.html"]
