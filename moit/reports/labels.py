"""Names beside the markers of a plot, placed where they cover neither each other nor markers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.patheffects import Stroke
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.transforms import Bbox, IdentityTransform
from numpy.typing import NDArray

from moit.reports.label_places import DISTANCES, LEADER, MARKER, NEAR, place

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

Array = NDArray[np.float64]
Label = tuple[str, tuple[float, float], bool]  # what it says, of which data, whether it is strong

FONT = 7.0  # points


class Labels(Artist):
    """The labels of an Axes. Places are found whenever it is drawn, for the size and the limits
    that it has then; earlier labels choose first, and one that finds no room is not drawn.

    unnamed : markers without a label, which none may cover.
    """

    def __init__(
        self, labels: Iterable[Label], unnamed: Iterable[tuple[float, float]] = ()
    ) -> None:
        super().__init__()
        self.labels = list(labels)
        self.unnamed = list(unnamed)
        self.set_zorder(5)
        self.set_in_layout(False)

    def draw(self, renderer: RendererBase) -> None:
        if not self.get_visible() or self.axes is None or not self.labels:
            return
        for artist in self.artists(renderer):
            if isinstance(artist, Text):
                self._rim(artist).draw(renderer)
            artist.draw(renderer)

    def artists(self, renderer: RendererBase) -> list[Line2D | Text]:
        """What stands for the labels in the Axes as they are now, in pixels."""
        assert self.axes is not None
        with np.errstate(all="ignore"):
            places = self.axes.transData.transform([at for _, at, _ in self.labels])
            others = self.axes.transData.transform(np.reshape(self.unnamed, (-1, 2)))
        box = self.axes.get_window_extent(renderer)
        found: list[Line2D | Text] = []
        point = float(np.asarray(renderer.points_to_pixels(1.0)))
        shown = [
            i
            for i, (x, y) in enumerate(places)
            if math.isfinite(x + y)
            and box.x0 - 1 <= x <= box.x1 + 1
            and box.y0 - 1 <= y <= box.y1 + 1
        ]
        texts = [self._text(self.labels[i][0], self.labels[i][2]) for i in shown]
        sizes = [painted_size(text, renderer, point) for text in texts]
        corners = place(
            np.array([places[i] for i in shown], np.float64).reshape(-1, 2) / point,
            np.array(sizes, np.float64).reshape(-1, 2) / point,
            np.array(box.extents, np.float64) / point,
            np.array([max(DISTANCES) if self.labels[i][2] else NEAR for i in shown], np.float64),
            others[np.isfinite(others).all(1)] / point,
        )
        for i, text, (width, height), corner in zip(shown, texts, sizes, corners, strict=True):
            if corner is None:
                continue
            left, bottom = corner[0] * point, corner[1] * point
            text.set_position((left, bottom))
            x, y = map(float, places[i])
            end_x = min(max(x, left), left + width)
            end_y = min(max(y, bottom), bottom + height)
            if math.hypot(end_x - x, end_y - y) > (MARKER + LEADER) * point:
                line = Line2D(
                    [x, end_x],
                    [y, end_y],
                    color="0.45",
                    linewidth=0.5,
                    transform=IdentityTransform(),
                )
                self._adopt(line)
                found.insert(0, line)
            found.append(text)
        return found

    def _text(self, words: str, strong: bool) -> Text:
        text = Text(
            0,
            0,
            words,
            fontsize=FONT,
            color="black" if strong else "0.35",
            verticalalignment="bottom",
            transform=IdentityTransform(),
        )
        self._adopt(text)
        return text

    def _rim(self, text: Text) -> Text:
        """What keeps a label legible on lines: outlines of its own, since matplotlib draws a text
        that has effects as outlines, which in files nobody can search or edit."""
        rim = self._text(text.get_text(), True)
        rim.set_position(text.get_position())
        rim.set_path_effects([Stroke(linewidth=1.8, foreground="white")])
        return rim

    def _adopt(self, artist: Artist) -> None:
        figure = self.get_figure()
        if figure is not None:
            artist.set_figure(figure)

    def get_window_extent(self, renderer: RendererBase | None = None) -> Bbox:
        return Bbox.null()


def painted_size(text: Text, renderer: RendererBase, point: float) -> tuple[float, float]:
    """Width and height in pixels; path effects draw outlines, whose letters are not moved to
    whole pixels and can be wider than those that matplotlib measures."""
    box = text.get_window_extent(renderer)
    outline = TextPath((0, 0), text.get_text(), size=FONT, prop=text.get_fontproperties())
    return max(box.width, outline.get_extents().x1 * point), box.height
