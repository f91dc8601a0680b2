"""Other forms of a technique: with the options that make it better, and of other sizes.

Which options a technique has it says itself: one that comes to the catalog has its forms by itself.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from moit.catalog.technique import Technique

COUNTS = (2, 4, 6, 8, 10)  # of layers, nodes and the like
#: Options that change what a pixel's numbers come to, with their values beside the default: those
#: that a technique has are taken together, and all combinations of several such are tried. Beta is
#: .4 where a fragment's own share is taken out, as more may then lie in front of it.
BETTER: tuple[Mapping[str, Any], ...] = (
    {"normalize": True},
    {"merge": "energy"},
    {"exclude_self": True, "overestimation": 0.4},
)
#: Few bits of a slice, and places of slices for each square of pixels.
SMALL_SLICES: Mapping[str, Any] = {"bits": 6, "table": "tile", "tile": 12, "cells": 256}
#: Ways to keep a pixel's numbers in fewer bytes: half floats, and blocks of pixels that share a
#: state, with each pixel's own total or without.
SMALLER: tuple[Mapping[str, Any], ...] = (
    {"storage": "half"},
    {"storage": "half", "depth_range": "pixel"},
    {"resolution": 2, "total": "full"},
    {"resolution": 4, "total": "full"},
    {"resolution": 4, "total": "full", "inside": "power4"},
    {"resolution": 4, "total": "half"},
    {"resolution": 8, "total": "half"},
    {"resolution": 4},
    {"resolution": 8},
    {"cells": 6},
    # Keys of 32 bits: more of the nearest, or more moments of the tail, in as many bytes.
    {"key_bits": 32, "layers": 4},
    {"key_bits": 32, "tail": "neural-bounded6"},
    # Slices: what 8, 6 and, with four moments, 24 bytes hold best.
    {**SMALL_SLICES, "resolution": 2, "count": 36, "total": "byte"},
    {**SMALL_SLICES, "resolution": 3, "count": 45, "total": "half"},
    {**SMALL_SLICES, "resolution": 3, "count": 45, "total": "full", "inside": "power4"},
    # Slices that a network reads: what 6, 8, 16, 20 and 32 bytes hold.
    {"count": 4, "bits": 4, "network": None},
    {"count": 5, "bits": 6, "network": None},
    {"count": 12, "bits": 8, "network": None},
    {"count": 16, "bits": 8, "network": None},
    {"count": 28, "bits": 8, "network": None},
)


def better(one: Technique) -> Technique:
    """It with all options that make it better; itself where it has none.

    >>> from moit.catalog.forms import better
    >>> str(better(moit.technique("power4")))
    'power4(exclude_self=True,overestimation=0.4)'
    """
    return next(_with(one, _together(_groups(one))), one)


def forms(one: Technique) -> Iterator[Technique]:
    """A technique as it is, with each of its better options, and at other sizes with all."""
    groups = _groups(one)
    best = better(one)
    yield one
    for count in range(1, len(groups) + 1):
        for several in itertools.combinations(groups, count):
            yield from _with(one, _together(several))
    for other in _counts(one):
        yield from _with(one, other)
        yield from _with(best, other)
    sizes = [best]
    if _has_many(one):
        sizes += [size for other in _counts(one) for size in _with(best, other)]
    for size, smaller in itertools.product(sizes, SMALLER):
        if smaller.keys() <= _names(one):
            yield from _with(size, smaller)


def _groups(one: Technique) -> list[dict[str, Any]]:
    return [changes for group in BETTER if (changes := _changes(one, group))]


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
    """Other numbers of what a technique counts, as layers, where it takes them."""
    if not one.counted:
        return []
    own = int(_value(one, one.counted))
    counts = (own // 4, own // 2, 2 * own) if _has_many(one) else COUNTS
    return [{one.counted: count} for count in counts]


def _has_many(one: Technique) -> bool:
    return bool(one.counted) and int(_value(one, one.counted)) > max(COUNTS)


def _with(one: Technique, options: Mapping[str, Any]) -> Iterator[Technique]:
    """It with these options, where it takes them together."""
    if options:
        with contextlib.suppress(ValueError, TypeError):
            yield dataclasses.replace(one, **options)


def _names(one: Technique) -> set[str]:
    return {field.name for field in dataclasses.fields(one) if field.init}


def _value(one: Technique, option: str) -> Any:
    return getattr(one, option, None)
