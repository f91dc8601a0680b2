"""How a notebook shows Fragments: one line, a thumbnail and a histogram of counts."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# Of the thumbnail, in pixels: noise, which nothing compresses, takes 90 kB as text.
LONGEST_SIDE = 150
MOST_BARS = 40
PLOT = (260, 96)  # of the histogram's bars, in pixels


class Shown(Protocol):
    """What is shown of fragments."""

    @property
    def counts(self) -> NDArray[np.int64]: ...


def fragments_html(f: Shown, picture: NDArray[Any] | None, title: str) -> str:
    """What `f` is, a small picture of it, and how many pixels have how many fragments; some ten
    kilobytes.

    picture : (height, width, 3) linear, None for none; title : what it shows.
    """
    from html import escape  # late: `import moit` stays quick

    parts = [f"<p><code>{escape(repr(f))}</code></p>"]
    if len(f.counts):
        if picture is not None:
            parts.append(_thumbnail(picture, title))
        parts.append(_histogram(f.counts))
    return f"<div>{''.join(parts)}</div>"


def _thumbnail(image: NDArray[Any], title: str) -> str:
    from moit.reports.pictures import data_uri, png, shrunk, srgb8

    scale = min(1.0, LONGEST_SIDE / max(image.shape[:2]))
    height, width = (max(1, round(side * scale)) for side in image.shape[:2])
    # Clipped first: one very bright fragment must not hide its neighbours.
    small = srgb8(shrunk(np.clip(image, 0.0, 1.0), height, width))
    return (
        f'<img src="{data_uri(png(small))}" width="{width}" height="{max(height, 8)}" '
        f'alt="{title}" title="{title}" style="image-rendering: pixelated; margin-right: 1em">'
    )


def _histogram(counts: NDArray[Any]) -> str:
    most = int(counts.max())
    step = -(-(most + 1) // MOST_BARS)
    bars = np.bincount(counts // step, minlength=most // step + 1)
    width, height = PLOT
    wide = width / len(bars)
    shapes = []
    for i, pixels in enumerate(bars):
        first, last = i * step, min((i + 1) * step - 1, most)
        said = f"{first}" if first == last else f"{first} to {last}"
        tall = height * int(pixels) / int(bars.max())
        shapes.append(
            f'<rect x="{i * wide:.2f}" y="{height - tall:.2f}" width="{wide * 0.9:.2f}" '
            f'height="{tall:.2f}"><title>{said} fragments: {int(pixels):,} pixels</title></rect>'
        )
    text = 'fill="currentColor" font-size="11" font-family="sans-serif"'
    return (
        f'<svg width="{width}" height="{height + 20}" role="img" fill="#4878a8">'
        f"<title>pixels by their number of fragments</title>{''.join(shapes)}"
        f'<text x="0" y="{height + 14}" {text}>0</text>'
        f'<text x="{width / 2}" y="{height + 14}" text-anchor="middle" {text}>fragments a pixel'
        f'</text><text x="{width}" y="{height + 14}" text-anchor="end" {text}>{most:,}</text></svg>'
    )
