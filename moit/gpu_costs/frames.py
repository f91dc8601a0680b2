"""A model of what techniques take of a frame on a GPU that is not here. All it says is predicted.

A pass over fragments takes, for each, `SHADING` instructions (of what rasterises, tests depth and
shades plainly) and the technique's own cycles, by how many units run waves of 64; to this is added
what its targets' bytes take, read and written, at `EFFICIENCY` of the memory's bandwidth. A pass
over pixels takes its cycles and bytes. Clears, caches and geometry beyond `SHADING` do not count.

Four numbers are fitted, to table 1 of Moment-Based Order-Independent Transparency (Muenstermann,
Krumpen, Klein, Peters 2018): `SHADING` and `EFFICIENCY` to its alpha blending and to how pass 1
grows with targets, the two of `ORDERED` to its power moments in 16 bits and to multi-layer alpha
blending of two layers. All else in that table is foretold by cycles and bytes (docs/gpu_costs.md).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from moit.catalog import Technique
from moit.catalog.targets import (
    ExtentWords,
    KeyWords,
    SliceWords,
    Target,
    Targets,
    texel_bytes,
)
from moit.gpu_costs.cards import Card
from moit.gpu_costs.cost import WAVE, Cost

SHADING = 240.0  # instructions a fragment
CYCLES = {"navi21": 2.0, "gfx1100": 2.0, "vega10": 4.0}  # of an instruction, a wave
EFFICIENCY = 0.9
# How many times the bytes of targets count that fragments change one after the other: words that
# are sums, and nodes or layers that are searched first.
ORDERED = {"sums": 1.3, "nodes": 1.7}
COLOUR = 8  # bytes: RGBA16F
WORD = 4
DEPTH = 4  # of a sample
OUTPUT = 8  # of what a resolve writes to

# Passes as rows name them: those over fragments, and those over pixels.
COVERAGE, ACCUMULATE, FACTOR, TRANSMITTANCE, FUSED, RESOLVE = (
    "coverage",
    "accumulate",
    "factor",
    "transmittance",
    "fused",
    "resolve",
)
# Of techniques that gather a second time, what the first lets through.
ACCUMULATE_SECOND, FACTOR_SECOND = "accumulate-second", "factor-second"
# Of those whose fragments change arrays: what marks cells or keeps keys, and of slices the rest;
# what adds is ACCUMULATE.
MARK, COUNT, PLACE, INTEGRATE = "mark", "count", "place", "integrate"
# What keeps the rest of keys that have two words.
MARK_SECOND = "mark-second"
# Of those whose numbers are of blocks of pixels, which are read between four; what makes means of
# all of a block's.
BETWEEN, BETWEEN_SECOND, MEANS = "between", "between-second", "means"


@dataclasses.dataclass(frozen=True)
class Frame:
    """What is drawn.

    fragments : transparent ones that pass the depth test.
    pixels : of the targets.
    covered : those with fragments; None: as many as there are fragments for.
    """

    fragments: float
    pixels: float
    covered: float | None = None

    @property
    def touched(self) -> float:
        return min(self.fragments, self.pixels) if self.covered is None else self.covered


@dataclasses.dataclass(frozen=True)
class Prediction:
    """What a technique is predicted to take of a frame.

    milliseconds : by pass: "capture", "factors", "shade", "resolve"; those that it has.
    unsorted : the same of alpha blending without any order, which the scene takes in any case.
    """

    milliseconds: Mapping[str, float]
    unsorted: float

    @property
    def total(self) -> float:
        return sum(self.milliseconds.values())

    @property
    def beyond(self) -> float:
        """What the technique adds to unsorted alpha blending, as the papers' tables have it."""
        return self.total - self.unsorted


