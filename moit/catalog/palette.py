"""What each technique looks like: one colour and one line, the same in every picture.

Colours are legible as marks and lines on white paper and on the dark page alike. Families of ideas
differ in hue, their members in lightness and line. Who cannot tell red from green, or has no
colours at all, tells techniques by lightness and line: colours that such eyes confuse are never
drawn by the same line (tests/test_palette.py).
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from moit.catalog.names import class_of, start_of, techniques
from moit.reports.pictures import oklab_to_linear, srgb8

INK = "#000000"  # of what is exact; a page draws it in the colour of its text
LINES = ("solid", "dashed", "dotted", "dashdot")


@dataclass(frozen=True)
class Look:
    """colour : sRGB as "#rrggbb". line : one of LINES."""

    colour: str
    line: str


@dataclass(frozen=True)
class Family:
    """Techniques of one idea.

    title : what a legend calls them; techniques name it as their `family`. lab : Oklab of the
    first. step : how much lighter the second is, and darker the third; then it begins again.
    line : of the first, as a place in LINES; each other has the next.
    """

    title: str
    lab: tuple[float, float, float]
    step: float = 0.0
    line: int = 0


# Found by simulated annealing from the hues of Okabe and Ito, "Color Universal Design", 2008: the
# least distance of two default techniques with the same line is as large as could be, for usual
# eyes and as Machado, Oliveira and Fernandes, 2009, simulate eyes without one kind of cones, with
# a contrast of 3 to 1 to white and to the dark page.
FAMILIES = (
    Family("exact", (0.0, 0.0, 0.0)),
    Family("unsorted", (0.512, 0.0, 0.0)),
    Family("weighted", (0.614, 0.072, 0.115), 0.057, 1),
    Family("two moments", (0.621, 0.103, 0.0), 0.060, 3),
    Family("power, neural", (0.592, -0.006, -0.170), 0.081, 0),
    Family("trigonometric", (0.588, 0.152, 0.070), 0.060, 2),
    Family(
        "layers",
        (0.578, -0.083, 0.050),
        0.075,
        2,
    ),
    Family(
        "curves, series",
        (0.582, -0.069, -0.058),
        0.071,
        1,
    ),
    Family("strongest", (0.630, 0.022, -0.105), 0.042, 3),
    Family("stochastic", (0.492, -0.060, 0.093), 0.047, 1),
    Family("others", (0.559, 0.111, -0.115), 0.034, 2),  # one's own
)
STEPS = (0.0, 1.0, -1.0)
PLACES = len(STEPS) * len(LINES)  # that many members of a family look different


def technique_looks(names: Sequence[str]) -> list[Look]:
    """How each technique is drawn, by its name; with options it has the next look that is free
    beside those without any."""
    kinds = [re.split(r"[( ]", name, maxsplit=1)[0] for name in names]
    used: set[tuple[int, int]] = set()
    found: dict[int, Look] = {}
    for i in sorted(range(len(names)), key=lambda i: names[i] != kinds[i]):
        family, wanted = _place(kinds[i])
        places = [(wanted + k) % PLACES for k in range(PLACES)]
        place = next((one for one in places if (family, one) not in used), places[0])
        used.add((family, place))
        found[i] = _look(family, place)
    return [found[i] for i in range(len(names))]


def technique_colours(names: Sequence[str]) -> list[str]:
    """The colour of each technique's look."""
    return [look.colour for look in technique_looks(names)]


def technique_lines(names: Sequence[str]) -> list[str]:
    """The line of each technique's look."""
    return [look.line for look in technique_looks(names)]


def family_title(name: str) -> str:
    """What a legend calls the ideas of that technique.

    >>> from moit.catalog.palette import family_title
    >>> family_title("power6(bias=0.0)")
    'power, neural'
    """
    return FAMILIES[technique_family(name)].title


def technique_family(name: str) -> int:
    """Its place in FAMILIES."""
    start = start_of(name)
    title = class_of(start).family if start else FAMILIES[-1].title
    return next(i for i, family in enumerate(FAMILIES) if family.title == title)


def most_different(names: Sequence[str], most: int) -> list[str]:
    """At most that many of them, in their order: one of each family before a second one of any."""
    held = list(dict.fromkeys(names))
    families = [technique_family(name) for name in held]
    order = sorted(range(len(held)), key=lambda i: (families[:i].count(families[i]), i))
    return [held[i] for i in sorted(order[:most])]


@functools.cache
def _look(index: int, place: int) -> Look:
    family = FAMILIES[index]
    lightness, a, b = family.lab
    lightness += family.step * STEPS[place % len(STEPS)]
    red, green, blue = srgb8(oklab_to_linear(np.array([[[lightness, a, b]]])))[0, 0]
    line = LINES[(family.line + place) % len(LINES)]
    return Look(f"#{red:02x}{green:02x}{blue:02x}", line)


@functools.cache
def _place(name: str) -> tuple[int, int]:
    """Which family, and which of its members: as `moit.techniques()` lists them, or by what it
    counts."""
    family = technique_family(name)
    members = [one for one in map(str, techniques()) if technique_family(one) == family]
    number = re.search(r"\d+", name)
    return family, members.index(name) if name in members else int(number[0]) if number else 0
