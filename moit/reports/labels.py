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

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

Array = NDArray[np.float64]
Label = tuple[str, tuple[float, float], bool]  # what it says, of which data, whether it is strong

FONT = 7.0  # points
MARKER = 3.6  # half a marker's side
GAP = 1.5  # between two labels
LEADER = 5.0  # farther away than this a label gets a line to its marker
DISTANCES = (0.0, 3.0, 7.0, 12.0, 18.0, 25.0, 34.0, 45.0, 58.0, 74.0)  # in points
NEAR = 26.0  # what is not strong is no farther away
DIRECTIONS = 16
CROSSING = 30.0  # points of distance that are as bad as a leader across another thing


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


def place(
    points: Array, sizes: Array, box: Array, farthest: Array, others: Array | None = None
) -> list[tuple[float, float] | None]:
    """(x, y) of the lower left corner of each label; None where it has no room.

    points : (N, 2) what is labelled. sizes : (N, 2) width and height of the labels.
    box : (x0, y0, x1, y1) within which labels have to be.
    farthest : (N,) how far from its marker a label may be.
    others : (M, 2) markers without a label. All in points.

    Each takes the place that is nearest to its marker, right of it rather than left, among those
    that are free of markers and of earlier labels.
    """
    turns = 2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    u = np.stack([np.cos(turns), np.sin(turns)], 1)
    away = np.repeat(DISTANCES, DIRECTIONS)
    u = np.tile(u, (len(DISTANCES), 1))
    toward = np.clip(1.6 * u, -1, 1)  # which side or corner of the label is next to the marker
    preference = away + 1.5 * (1 - u[:, 0]) + 0.5 * (1 - u[:, 1])
    marked = points if others is None else np.concatenate([points, others])
    markers = np.concatenate([marked - MARKER, marked + MARKER], 1)
    taken = np.empty((0, 4))
    lines = np.empty((0, 4))
    found: list[tuple[float, float] | None] = []
    for i, (point, size) in enumerate(zip(points, sizes, strict=True)):
        middle = point + (MARKER + 1 + away)[:, None] * u + toward * size / 2
        rooms = np.concatenate([middle - size / 2, middle + size / 2], 1)
        inside = (rooms[:, :2] >= box[:2]).all(1) & (rooms[:, 2:] <= box[2:]).all(1)
        inside &= away <= farthest[i]
        grown = rooms + GAP * np.array([-1, -1, 1, 1]) / 2
        free = inside & ~_overlap(grown, markers).any(1) & ~_overlap(grown, taken).any(1)
        if not free.any():
            found.append(None)
            continue
        rooms, cost = rooms[free], preference[free]
        ends = np.clip(point, rooms[:, :2], rooms[:, 2:])
        own = np.concatenate([np.broadcast_to(point, ends.shape), ends], 1)
        things = np.concatenate([np.delete(markers, i, 0), taken])
        crossed = _touch(own, things).sum(1) + _cross(own, lines).sum(1)
        crossed = crossed + _touch(lines, rooms).sum(0)
        best = int(np.argmin(cost + CROSSING * crossed))
        found.append((float(rooms[best, 0]), float(rooms[best, 1])))
        taken = np.concatenate([taken, rooms[best : best + 1]])
        lines = np.concatenate([lines, own[best : best + 1]])
    return found


def _overlap(a: Array, b: Array) -> NDArray[np.bool_]:
    """(A, B) which boxes overlap which."""
    apart = (a[:, None, :2] >= b[None, :, 2:]) | (a[:, None, 2:] <= b[None, :, :2])
    return np.asarray(~apart.any(2))


def _touch(lines: Array, boxes: Array) -> NDArray[np.bool_]:
    """(L, B) which lines (x0, y0, x1, y1) go through which boxes."""
    start, along = lines[:, None, :2], lines[:, None, 2:] - lines[:, None, :2]
    along = np.where(np.abs(along) < 1e-9, 1e-9, along)
    one, other = (boxes[None, :, :2] - start) / along, (boxes[None, :, 2:] - start) / along
    enter, leave = np.minimum(one, other).max(2), np.maximum(one, other).min(2)
    return np.asarray(np.maximum(enter, 0) < np.minimum(leave, 1))


def _cross(a: Array, b: Array) -> NDArray[np.bool_]:
    """(A, B) which lines cross which."""

    def side(line: Array, x: Array, y: Array) -> Array:
        return (line[..., 2] - line[..., 0]) * (y - line[..., 1]) - (
            line[..., 3] - line[..., 1]
        ) * (x - line[..., 0])

    p, q = a[:, None], b[None]
    apart = side(p, q[..., 0], q[..., 1]) * side(p, q[..., 2], q[..., 3]) < 0
    apart &= side(q, p[..., 0], p[..., 1]) * side(q, p[..., 2], p[..., 3]) < 0
    return np.asarray(apart)