def predicted(
    technique: Technique, costs: Mapping[str, Cost], card: Card, frame: Frame
) -> Prediction | None:
    """What a technique takes of a frame on a card; None where it keeps lists of fragments.

    costs : by pass, of the card's family. Where there are both a pass for factors and one that
        does without, the one counts that is cheaper here. A pass that is missing costs nothing
        but its bytes.
    """
    targets = technique.shipped_to()
    if targets is None:
        return None
    time = _Time(card, frame)
    colour = time.fragments(0, 2 * COLOUR)
    spent: dict[str, float] = {}
    state = _state(technique, targets)
    if isinstance(targets.words, SliceWords):
        spent |= _sliced(time, costs, technique.block_side, targets, targets.words)
    elif isinstance(targets.words, ExtentWords):
        spent |= _sliced_extents(time, costs, targets, targets.words)
    elif targets.words:
        spent |= _keyed(time, costs, targets, targets.words)
    elif targets.rounds:
        spent |= _peeled(time, costs, targets)
    elif targets.samples:
        spent |= _sampled(time, costs, targets)
    elif targets.held:
        rounds = (technique.geometry_passes or 1) - bool(targets.shaded)
        blocks = technique.block_side**2
        second = sum(map(_texel, targets.second))
        written = 2 * _often(targets) * (state - second) + 2 * sum(map(_texel, targets.tail))
        means = _has_means(technique)
        one = time.fragments(_cycles(costs, ACCUMULATE), written) / (1 if means else blocks)
        spent["capture"] = one * (1 if second else max(1, rounds))
        if means:  # which read what all pixels have, one after the other
            each = _cycles(costs, MEANS) / TURNS
            spent["capture"] += time.pixels(each, state + state / blocks, frame.pixels)
        if second:
            spent["capture"] += (
                time.fragments(_cycles(costs, ACCUMULATE_SECOND), 2 * second) / blocks
            )
    own_shading = targets.rounds or targets.samples or targets.words
    if targets.shaded and not own_shading:
        written = 2 * sum(map(_texel, targets.shaded))
        if targets.held:
            spent |= _second_pass(time, costs, written, state, technique.block_side**2)
            spent["shade"] += time.pixels(0, _own_total(technique), frame.touched)
        else:
            spent["shade"] = time.fragments(_cycles(costs, ACCUMULATE), written)
    if technique.kind != "unsorted":
        read = sum(map(_texel, targets.shaded)) if targets.shaded else state
        read = sum(map(_texel, targets.tail)) + read * max(1, targets.samples)
        total = 4 if targets.held and targets.shaded else 0  # of absorbance
        spent["resolve"] = time.pixels(_cycles(costs, RESOLVE), read + total + OUTPUT, frame.pixels)
    return Prediction({name: 1e3 * one for name, one in spent.items()}, 1e3 * colour)


def _peeled(time: _Time, costs: Mapping[str, Cost], targets: Targets) -> dict[str, float]:
    """Rounds of all fragments, of which each leaves a layer that is blended under those before."""
    one = time.fragments(_cycles(costs, ACCUMULATE), 3 * DEPTH + COLOUR)
    under = time.pixels(0, COLOUR + 2 * sum(map(_texel, targets.shaded)), time.frame.pixels)
    return {"shade": targets.rounds * (one + under)}


TURNS = 8  # as which a compiler counts loops that it leaves


def _sliced(
    time: _Time, costs: Mapping[str, Cost], side: int, targets: Targets, words: SliceWords
) -> dict[str, float]:
    """Marks, and what is added to two slices, which atomics read and write; a table, made by so few
    threads that it takes as long as one; sums of each block, which is cleared, read and written;
    shading. That fragments wait for one another at a word does not count."""
    slots, blocks = words.slots, side**2
    added = 2 * 2 * WORD + 2 * sum(map(_texel, targets.held))
    marked = time.fragments(_cycles(costs, MARK), 0) + time.fragments(
        _cycles(costs, ACCUMULATE), added
    )
    turns = words.cells / 32 / TURNS
    table = time.alone(turns * (_cycles(costs, COUNT) + _cycles(costs, PLACE)))
    summed = _cycles(costs, INTEGRATE) * slots / TURNS
    sums = time.pixels(summed, 3 * WORD * slots, time.frame.pixels / blocks)
    read = 3 * WORD if blocks == 1 else 2 * 3 * WORD  # of four blocks neighbours read the same
    written = 2 * sum(map(_texel, targets.shaded))
    shaded = time.fragments(_cycles(costs, TRANSMITTANCE), written + read)
    return {"capture": _share(words, blocks) * marked, "factors": table + sums, "shade": shaded}


def _share(words: SliceWords, blocks: int) -> float:
    """Of pixels, those whose fragments are added."""
    return 1 / blocks if words.of_middle else 1.0


def _sliced_extents(
    time: _Time, costs: Mapping[str, Cost], targets: Targets, words: ExtentWords
) -> dict[str, float]:
    """Ends of pixels and two slices of each fragment, which atomics read and write; sums of each
    pixel; shading by all words of a pixel, which its fragments share, and which are cleared
    before."""
    frame, all_words = time.frame, WORD * words.all
    capture = time.fragments(_cycles(costs, MARK), 2 * 2 * WORD)
    capture += time.fragments(_cycles(costs, ACCUMULATE), 2 * 2 * WORD)
    capture += time.pixels(0, all_words, frame.pixels) + time.pixels(0, 2 * WORD, frame.touched)
    summed = _cycles(costs, INTEGRATE) * words.slots / TURNS
    sums = time.pixels(summed, 2 * WORD * words.slots, frame.pixels)
    written = 2 * sum(map(_texel, targets.shaded))
    shade = time.fragments(_cycles(costs, TRANSMITTANCE), written)
    shade += time.pixels(0, all_words, frame.touched)
    return {"capture": capture, "factors": sums, "shade": shade}


