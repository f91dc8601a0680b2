"""What reports are made of, and its writers: text for a terminal, Markdown, HTML."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from moit.reports.charts import Chart
from moit.reports.page import html_page
from moit.reports.pictures import Array, data_uri, image_jpeg, image_png, map_png
from moit.reports.svg import standalone, svg
from moit.reports.tables import Table, html_table, markdown_table, text_table
from moit.system.files import write_bytes, write_text

WIDEST = 640  # pixels of a picture in a page
IN_NOTEBOOK = 160
A_LINE = 4  # pictures side by side in Markdown


@dataclass(frozen=True)
class Heading:
    level: int
    text: str


@dataclass(frozen=True)
class Paragraph:
    text: str


@dataclass(frozen=True)
class Picture:
    """A linear (H, W, 3) image, or an (H, W) map of errors in [0, 1]."""

    name: str
    caption: str
    image: Array

    def encoded(self, width: int, as_jpeg: bool = False) -> bytes:
        """A PNG of at most that width; as JPEG, where bytes count, images but no maps."""
        if self.image.ndim == 2:
            return map_png(self.image, width)
        return image_jpeg(self.image, width) if as_jpeg else image_png(self.image, width)


@dataclass(frozen=True)
class Gallery:
    """Pictures side by side."""

    pictures: Sequence[Picture]


@dataclass(frozen=True)
class Plot:
    """A chart with its caption; `name` is its file's."""

    name: str
    caption: str
    chart: Chart
    size: tuple[int, int]

    @property
    def svg(self) -> str:
        return svg(self.chart, self.size, legend=True)


Block = Heading | Paragraph | Table | Gallery | Plot


def text(blocks: Iterable[Block]) -> str:
    """Headings, paragraphs and tables: a terminal has no pictures."""
    lines = []
    for block in blocks:
        if isinstance(block, Heading):
            lines += ["", block.text, ("=" if block.level == 1 else "-") * len(block.text)]
        elif isinstance(block, Paragraph):
            lines += [block.text]
        elif isinstance(block, Table):
            lines += [*([] if block.listed else [""]), text_table(block)]
    return "\n".join(lines).strip("\n")


@dataclass(frozen=True)
class Markdown:
    """Writes blocks as Markdown, their pictures and charts to a folder.

    below : the folder as the text names it. width : of pictures, at most.
    ending : of pictures, "png" or "jpg"; maps of errors are PNG in either.
    """

    folder: str
    below: str = ""
    width: int = WIDEST
    ending: str = "png"

    def __call__(self, blocks: Iterable[Block]) -> str:
        return "\n\n".join(map(self.block, blocks))

    def block(self, block: Block) -> str:
        if isinstance(block, Heading):
            return f"{'#' * block.level} {block.text}"
        if isinstance(block, Paragraph):
            return block.text
        if isinstance(block, Table):
            return markdown_table(block)
        os.makedirs(self.folder, exist_ok=True)
        if isinstance(block, Gallery):
            return self._gallery(block.pictures)
        name = f"{link_name(block.name)}.svg"
        write_text(os.path.join(self.folder, name), standalone(block.svg))
        return f"{block.caption}\n\n![{block.caption}]({self.below}{name})"

    def _gallery(self, pictures: Sequence[Picture]) -> str:
        tables = []
        for begin in range(0, len(pictures), A_LINE):
            group = pictures[begin : begin + A_LINE]
            images = []
            for one in group:
                name = f"{link_name(one.name)}.{self.ending}"
                content = one.encoded(self.width, self.ending == "jpg")
                write_bytes(os.path.join(self.folder, name), content)
                images.append(f"![{one.caption}]({self.below}{name})")
            captions = [one.caption.replace("|", " ") for one in group]
            lines = [f"| {' | '.join(captions)} |", f"|{'---|' * len(group)}"]
            tables.append("\n".join([*lines, f"| {' | '.join(images)} |"]))
        return "\n\n".join(tables)


def link_name(text: str) -> str:
    """A file's name that Markdown takes in a link as it stands."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", text).strip("-")


def page(about: str, blocks: Iterable[Block]) -> str:
    """One page that needs no other file; the heading of level 1 is its title."""
    parts, links = [], {}
    title = ""
    for i, block in enumerate(blocks):
        if isinstance(block, Heading) and block.level == 1:
            title = block.text
        elif isinstance(block, Heading):
            links[f"part{i}"] = block.text
            parts.append(f'<h2 id="part{i}">{escape(block.text)}</h2>')
        else:
            parts.append(html(block, WIDEST))
    return html_page(title, about, links, "\n".join(parts))


def fragment(blocks: Iterable[Block]) -> str:
    """The same for a notebook: small pictures, and no maps of errors."""
    parts = []
    for block in blocks:
        if isinstance(block, Heading):
            parts.append(f"<h{block.level + 2}>{escape(block.text)}</h{block.level + 2}>")
        elif isinstance(block, Gallery):
            pictures = [one for one in block.pictures if one.image.ndim == 3]
            parts.append(html(Gallery(pictures), IN_NOTEBOOK, as_jpeg=True))
        else:
            parts.append(html(block, IN_NOTEBOOK))
    return f"<div>{''.join(parts)}</div>"


def html(block: Block, width: int, as_jpeg: bool = False) -> str:
    """One block; pictures of at most that width."""
    if isinstance(block, Paragraph):
        return f"<p>{escape(block.text)}</p>"
    if isinstance(block, Table):
        return f'<div class="wide">{html_table(block)}</div>'
    if isinstance(block, Plot):
        return f'<h3>{escape(block.caption)}</h3><div class="plots">{block.svg}</div>'
    if isinstance(block, Heading):
        return f"<h{block.level}>{escape(block.text)}</h{block.level}>"
    # A page has room for four side by side; a notebook shows them as small as they are.
    wide = width == WIDEST
    size = "" if wide else f"display:inline-block;width:{width}px;"
    cells = []
    for one in block.pictures:
        source = data_uri(one.encoded(width, as_jpeg))
        cells.append(
            f'<figure style="{size}margin:0 8px 8px 0">'
            f'<img src="{source}" alt="{escape(one.caption)}" style="width:100%">'
            f'<figcaption class="faint">{escape(one.caption)}</figcaption></figure>'
        )
    kind = ' class="pictures"' if wide else ""
    return f"<div{kind}>{''.join(cells)}</div>"
