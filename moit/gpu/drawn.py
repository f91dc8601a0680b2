"""The techniques as passes over triangles: what targets hold of a pixel, and how it comes there.

The passes are those of shaders/meshes/drawn.glsl; what a technique has none of is captured as lists
of fragments, and its passes over arrays (moit.gpu.passes) go over these.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from moit.catalog import Technique
from moit.catalog.by_kind import ByKind
from moit.catalog.targets import Target, Targets, channels
from moit.gpu.bindings import CAPTURE, FACTOR, RATIO_PASS
from moit.gpu.block_passes import READ
from moit.gpu.described import Constants, Stage
from moit.gpu.moment_passes import extents_are_words

FARTHEST = 3.4028234663852886e38  # the depth of what is not there


@dataclasses.dataclass(frozen=True)
class Drawn:
    """A technique's passes over triangles.

    targets : that hold a pixel's numbers, in the order of numbers, and that are shaded.
    empty : the numbers before any fragment, where that is not 0.
    colored : whether a pass that captures needs colour.
    rounds : of capture, each of which sees what the one before made.
    stages : what then makes factors; None: those of the passes over arrays but CAPTURE.
    block_side : of the blocks of pixels that numbers are of; 1: of pixels.
    own : defines beside those of the passes over arrays.
    words : of a pixel, 0 at first, that fragments change by atomics in each of the rounds; these
        draw to no targets. 0: there are none.
    between : whether a pass over pixels follows the first of the rounds.
    """

    targets: Targets
    empty: tuple[float, ...] = ()
    colored: bool = False
    rounds: int = 1
    stages: tuple[Stage, ...] | None = None
    block_side: int = 1
    own: Mapping[str, int] = dataclasses.field(default_factory=dict)
    words: int = 0
    between: bool = True

    @property
    def formats(self) -> tuple[str, ...]:
        """Of the targets that hold numbers."""
        return tuple(one.format for one in self.targets.held)

    @property
    def blends(self) -> list[str]:
        """Of the same."""
        return [one.blend for one in self.targets.held]

    @property
    def ordered(self) -> bool:
        """Whether fragments change numbers one after the other; else they add up."""
        return "ordered" in self.blends

    @property
    def shades(self) -> bool:
        """Whether fragments are drawn a second time, with what they count; else a pixel's numbers
        have their colours."""
        return bool(self.targets.shaded)

    @property
    def blend(self) -> str:
        """Of the shading pass."""
        return self.targets.shaded[0].blend if self.shades else "add"

    @property
    def second(self) -> Target | None:
        """The other target that the shading pass writes."""
        return self.targets.shaded[1] if len(self.targets.shaded) > 1 else None

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


def drawn_of(technique: Technique, constants: Constants, target: str) -> Drawn | None:
    """None where a technique has no passes over triangles. target: format of colours."""
    targets = technique.drawn_to("32f" if target == "rgba32f" else "16f")
    if targets is None or len(targets.held) > MOST_TARGETS:
        return None
    if technique.block_side > 1 and not technique.draws_blocks and not targets.words:
        return None
    make = drawn_for.get(technique.kind)
    return make(constants, targets) if make else Drawn(targets)


MOST_TARGETS = 8

# Those that have more to them than targets.
drawn_for: ByKind[Callable[[Constants, Targets], Drawn | None]] = ByKind()


@drawn_for("moment-transparency")
def _moment_transparency(c: Constants, targets: Targets) -> Drawn | None:
    rounds = c.fields["passes"]
    blocks = c.fields["resolution"] > 1
    if rounds == 2 and c.fields["exclude_self"]:
        return None
    ratio = (Stage(RATIO_PASS),) if rounds == 2 else ()
    factors = (Stage(FACTOR, double=True), *ratio)
    if blocks:
        return Drawn(
            targets,
            rounds=rounds,
            stages=(READ, *factors),
            block_side=c.fields["resolution"],
            own={"FROM_TRIANGLES": 1, "ROUND": 0},
        )
    return Drawn(
        targets,
        empty=(0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        rounds=rounds,
        stages=factors,
        own={"FROM_TRIANGLES": 1, "ROUND": 0},
    )


@drawn_for("neural")
def _neural(c: Constants, targets: Targets) -> Drawn:
    words = c.fields["range_in_words"]
    return Drawn(
        targets,
        empty=(0.0,) * 6 + ((0.0, 0.0) if words else (-1.0, -1.0)),
        rounds=2 if words else 1,
        stages=(Stage(FACTOR, double=True),),
        own={"ROUND": 0},
    )


@drawn_for("power", "neural-bounded")
def _power(c: Constants, targets: Targets) -> Drawn:
    if not extents_are_words(c.fields):
        return Drawn(targets)
    return Drawn(targets, rounds=2, stages=(Stage(FACTOR, double=True),), own={"ROUND": 0})


@drawn_for("neural-slices")
def _neural_slices(c: Constants, targets: Targets) -> Drawn:
    return Drawn(targets, rounds=2, stages=(Stage(FACTOR),), own={"ROUND": 0}, words=2)


@drawn_for("slices")
def _slices(c: Constants, targets: Targets) -> Drawn:
    blocks = c.fields["resolution"] > 1
    own_total = (Stage(CAPTURE),) if blocks and c.fields["full_total"] else ()
    return Drawn(
        targets,
        rounds=2,
        stages=(*own_total, *((READ,) if blocks else ())),
        own={"FROM_TRIANGLES": 1, "ROUND": 0},
        words=1,
        between=False,
    )


@drawn_for("anchors")
def _anchors(c: Constants, targets: Targets) -> Drawn | None:
    if c.fields["large_keys"]:  # whose atomics OpenGL has not
        return None
    kept, cells = c.fields["count"], c.fields["cells"]
    return Drawn(
        targets,
        rounds=2,
        stages=(Stage(CAPTURE), Stage(FACTOR, double=True)),
        own={"FROM_TRIANGLES": 1, "ROUND": 0},
        words=2 * kept + cells + 2,
        between=False,
    )


@drawn_for("adaptive")
def _adaptive(c: Constants, targets: Targets) -> Drawn:
    return Drawn(targets, empty=(FARTHEST, 1.0) * c.fields["count"])


@drawn_for("mlab")
def _mlab(c: Constants, targets: Targets) -> Drawn | None:
    if c.fields["buckets"]:  # where they end is known once all fragments are
        return None
    empty = (FARTHEST, 0.0, 0.0, 0.0, 1.0) * c.fields["count"]
    return Drawn(targets, empty=empty, colored=True)
