"""Checks of the options that techniques are made with, and of what they ask of depth."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog.technique import Technique
from moit.checks import arguments
from moit.checks.arguments import truth
from moit.checks.exceptions import FragmentsError
from moit.fragments.fragments import Fragments
from moit.fragments.ranges import opaque_fragments


def names_of(option: str) -> tuple[str, ...]:
    """The values that an option has, each at its number in the core."""
    start = f"{option}_"
    names = (name for name in _core.numbers() if name.startswith(start))
    return tuple(name.removeprefix(start).lower() for name in names)


WARPS = names_of("WARP")


def each_depth(f: Fragments, good: NDArray[np.bool_], needed: str) -> None:
    if not good.all():
        at = int(np.argmin(good))
        raise FragmentsError(f"depth[{at}]: found {f.depth[at]}; needed {needed}")


def depth_to_warp(
    f: Fragments, warp: str, depth_range: str, unit_range: tuple[float, float]
) -> None:
    """FragmentsError unless depth can be warped so."""
    near = f.depth_range[0]
    if warp == "log" and (near <= 0 or depth_range == "pixel"):
        good = (f.depth > 0) | opaque_fragments(f._arrays())
        each_depth(f, good, "positive depth for the log warp; use warp='linear'")
        if depth_range == "image":
            raise FragmentsError(
                f"depth_range: found {f.depth_range}; needed a positive near for the log warp; "
                "use warp='linear'"
            )
    if warp == "none":
        least, most = unit_range
        inside = (f.depth >= least) & (f.depth <= most)
        each_depth(f, inside, f"depth in [{least:g}, {most:g}] with warp='none'")


def hold(technique: Technique, name: str, value: Any) -> None:
    """Sets an option of a frozen technique that is just being made."""
    object.__setattr__(technique, name, value)


def hold_number(technique: Technique, name: str) -> float:
    """Turns an option into a float, so that `str` shows what `technique` reads."""
    value = getattr(technique, name)
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {number}")
    hold(technique, name, number)
    return number


def whole(technique: Technique, name: str, least: int, most: int = 2**31 - 1) -> None:
    """Turns an option into an int within [least, most]."""
    hold(technique, name, arguments.whole(name, getattr(technique, name), least, most))


def flag(technique: Technique, name: str) -> None:
    hold(technique, name, truth(name, getattr(technique, name)))


def within(technique: Technique, name: str, least: float, most: float) -> None:
    number = hold_number(technique, name)
    if not least <= number <= most:
        raise ValueError(f"{name}: expected a number from {least} to {most}, got {number}")


def positive(technique: Technique, name: str) -> None:
    number = hold_number(technique, name)
    if not number > 0:
        raise ValueError(f"{name}: expected a positive number, got {number}")
