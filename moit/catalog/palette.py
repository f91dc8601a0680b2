"""A colour for each technique: the same in every plot."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

import numpy as np

from moit.catalog import techniques
from moit.reports.pictures import oklab_to_linear, srgb8

# Hues that people with any colour vision tell apart, near those of Okabe and Ito, "Color Universal
# Design", 2008; one for all techniques of one idea. Oklab.
FAMILIES = (
    (("sorted",), (0.0, 0.0, 0.0)),
    (("unsorted",), (0.60, 0.0, 0.0)),
    (("weighted", "wboit"), (0.75, 0.04, 0.15)),
    (("moment-transparency", "two-moments"), (0.68, 0.12, -0.03)),
    (("power", "neural", "dfa"), (0.53, -0.06, -0.12)),
    (("trig",), (0.62, 0.12, 0.13)),
    (("depth-peeling", "adaptive", "mlab", "kbuffer", "hybrid", "per-pixel"), (0.62, -0.13, 0.03)),
    (("fourier", "wavelet", "transmittance", "deep-shadow"), (0.76, -0.07, -0.09)),
    (("stochastic", "hashed"), (0.71, -0.02, 0.15)),
)
OTHERS = (0.51, 0.05, 0.05)
TONES = (0.15, 0.0, -0.13, 0.22, 0.08, -0.07)  # added to the lightness, by the place in a family


def technique_colours(names: Sequence[str]) -> list[str]:
    """A colour for each technique's name; options give the next tone that is free."""
    used: set[tuple[int, int]] = set()
    found = []
    for name in names:
        family, place = _place(re.split(r"[( ]", name, maxsplit=1)[0])
        tones = [(place + k) % len(TONES) for k in range(len(TONES))]
        tone = next((one for one in tones if (family, one) not in used), tones[0])
        used.add((family, tone))
        found.append(_colour(family, tone))
    return found


@functools.cache
def _colour(family: int, tone: int) -> str:
    lightness, a, b = FAMILIES[family][1] if family < len(FAMILIES) else OTHERS
    if lightness:
        lightness = min(lightness + TONES[tone], 0.85)
    red, green, blue = srgb8(oklab_to_linear(np.array([[[lightness, a, b]]])))[0, 0]
    return f"#{red:02x}{green:02x}{blue:02x}"


def technique_family(name: str) -> int:
    """Its place in FAMILIES; their number for others."""
    return next(
        (i for i, (starts, _) in enumerate(FAMILIES) if name.startswith(starts)), len(FAMILIES)
    )


@functools.cache
def _place(name: str) -> tuple[int, int]:
    """Which family, and which of its members: as `moit.techniques()` lists them, or by what it
    counts."""
    family = technique_family(name)
    members = [one for one in map(str, techniques()) if technique_family(one) == family]
    number = re.search(r"\d+", name)
    return family, members.index(name) if name in members else int(number[0]) if number else 0
