"""Figures of transmittance along a ray."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from moit.catalog import Technique, listed
from moit.checks.arguments import truth, whole
from moit.comparing.charts import curves_chart
from moit.comparing.measurement import curve, curve_depths
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.plot.arguments import checked_axes, checked_pixel
from moit.plot.legends import place_legend
from moit.plot.style import checked_style, new_axes, settings
from moit.reports.figures import draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:  # what `typing.get_type_hints` reads, without loading it
    Axes = Any

MOST = 12  # curves that one tells apart by colour and dashes


def curves(
    f: Fragments | str | os.PathLike[str],
    techniques: str | Technique | Iterable[str | Technique] = ("power4", "power6", "power8"),
    pixel: tuple[int, int] | None = None,
    *,
    ax: Axes | None = None,
    part: int | str | None = None,
    layer: str | None = None,
    most: int = MOST,
    legend: bool = True,
    style: str | None = None,
) -> Axes:
    """Transmittance over depth along one ray: the exact one in black, and each technique's.

    f : Fragments, a path or a scene's name.
    techniques : techniques or names, each with a curve.
    pixel : (y, x) in the array; negative numbers count from the end. None: the pixel with the
        most fragments.
    ax : where to draw; None: a new figure, which is the result's `.figure`.
    part, layer : as `composite`.
    most : so many are drawn, those given first; the legend says how many are not.
    legend : False: none, as where another figure has it.
    style : "paper" (as wide as a column), "paper-double" (as both), or None: for screens.

    Members of a family have one hue, and differ by lightness and dashes. The legend is outside the
    Axes where the figure's layout can make room: it is ours, or constrained, or tight.

    Raises IndexError where there is no such pixel, TypeError for a technique without curve.

    >>> ax = moit.plot.curves(moit.scenes.load("panes", (8, 6)), ["power4", "power8"])
    >>> len(ax.lines)
    3
    """
    made = checked_style(style)
    count = whole("most", most, 1)
    has_legend = truth("legend", legend)
    checked_axes(ax)
    fragments = as_fragments(f, part=part, layer=layer)
    if not isinstance(techniques, (str, Technique, Iterable)):
        raise TypeError(
            f"techniques: expected techniques or their names, got {type(techniques).__name__}"
        )
    given = [techniques] if isinstance(techniques, (str, Technique)) else list(techniques)
    chosen = listed(given) if given else []
    at = checked_pixel(fragments, pixel)
    depth = curve_depths(fragments, at)
    held = [(str(one), curve(fragments, one, at, depth)) for one in chosen[:count]]
    chart = curves_chart(depth, curve(fragments, "sorted", at, depth), held)
    with settings(made):
        grows = made.grows if ax is None else None
        ax = new_axes((7.0, 3.9), made) if ax is None else ax
        draw(chart, ax)
        ax.set_title(f"pixel x {at[1]}, y {at[0]}: {len(fragments[at]):,} fragments")
        handles, names = ax.get_legend_handles_labels()
        if len(chosen) > count:
            from matplotlib.lines import Line2D

            handles.append(Line2D([], [], linestyle=""))
            names.append(f"and {len(chosen) - count} more, not drawn")
        if has_legend:
            place_legend(ax, handles, names, grows)
    return ax
