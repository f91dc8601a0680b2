"""Which techniques are judged: those of the catalog and their better forms.

What a technique is (its bytes, passes and access) it says itself: one that comes to the catalog
enters the list by itself.
"""

from __future__ import annotations

import itertools

from moit.catalog import Technique, techniques
from moit.catalog.forms import forms

MOST_BYTES = 72.0  # of a pixel; what keeps more is judged where it is asked for by name


def candidates() -> list[Technique]:
    """Those of the frontier, in the order of the catalog."""
    found = itertools.chain.from_iterable(map(forms, techniques()))
    return [one for one in dict.fromkeys(found) if is_judged(one)]


def is_judged(one: Technique) -> bool:
    """Whether it has a place: it needs no order of drawing and keeps no lists, in few bytes."""
    bits = one.bits_per_pixel
    known = bits is not None and one.geometry_passes is not None and one.access != "lists"
    return known and one.kind != "unsorted" and (bits or 0) <= 8 * MOST_BYTES
