"""Which techniques are judged: those of the catalog, with the options that make them better.

What a technique is (its bytes, passes and access) it says itself, and what options it has, too: one
that comes to the catalog enters the list by itself.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from moit.catalog import Technique, techniques

MOST_BYTES = 72.0  # of a pixel; what keeps more is judged where it is asked for by name
COUNTS = (2, 4, 6, 8, 10)  # of layers, nodes and the like
RESOLUTIONS = (2, 4, 8)
#: Options that change what a pixel's numbers come to, with their values beside the default: those
#: that a technique has are taken together, and all combinations of several such are tried. Beta is
#: .4 where a fragment's own share is taken out, as more may then lie in front of it.
BETTER: tuple[Mapping[str, Any], ...] = (
    {"normalize": True},
    {"merge": "energy"},
    {"exclude_self": True, "overestimation": 0.4},
)
FULL_TOTAL = {"total": "full"}


def candidates() -> list[Technique]:
    """Those of the frontier, in the order of the catalog."""
    found = itertools.chain.from_iterable(map(_forms, techniques()))
    return [one for one in dict.fromkeys(found) if is_judged(one)]


def is_judged(one: Technique) -> bool:
    """Whether it has a place: it needs no order of drawing and keeps no lists, in few bytes."""
    bits = one.bits_per_pixel
    known = bits is not None and one.geometry_passes is not None and one.access != "lists"
    return known and one.kind != "unsorted" and (bits or 0) <= 8 * MOST_BYTES


def _forms(one: Technique) -> Iterator[Technique]:
    """A technique as it is, with each of its better options, and at other sizes with all."""
    options = _names(one)
    better = [changes for group in BETTER if (changes := _changes(one, group))]
    yield one
    for count in range(1, len(better) + 1):
        for several in itertools.combinations(better, count):
            yield from _with(one, _together(several))
    best = next(_with(one, _together(better)), one)
    for other in _counts(one):
        yield from _with(one, other)
        yield from _with(best, other)
    if "resolution" in options and _value(one, "resolution") == 1:
        for side in RESOLUTIONS:
            yield from _with(best, {"resolution": side})
            if "total" in options:
                yield from _with(best, {"resolution": side, **FULL_TOTAL})


def _changes(one: Technique, group: Mapping[str, Any]) -> dict[str, Any]:
    """What of a group a technique has; nothing where the first of it is so already."""
    options = _names(one)
    first = next(iter(group))
    if first not in options or _value(one, first) == group[first]:
        return {}
    return {name: value for name, value in group.items() if name in options}


def _together(groups: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    return {name: value for group in groups for name, value in group.items()}


def _counts(one: Technique) -> list[dict[str, int]]:
    """Other numbers of what a technique counts freely, as layers; not of its moments."""
    if not one.counted or one.stores_moments or one.has_network:
        return []
    return [{one.counted: count} for count in COUNTS]


def _with(one: Technique, options: Mapping[str, Any]) -> Iterator[Technique]:
    """It with these options, where it takes them together."""
    if options:
        with contextlib.suppress(ValueError, TypeError):
            yield dataclasses.replace(one, **options)


def _value(one: Technique, option: str) -> Any:
    return getattr(one, option)


def _names(one: Technique) -> set[str]:
    return {field.name for field in dataclasses.fields(one) if field.init}
