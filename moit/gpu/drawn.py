"""The techniques as passes over triangles: what targets hold of a pixel, and how it comes there.

The passes are those of shaders/meshes/drawn.glsl; what a technique has none of is captured as lists
of fragments, and its passes over arrays (moit.gpu.passes) go over these.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from moit.gpu.bindings import CAPTURE, FACTOR, RATIO_PASS
from moit.gpu.passes import Constants, Stage

FARTHEST = 3.4028234663852886e38  # the depth of what is not there

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
class Second:
    """The other target that a shading pass writes: how it blends, and what is there at first."""

    format: str
    blend: str
    clear: float


@dataclasses.dataclass(frozen=True)
class Drawn:
    """A technique's passes over triangles.

    formats : of the targets that hold a pixel's numbers, in the order of numbers; () for none: one
        pass shades all.
    ordered : whether fragments change these numbers one after the other; else they add up.
    empty : the numbers before any fragment, where that is not 0.
    colored : whether such a pass needs colour.
    shades : whether fragments are drawn a second time, with what they count; else a pixel's numbers
        have their colours.
    blend : of the shading pass.
    greatest : how many targets, in front of these, keep the greatest of what is written.
    multiplied : how many of the last targets multiply up 1 - what is written, and begin at 1; the
        others add up.
    rounds : of capture, each of which sees what the one before made.
    stages : what then makes factors; None: those of the passes over arrays but CAPTURE.
    block_side : of the blocks of pixels that numbers are of; 1: of pixels.
    own : defines beside those of the passes over arrays.
    """

    formats: tuple[str, ...] = ()
    ordered: bool = False
    empty: tuple[float, ...] = ()
    colored: bool = False
    shades: bool = True
    blend: str = "add"
    second: Second | None = None
    greatest: int = 0
    multiplied: int = 0
    rounds: int = 1
    stages: tuple[Stage, ...] | None = None
    block_side: int = 1
    own: Mapping[str, int] = dataclasses.field(default_factory=dict)

    @property
    def blends(self) -> list[str]:
        """Of the targets that hold numbers."""
        added = len(self.formats) - self.greatest - self.multiplied
        kept = ["max"] * self.greatest
        return ["add"] * added + kept + ["multiply-complement"] * self.multiplied

    @property
    def numbers(self) -> int:
        return sum(channels(format) for format in self.formats)

    @property
    def first_numbers(self) -> tuple[float, ...]:
        return self.empty or (0.0,) * self.numbers

    def defines(self) -> dict[str, str | int]:
        """Of drawn.glsl."""
        found: dict[str, str | int] = {
            "TARGETS": len(self.formats),
            "NUMBERS_DRAWN": self.numbers,
            "COLORED": int(self.colored),
        }
        first = 0
        for i, format in enumerate(self.formats):
            found |= {f"FROM{i}": first, f"CHANNELS{i}": channels(format)}
            found[f"WORDS{i}"] = "true" if format.endswith("16") else "false"
            first += channels(format)
        return found


def drawn_of(kind: str, constants: Constants, target: str) -> Drawn | None:
    """None where a technique has no passes over triangles. target: format of colours."""
    make = _FAMILIES.get(kind)
    return make(constants, "32f" if target == "rgba32f" else "16f") if make else None


def _formats(numbers: int, item: str) -> tuple[str, ...]:
    """As few targets as hold so many numbers, without room to spare."""
    fours, rest = divmod(numbers, 4)
    few = {0: (), 1: (f"r{item}",), 2: (f"rg{item}",), 3: (f"rg{item}", f"r{item}")}
    return (f"rgba{item}",) * fours + few[rest]


def _moments(c: Constants, numbers: int) -> Drawn:
    if c.fields["bits"] == 32:
        return Drawn((*_formats(numbers, "32f"), "r32f"))
    return Drawn(
        (*_formats(numbers, "16"), "r16f" if c.fields["b0_is_half"] else "r32f"), ordered=True
    )


def _power(c: Constants, item: str) -> Drawn:
    return _moments(c, c.fields["count"])


def _trigonometric(c: Constants, item: str) -> Drawn:
    return _moments(c, 2 * c.fields["count"])


def _fourier(c: Constants, item: str) -> Drawn:
    return Drawn(_formats(c.fields["count"], "16f" if c.fields["bits"] == 16 else "32f"))


def _moment_transparency(c: Constants, item: str) -> Drawn | None:
    rounds = c.fields["passes"]
    blocks = c.fields["resolution"] > 1
    if (rounds == 2 and c.fields["exclude_self"]) or (blocks and c.fields["average"]):
        return None
    ratio = (Stage(RATIO_PASS),) if rounds == 2 else ()
    if blocks:
        return Drawn(
            ("rgba32f", "r32f"),
            rounds=rounds,
            stages=(Stage(CAPTURE), Stage(FACTOR, double=True), *ratio),
            second=Second("r32f", "multiply-complement", 1.0),
            block_side=c.fields["resolution"],
            own={"FROM_TRIANGLES": 1, "ROUND": 0},
        )
    return Drawn(
        ("rgba32f", "r32f", "r32f"),
        empty=(0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        multiplied=1,
        rounds=rounds,
        stages=(Stage(FACTOR, double=True), *ratio),
        own={"FROM_TRIANGLES": 1, "ROUND": 0},
    )


def _neural(c: Constants, item: str) -> Drawn:
    """The paper's targets; its half floats are words where a round before has to find extents."""
    words = c.fields["range_in_words"]
    return Drawn(
        ("rgba32f", "rg32f", "rg16" if words else "rg16f"),
        empty=(0.0,) * 6 + ((0.0, 0.0) if words else (-1.0, -1.0)),
        greatest=1,
        rounds=2 if words else 1,
        stages=(Stage(FACTOR, double=True),),
        own={"ROUND": 0},
    )


def _unsorted(c: Constants, item: str) -> Drawn:
    return Drawn(blend="over")


def _weighted_sum(c: Constants, item: str) -> Drawn:
    return Drawn(second=Second(f"r{item}", "add", 0.0))


def _weighted_blended(c: Constants, item: str) -> Drawn:
    held = "r8" if c.fields["bits"] == 16 else "r32f"
    return Drawn(second=Second(held, "multiply-complement", 1.0))


def _adaptive(c: Constants, item: str) -> Drawn | None:
    return _layers(Drawn(ordered=True, empty=(FARTHEST, 1.0) * c.fields["count"]))


def _mlab(c: Constants, item: str) -> Drawn | None:
    empty = (FARTHEST, 0.0, 0.0, 0.0, 1.0) * c.fields["count"]
    return _layers(Drawn(ordered=True, empty=empty, colored=True, shades=False))


def _layers(drawn: Drawn) -> Drawn | None:
    formats = _formats(len(drawn.empty), "32f")
    return dataclasses.replace(drawn, formats=formats) if len(formats) <= 8 else None


_FAMILIES: dict[str, Callable[[Constants, str], Drawn | None]] = {
    "power": _power,
    "neural": _neural,
    "neural-bounded": _power,
    "trig": _trigonometric,
    "fourier": _fourier,
    "moment-transparency": _moment_transparency,
    "unsorted": _unsorted,
    "weighted-sum": _weighted_sum,
    "weighted-average": _weighted_sum,
    "wboit": _weighted_blended,
    "adaptive": _adaptive,
    "mlab": _mlab,
}
