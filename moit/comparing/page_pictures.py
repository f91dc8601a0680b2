"""Pictures of a scene as the page shows them: encoded once, each with its map of errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from moit.comparing.answer import METRIC_WORDS, has, nearness, told_value
from moit.comparing.error_maps import error_maps, map_range, scale
from moit.comparing.rows import Array, Findings, Result, Row, Scene
from moit.reports.blocks import WIDEST
from moit.reports.pictures import data_uri, image_png, map_png

AT_LEAST = 6  # pictures whose maps are within their scale
MOST_PIXELS = 24e6  # of all images together: about as many bytes


@dataclass(frozen=True)
class Shown:
    """A technique's picture: its addresses hold the files."""

    result: Result
    key: str  # marks it for the page's script
    image: str
    error: str
    errors: Array  # the map

    @property
    def name(self) -> str:
        """With its device, where that is not the usual one."""
        return labelled(self.result.row)


@dataclass(frozen=True)
class Pictures:
    """Those of a scene, nearest first, the reference's own technique last."""

    scene: Scene
    reference: str
    shown: list[Shown]
    what: str  # is in their maps
    scale: str


def labelled(row: Row) -> str:
    """A technique's name, with its device where that is not the usual one."""
    return str(row["technique"]) + ("" if row["device"] == "cpu" else f", {row['device']}")


def pictures(found: Findings, name: str, keys: dict[int, str], width: int) -> Pictures | None:
    """None where there are none. keys : of rows. width : of the widest."""
    scene = found.scenes.get(name)
    results = [r for r in found.of_scene(name) if r.image is not None and r.image.size]
    if scene is None or scene.reference is None or not scene.reference.size or not results:
        return None
    maps, what = error_maps(scene.reference, results)
    metric = found.main_metric()
    order = sorted(
        range(len(results)),
        key=lambda i: (
            results[i].row["technique"] == found.reference,
            nearness(results[i].row, metric),
        ),
    )
    # The nearest half says the scale: beside the worst technique all good ones would be black.
    half = order[: max(AT_LEAST, (len(order) + 1) // 2)]
    most = map_range([maps[i] for i in half])
    shown = [
        Shown(
            results[i],
            keys[id(results[i].row)],
            _image(results[i].image, width),
            data_uri(map_png(maps[i] / most, width)),
            maps[i],
        )
        for i in order
    ]
    return Pictures(scene, _image(scene.reference, width), shown, what, scale(most, what, maps))


def _image(image: Array | None, width: int) -> str:
    assert image is not None
    return data_uri(image_png(image, width))


def told_numbers(row: Row, metric: str) -> str:
    """What stands below a picture: its memory and its error."""
    bits = row.get("bits_per_pixel")
    parts = ["memory grows" if bits is None else f"{bits:g} bits"]
    if has(row, metric):
        parts.append(f"{METRIC_WORDS.get(metric, metric)} {told_value(metric, row[metric])}")
    return " · ".join(parts)


def picture_width(found: Findings) -> int:
    """So wide that all images of the page stay below MOST_PIXELS."""
    total = 0.0
    for scene in found.scenes.values():
        height, width = scene.shape
        used = min(width, WIDEST)
        count = 1 + 2 * len(found.of_scene(scene.name))
        total += count * used * used * height / max(width, 1)
    return max(96, round(WIDEST * min(1.0, math.sqrt(MOST_PIXELS / max(total, 1.0)))))
