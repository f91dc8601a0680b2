"""Pictures that a notebook shows and that a file keeps: one, or several side by side."""

from __future__ import annotations

import dataclasses
import math
import os
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import path_name
from moit.reports.pictures import data_uri, from_srgb, png, shrunk, size_within, srgb8
from moit.reports.svg import standalone
from moit.system.files import write_bytes, write_text

Bytes = NDArray[np.uint8]

ENDINGS = (".png", ".svg")
WIDEST = 960  # pixels of all that stands side by side in a notebook
GAP = 10  # pixels between pictures
LINE = 20  # pixels of a line of titles in SVG
LEAST_CAPTION = 100  # pixels that the lines of a title have at least, in HTML
LETTER = 7.2  # pixels of a title's letter there, at most
# Of a picture that is shrunk: larger ones are thinned first, so that none takes more than a moment.
MOST_PIXELS = 4_000_000
# Linear values of the 256 bytes, to shrink what is encoded.
DECODED = from_srgb(np.arange(256) / 255).astype(np.float32)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ShownImage:
    """What `moit.show` makes: in Jupyter a picture, elsewhere an object that writes one.

    pixels : one (height, width, 3) array of sRGB bytes for each picture, at full size.
    titles : a text for each; "" for none.
    scales : as how many pixels a side each pixel of a picture is shown.
    columns : how many stand side by side.
    lost : in how many pixels of each a number was not finite; they are magenta.

    A notebook gets at most 960 pixels' width, to which large pictures are shrunk; files are whole.

    >>> shown = moit.show(np.full((2, 3, 3), 0.5))
    >>> shown.pixels[0].shape, shown.pixels[0].max()
    ((2, 3, 3), np.uint8(188))
    """

    pixels: tuple[Bytes, ...]
    titles: tuple[str, ...]
    scales: tuple[int, ...]
    columns: int
    lost: tuple[int, ...]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes all pictures side by side to a .png, or to an .svg, which has their titles too.

        The file appears whole or not at all. Raises ValueError for another ending, OSError where
        it cannot be written.
        """
        name = path_name(path)
        ending = os.path.splitext(name)[1].lower()
        if ending not in ENDINGS:
            raise ValueError(f"path: expected a name that ends in .png or .svg, got {name!r:.200}")
        if ending == ".svg":
            write_text(name, self._svg())
        else:
            write_bytes(name, png(self._sheet()))

    def __repr__(self) -> str:
        told = []
        for pixels, title, lost in zip(self.pixels, self.titles, self.lost, strict=True):
            height, width = pixels.shape[:2]
            words = [title, f"{width}x{height}"] if title else [f"{width}x{height}"]
            told.append(" ".join(words) + (f" ({_lost(lost)})" if lost else ""))
        return f"<{', '.join(told)}: a picture in Jupyter; .save('NAME.png') writes it>"

    def _repr_png_(self) -> bytes | None:
        """Of a single picture without anything to be said of it."""
        return png(self._small(0, WIDEST)) if self._speechless else None

    def _repr_html_(self) -> str | None:
        return None if self._speechless else self.html()

    @property
    def _speechless(self) -> bool:
        return len(self.pixels) == 1 and not (self.titles[0] or self.lost[0])

    def html(self) -> str:
        """The pictures side by side with their titles, as notebooks show them."""
        room = (WIDEST - GAP * (self.columns - 1)) // self.columns
        figures = []
        for i, (title, lost) in enumerate(zip(self.titles, self.lost, strict=True)):
            picture = self._small(i, room)
            said = escape(title) + (f"<br>{_lost(lost)}" if lost else "")
            height, width = picture.shape[:2]
            # As wide as the picture, in as many lines as that takes.
            style = f"max-width: {max(width, LEAST_CAPTION)}px; margin: auto; font-size: 90%"
            caption = f'<figcaption style="{style}">{said}</figcaption>' if said else ""
            source = data_uri(png(picture))
            figures.append(
                f'<figure style="margin: 0; text-align: center">{caption}<img src="{source}" '
                f'width="{width}" height="{height}" alt="{escape(title, quote=True)}" '
                'style="image-rendering: pixelated; max-width: 100%; height: auto"></figure>'
            )
        tracks = f"repeat({self.columns}, max-content)"
        return (
            f'<div style="display: grid; grid-template-columns: {tracks}; gap: {GAP}px; '
            f'align-items: end">{"".join(figures)}</div>'
        )

    def _large(self, i: int) -> Bytes:
        """With every pixel as large as it is shown."""
        scale = self.scales[i]
        return self.pixels[i].repeat(scale, axis=0).repeat(scale, axis=1)

    def _small(self, i: int, width: int) -> Bytes:
        """At most that wide: fewer times as large, or shrunk."""
        pixels = self.pixels[i]
        scale = max(1, min(self.scales[i], width // pixels.shape[1]))
        if scale > 1 or pixels.shape[1] <= width:
            return pixels.repeat(scale, axis=0).repeat(scale, axis=1)
        few = thinned(pixels)
        return srgb8(shrunk(DECODED[few], *size_within((few.shape[0], few.shape[1]), width)))

    def _rows(self) -> list[range]:
        count = len(self.pixels)
        starts = range(0, count, self.columns)
        return [range(start, min(start + self.columns, count)) for start in starts]

    def _sheet(self) -> Bytes:
        """All pictures on white."""
        lines = [[self._large(i) for i in row] for row in self._rows()]
        width = max(sum(one.shape[1] + GAP for one in line) for line in lines) - GAP
        height = sum(max(one.shape[0] for one in line) + GAP for line in lines) - GAP
        sheet = np.full((height, width, 3), 255, np.uint8)
        top = 0
        for line in lines:
            left = 0
            for one in line:
                sheet[top : top + one.shape[0], left : left + one.shape[1]] = one
                left += one.shape[1] + GAP
            top += max(one.shape[0] for one in line) + GAP
        return sheet

    def _svg(self) -> str:
        parts = []
        top, right = 0.0, 0.0
        head = LINE if any(self.titles) else 0
        for row in self._rows():
            left, tallest = 0.0, 0
            for i in row:
                height, width = (side * self.scales[i] for side in self.pixels[i].shape[:2])
                title = escape(self.titles[i])
                room = max(width, math.ceil(LETTER * len(self.titles[i])))
                if title:
                    parts.append(f'<text x="{left:g}" y="{top + LINE - 6:g}">{title}</text>')
                parts.append(
                    f'<image x="{left:g}" y="{top + head:g}" width="{width}" height="{height}" '
                    f'style="image-rendering: pixelated" href="{data_uri(png(self.pixels[i]))}"/>'
                )
                left += room + GAP
                tallest = max(tallest, height)
            top, right = top + head + tallest + GAP, max(right, left - GAP)
        size = f'width="{right:g}" height="{top - GAP:g}" viewBox="0 0 {right:g} {top - GAP:g}"'
        return standalone(
            f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="system-ui,sans-serif" '
            f'font-size="13" fill="currentColor">{"".join(parts)}</svg>'
        )


def _lost(count: int) -> str:
    return f"{count:,} {'pixel' if count == 1 else 'pixels'} not finite, in magenta"


def thinned(image: NDArray[Any]) -> NDArray[Any]:
    """Every n-th pixel of an image with too many to look at each in a moment; else the image."""
    step = math.ceil(math.sqrt(image.shape[0] * image.shape[1] / MOST_PIXELS))
    return image[::step, ::step] if step > 1 else image