def _keyed(
    time: _Time, costs: Mapping[str, Cost], targets: Targets, keys: KeyWords
) -> dict[str, float]:
    """Keys of pixels, which atomics read and write, and their ends where there are any; what is
    added, to cells or to targets; shading, by all words of a pixel, which its fragments share, and
    which are cleared before."""
    words, kept = WORD * (keys.kept + keys.cells), WORD * keys.kept
    held = sum(map(_texel, targets.held))
    written = 2 * sum(map(_texel, targets.shaded))
    finding = [MARK, *([MARK_SECOND] if MARK_SECOND in costs else [])]
    capture = sum(time.fragments(_cycles(costs, one), 2 * kept / len(finding)) for one in finding)
    capture += time.pixels(0, words, time.frame.pixels)
    if keys.of_all:
        capture += time.more(_cycles(costs, ACCUMULATE), 2 * held)
    else:
        added = 2 * held or 2 * WORD
        capture += time.fragments(_cycles(costs, ACCUMULATE), added)
        capture += time.pixels(0, kept, time.frame.touched)
    found = {"capture": capture}
    if FUSED in costs:
        found |= _second_pass(time, costs, written, words + held, 1)
    else:
        read = time.pixels(0, words, time.frame.touched)
        found["shade"] = time.fragments(_cycles(costs, TRANSMITTANCE), written) + read
    return found


def _sampled(time: _Time, costs: Mapping[str, Cost], targets: Targets) -> dict[str, float]:
    """Depth of samples, what passes of all fragments, and colours of samples."""
    depth, colours = targets.samples * DEPTH, targets.samples * sum(map(_texel, targets.shaded))
    covered = time.fragments(_cycles(costs, COVERAGE), 2 * depth)
    total = time.fragments(_cycles(costs, ACCUMULATE), 2 * sum(map(_texel, targets.held)))
    return {"capture": covered + total, "shade": time.fragments(0, depth + 2 * colours)}


def _second_pass(
    time: _Time, costs: Mapping[str, Cost], written: int, state: float, blocks: int
) -> dict[str, float]:
    """Shading with what a pixel's numbers say, by factors or without: whichever is quicker."""
    # Numbers are read once a pixel, or a block: what a tile's fragments share stays in caches
    pixels = time.frame.touched
    read = time.pixels(0, state / blocks, pixels)
    between = _cycles(costs, BETWEEN) + _cycles(costs, BETWEEN_SECOND)
    found = []
    for name in (FUSED, TRANSMITTANCE):
        if name in costs and (name == FUSED or FACTOR not in costs):
            cycles = costs[name].cycles + between
            found.append({"shade": time.fragments(cycles, written) + read})
    if TRANSMITTANCE in costs and FACTOR in costs:
        size = costs[FACTOR].bytes or state
        if FACTOR_SECOND in costs:  # gathering a second time reads the first ones
            factors = time.pixels(costs[FACTOR].cycles, state + size, pixels / blocks)
            cycles = costs[FACTOR_SECOND].cycles + between
            factors += time.pixels(cycles, state / blocks + 2 * size, pixels)
        else:
            factors = time.pixels(costs[FACTOR].cycles + between, state / blocks + size, pixels)
        shade = time.fragments(costs[TRANSMITTANCE].cycles, written) + time.pixels(0, size, pixels)
        found.append({"factors": factors, "shade": shade})
    if not found:
        found.append({"shade": time.fragments(0, written) + read})
    return min(found, key=lambda one: sum(one.values()))


class _Time:
    """Seconds of passes."""

    def __init__(self, card: Card, frame: Frame) -> None:
        self.frame = frame
        self._instruction = CYCLES[card.family]
        self._clock = card.clock * 1e9
        self._cycle = 1 / (WAVE * card.units * card.clock * 1e9)
        self._byte = 1 / (EFFICIENCY * card.bandwidth * 1e9)

    def fragments(self, cycles: float, bytes: float) -> float:
        own = (SHADING * self._instruction + cycles) * self._cycle
        return self.frame.fragments * (own + bytes * self._byte)

    def more(self, cycles: float, bytes: float) -> float:
        """Of what a pass over fragments does beside."""
        return self.frame.fragments * (cycles * self._cycle + bytes * self._byte)

    def alone(self, cycles: float) -> float:
        """Of threads that fill no unit."""
        return cycles / self._clock

    def pixels(self, cycles: float, bytes: float, count: float) -> float:
        return count * (cycles * self._cycle + bytes * self._byte)


