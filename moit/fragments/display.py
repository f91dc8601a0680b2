"""How a notebook shows Fragments: one line, a thumbnail and a histogram of counts."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from moit.fragments.fragments import Fragments

# Of the thumbnail, in pixels: noise, which nothing compresses, takes 90 kB as text.
LONGEST_SIDE = 150
MOST_BARS = 40
PLOT = (260, 96)  # of the histogram's bars, in pixels


def fragments_html(f: Fragments) -> str:
    """What `f` is, how it looks over black (uncoloured: how much light it lets through), and how
    many pixels have how many fragments; some ten kilobytes."""
    parts = [f"<p><code>{html.escape(repr(f))}</code></p>"]
    if f.shape[0] and f.shape[1]:
        parts.append(_thumbnail(f))
        parts.append(_histogram(f.counts))
    return f"<div>{''.join(parts)}</div>"


def _thumbnail(f: Fragments) -> str:
    from moit.questions import composite, total_transmittance
    from moit.reports.pictures import data_uri, png, shrunk, srgb8

    if f.color is not None:
        image, title = composite(f, "sorted")[..., :3], "exact composite over black"
    else:
        image, title = total_transmittance(f, "sorted"), "total transmittance"
        if image.ndim == 2:
            image = np.repeat(image[..., None], 3, axis=2)
    scale = min(1.0, LONGEST_SIDE / max(f.shape))
    height, width = (max(1, round(side * scale)) for side in f.shape)
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
