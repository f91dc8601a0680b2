"""The targets that techniques draw to: which format, and how fragments come together in each.

What passes over triangles (moit.gpu.drawn) bind is this, and what `Technique.targets` tells.
"""

from __future__ import annotations

import dataclasses
from typing import Any

CHANNELS = {"r": 1, "rg": 2, "rgba": 4}
BYTES = {"8": 1, "16": 2, "16f": 2, "32f": 4}


def channels(format: str) -> int:
    return CHANNELS[format.rstrip("0123456789f")]


def texel_bytes(format: str) -> int:
    """Of a texel of a colour format, or of depth."""
    if format == "depth32f":
        return 4
    name = format.rstrip("0123456789f")
    return CHANNELS[name] * BYTES[format[len(name) :]]


@dataclasses.dataclass(frozen=True)
class Target:
    """A texture that transparent geometry is drawn to.

    format : "r", "rg" or "rgba" and the kind of number: "8" and "16" for integers from 0 to 1,
        "16f" and "32f" for floats.
    blend : how a fragment's numbers s change those that are there, d: "add", d + s; "max", the
        greater; "multiply-complement", d (1 - s); "over", s + d (1 - alpha of s); "under",
        s (1 - alpha of d) + d; "replace", s; "ordered", read and written by the fragments of a
        pixel one after the other, which needs rasterizer-ordered access (a fragment shader
        interlock, or framebuffer fetch).
    clear : what is there at first in a target that is drawn to while fragments are shaded, and in
        one of which the greatest is kept.

    >>> moit.technique("wboit").targets[1]
    Target(format='r32f', blend='multiply-complement', clear=1.0)
    """

    format: str
    blend: str
    clear: float = 0.0


@dataclasses.dataclass(frozen=True)
class KeyWords:
    """Words of a pixel that keep fragments, those with the greatest keys.

    kept : how many keys, and what else is found with them, take.
    cells : that all others are added to; 0: they are blended to targets, if anything is.
    of_all : whether what targets hold is of all fragments, drawn in the pass that finds keys; else
        of those that are not kept, in a pass of its own.
    """

    kept: int
    cells: int = 0
    of_all: bool = False


@dataclasses.dataclass(frozen=True)
class SliceWords:
    """Words that are slices of optical depth, which fragments add to.

    slots : of a block of pixels.
    cells : of depth, that slices stand at the borders of.
    of_middle : whether the fragments of a block's middle pixel alone are added.
    """

    slots: int
    cells: int
    of_middle: bool = False


@dataclasses.dataclass(frozen=True)
class ExtentWords:
    """Words of a pixel that are its own extent, two of them, and slices of that.

    slots : slices.
    """

    slots: int

    @property
    def all(self) -> int:
        return self.slots + 2


@dataclasses.dataclass(frozen=True)
class Targets:
    """Those of a technique.

    held : what captures a pixel's numbers, () for none: one pass shades all.
    shaded : that of colours, of the pass that shades fragments, and another that it writes; ()
        where `held` has their colours.
    second : what an engine captures in a pass of its own, which reads `held`; moit's own passes
        draw to the same targets again.
    tail : beside `held` what leaves it is blended to, in the same pass.
    rounds : how often geometry is drawn to a layer that is then blended to `shaded`; 0: it is not.
    samples : of a pixel, that have depth and `shaded` each; 0: pixels have one.
    words : that fragments change by atomics beside these; None: there are none.
    """

    held: tuple[Target, ...] = ()
    shaded: tuple[Target, ...] = ()
    tail: tuple[Target, ...] = ()
    rounds: int = 0
    samples: int = 0
    second: tuple[Target, ...] = ()
    words: KeyWords | SliceWords | ExtentWords | None = None


def targets_of(technique: Any, colours: str = "16f") -> Targets | None:
    """Of a Technique, with colours in numbers of such a kind; None where it keeps lists."""
    found: Targets | None = technique.drawn_to(colours)
    return found


def shipped_targets_of(technique: Any) -> Targets | None:
    """Those that an engine draws to (moit.export), also of techniques of which moit's own passes
    over triangles keep lists of fragments."""
    found: Targets | None = technique.shipped_to()
    return found


def formats_for(numbers: int, kind: str) -> tuple[str, ...]:
    """As few targets as hold so many numbers, without room to spare."""
    fours, rest = divmod(numbers, 4)
    few = {0: (), 1: (f"r{kind}",), 2: (f"rg{kind}",), 3: (f"rg{kind}", f"r{kind}")}
    return (f"rgba{kind}",) * fours + few[rest]


def held_in(formats: tuple[str, ...], blend: str = "add") -> tuple[Target, ...]:
    return tuple(Target(format, blend) for format in formats)


def multiplied(format: str = "r32f") -> Target:
    """What fragments let through, all together."""
    return Target(format, "multiply-complement", 1.0)


def added(colours: str, *second: Target) -> tuple[Target, ...]:
    """Colours that add up, and what else the pass that shades writes."""
    return (Target(f"rgba{colours}", "add"), *second)
