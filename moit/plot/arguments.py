"""What the arguments of figures must be."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from moit.catalog import Technique, technique
from moit.comparing.report import Report
from moit.fragments.fragments import Fragments


def checked_pixel(f: Fragments, pixel: tuple[int, int] | None) -> tuple[int, int]:
    """A pixel of `f` as (y, x), both at least 0; for None the one with the most fragments.

    >>> moit.plot.checked_pixel(moit.scenes.load("panes", (8, 6)), (-1, 0))
    (5, 0)
    """
    height, width = f.shape
    if pixel is None:
        if not height * width:
            raise IndexError("pixel: there are no pixels")
        most = int(np.argmax(f.counts))
        return most // width, most % width
    try:
        y, x = (one.__index__() for one in pixel)
    except (AttributeError, TypeError, ValueError):
        raise TypeError(f"pixel: expected two integers (y, x), got {pixel!r}") from None
    if not (-height <= y < height and -width <= x < width):
        raise IndexError(
            f"pixel: (y, x) = ({y}, {x}) is outside {height} x {width} (height x width)"
        )
    return y % height, x % width


def scene_names(report: Report, scenes: str | Iterable[str] | None, called: str) -> list[str]:
    """Those of a report that are asked for; None: all."""
    if not isinstance(report, Report):
        raise TypeError(f"report: expected a Report, got {type(report).__name__}")
    known = list(dict.fromkeys(row["scene"] for row in report.rows))
    return known if scenes is None else _some(called, _of(called, scenes, known))


def checked_axes(ax: Any) -> Any:
    """matplotlib's Axes, or None; raises TypeError for what is none."""
    if ax is not None and not (hasattr(ax, "set_yscale") and hasattr(ax, "plot")):
        raise TypeError(f"ax: expected matplotlib's Axes or None, got {type(ax).__name__}")
    return ax


def _some(called: str, names: list[str]) -> list[str]:
    if not names:
        raise ValueError(f"{called}: expected at least one, got none")
    return names


def technique_names(
    techniques: str | Technique | Iterable[str | Technique] | None,
    known: Sequence[str],
    called: str = "techniques",
) -> list[str]:
    """Those of `known` that are asked for, by any of their names; None: all. `[]` is none."""
    if techniques is None:
        return list(known)
    if not isinstance(techniques, (str, Technique, Iterable)):
        raise TypeError(f"{called}: expected names, got {type(techniques).__name__}")
    given = [techniques] if isinstance(techniques, (str, Technique)) else techniques
    return _of(called, [_as_listed(str(one), known) for one in given], known)


def _as_listed(name: str, known: Sequence[str]) -> str:
    if name not in known:
        try:
            other = str(technique(name))
        except (TypeError, ValueError):
            return name
        return other if other in known else name
    return name


def _of(called: str, names: str | Iterable[str], known: Sequence[str]) -> list[str]:
    if not isinstance(names, Iterable):
        raise TypeError(f"{called}: expected names, got {type(names).__name__}")
    found = [names] if isinstance(names, str) else list(names)
    for name in found:
        if not isinstance(name, str) or name not in known:
            raise ValueError(f"{called}: expected one of {', '.join(known)}; got {name!r:.80}")
    return list(dict.fromkeys(found))