def _cycles(costs: Mapping[str, Cost], name: str) -> int:
    return costs[name].cycles if name in costs else 0


def _texel(target: Target) -> int:
    return texel_bytes(target.format)


def _state(technique: Technique, targets: Targets) -> float:
    """Bytes of what is captured of a pixel. Of nodes and layers those of the paper's formats: what
    moit draws, without rounding, is twice as wide."""
    if _ordered(targets) == "nodes" and technique.bits_per_pixel is not None:
        return technique.bits_per_pixel / 8
    return float(sum(map(_texel, (*targets.held, *targets.second))))


def _has_means(technique: Technique) -> bool:
    """Whether states of blocks are means of pixels', which are drawn at the picture's size."""
    return technique.block_side > 1 and not technique.draws_blocks


def _own_total(technique: Technique) -> int:
    """Bytes of a pixel's total absorbance, where that stands beside what blocks have."""
    return WORD * (technique.block_side > 1 and getattr(technique, "total", "") == "full")


def _ordered(targets: Targets) -> str:
    ordered = [one.format for one in targets.held if one.blend == "ordered"]
    if not ordered:
        return ""
    return "sums" if any(format.endswith("16") for format in ordered) else "nodes"


def _often(targets: Targets) -> float:
    return ORDERED.get(_ordered(targets), 1.0)


def bytes_of(technique: Technique) -> tuple[float | None, float | None]:
    """What is kept of a pixel beside colours; and what a fragment reads and writes of all targets,
    in all its passes. None where lists of fragments grow."""
    targets = technique.shipped_to()
    if targets is None:
        return None, None
    if isinstance(targets.words, SliceWords):
        return _bytes_of_slices(technique.block_side**2, targets, targets.words)
    if isinstance(targets.words, ExtentWords):
        return _bytes_of_extents(targets, targets.words)
    if targets.words:
        return _bytes_of_keys(targets, targets.words)
    state, side = _state(technique, targets), technique.block_side
    held = state / side**2 + _own_total(technique)
    drawn = state if _has_means(technique) else state / side**2
    held += sum(map(_texel, targets.tail))
    shaded = list(map(_texel, targets.shaded))
    if targets.rounds:  # a layer, and depths of a round and the one before
        layer = targets.rounds * (COLOUR + 3 * DEPTH)
        return float(2 * DEPTH + COLOUR), float(layer)
    if targets.samples:
        depth, colours = targets.samples * DEPTH, targets.samples * sum(shaded)
        return held + depth, 2 * (held + colours) + 3 * depth
    drawn += sum(map(_texel, targets.tail))
    return held + sum(shaded[1:]), 2 * (drawn + sum(shaded))


def _bytes_of_keys(targets: Targets, keys: KeyWords) -> tuple[float, float]:
    words, kept = WORD * (keys.kept + keys.cells), WORD * keys.kept
    shaded, held = ([_texel(one) for one in part] for part in (targets.shaded, targets.held))
    added = WORD if keys.cells else sum(held)
    moved = 2 * (kept + added) + words + sum(held) + 2 * sum(shaded)
    return float(words + sum(held) + sum(shaded[1:])), float(moved)


def _bytes_of_slices(blocks: int, targets: Targets, words: SliceWords) -> tuple[float, float]:
    """As they are while fragments are added, in words of 32 bits."""
    totals = [*targets.held, *targets.shaded[1:]]
    moved = 2 * 2 * WORD * _share(words, blocks) + 3 * WORD
    moved += 2 * sum(map(_texel, (*targets.held, *targets.shaded)))
    return WORD * words.slots / blocks + sum(map(_texel, totals)), moved


def _bytes_of_extents(targets: Targets, words: ExtentWords) -> tuple[float, float]:
    """As they are while fragments are added. A fragment finds where its pixel begins and ends,
    reads that twice again, changes two slices, and reads six sums."""
    shaded = list(map(_texel, targets.shaded))
    moved = WORD * (2 * 2 + 2 + 2 * 2 + 2 + 6) + 2 * sum(shaded)
    return float(WORD * words.all + sum(shaded[1:])), float(moved)
