"""How a technique looks in figures beside its colour: its family's name, and its line."""

from __future__ import annotations

from collections.abc import Sequence

from moit.catalog.palette import FAMILIES, technique_family

LINES = ("solid", "dashed", "dotted", "dashdot")
# What families are called, by the first beginning of a name in the palette.
TITLES = {
    "sorted": "exact",
    "weighted": "weighted",
    "moment-transparency": "two moments",
    "power": "power, neural",
    "trig": "trigonometric",
    "depth-peeling": "layers",
    "fourier": "curves, series",
}


def family_title(name: str) -> str:
    """What the family of that technique is called in a legend.

    >>> from moit.catalog.looks import family_title
    >>> family_title("power6(bias=0.0)")
    'power, neural'
    """
    family = technique_family(name)
    if family >= len(FAMILIES):
        return "others"
    start = FAMILIES[family][0][0]
    return TITLES.get(start, start)


def technique_lines(names: Sequence[str]) -> list[str]:
    """A line for each technique's name: those of one family, whose colours are near one another,
    take turns."""
    seen: dict[int, int] = {}
    found = []
    for name in names:
        family = technique_family(name)
        place = seen.get(family, 0)
        seen[family] = place + 1
        found.append(LINES[place % len(LINES)])
    return found


def most_different(names: Sequence[str], most: int) -> list[str]:
    """At most that many of them, in their order: one of each family before a second one of any."""
    rank: dict[str, tuple[int, int]] = {}
    seen: dict[int, int] = {}
    for i, name in enumerate(dict.fromkeys(names)):
        family = technique_family(name)
        rank[name] = (seen.get(family, 0), i)
        seen[family] = seen.get(family, 0) + 1
    chosen = set(sorted(rank, key=lambda name: rank[name])[:most])
    return [name for name in rank if name in chosen]
