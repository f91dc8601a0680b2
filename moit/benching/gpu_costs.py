"""What shaders cost on GPUs that need not be here, and what that comes to in a frame: tables."""

from __future__ import annotations

from collections.abc import Iterable

from moit.catalog import technique
from moit.gpu_costs.cards import CARDS, Card
from moit.gpu_costs.cost import Cost
from moit.gpu_costs.frames import (
    ACCUMULATE,
    ACCUMULATE_SECOND,
    BETWEEN,
    BETWEEN_SECOND,
    COVERAGE,
    FACTOR,
    FACTOR_SECOND,
    FUSED,
    RESOLVE,
    TRANSMITTANCE,
    Frame,
    bytes_of,
    predicted,
)
from moit.gpu_costs.stored import ENGINE, EXACT, PUBLISHED, Costs
from moit.reports.tables import Table, markdown_table

SECOND = (ACCUMULATE_SECOND, FACTOR_SECOND)
PASSES = (ACCUMULATE, COVERAGE, FACTOR, *SECOND, TRANSMITTANCE, FUSED, RESOLVE)
MANY = 4.5  # fragments a pixel, as MBOIT's teapots have

# Table 1 of MBOIT: milliseconds of pass 1, of pass 2, and of both beyond alpha blending, of the
# teapots and of the ship, drawn at 1920 x 1080 on a GeForce GTX 1080 Ti.
FRAMES = {"teapots": Frame(9.4e6, 1920 * 1080), "ship": Frame(18.7e6, 1920 * 1080)}
TABLE_1: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "wboit(bits=16,weight='phenomenological')": ((0.85, 0.07, 0.10), (1.6, 0.06, 0.16)),
    "power4-16": ((0.94, 1.0, 1.2), (2.0, 1.8, 2.3)),
    "mlab2": ((2.0, 0.13, 1.4), (3.9, 0.11, 2.6)),
    "power4": ((1.2, 1.0, 1.5), (2.3, 1.8, 2.7)),
    "power6-16": ((1.2, 1.1, 1.6), (2.3, 2.2, 3.1)),
    "adaptive4": ((1.6, 0.94, 1.8), (3.0, 1.8, 3.3)),
    "power6": ((1.6, 1.2, 2.1), (3.1, 2.2, 3.8)),
    "trig3-16": ((1.2, 1.7, 2.2), (2.3, 3.2, 4.2)),
    "trig3": ((1.6, 1.7, 2.6), (3.1, 3.2, 4.9)),
    "mlab4": ((3.4, 0.22, 2.8), (6.6, 0.20, 5.3)),
    "trig4-16": ((1.3, 2.4, 3.0), (2.9, 4.5, 5.7)),
    "trig4": ((1.9, 2.4, 3.6), (3.6, 4.8, 6.8)),
}
ALPHA_BLENDING = (0.79, 1.4)


def costs_table(costs: Costs, family: str) -> str:
    """Markdown: cycles a wave of each pass, registers, bytes, and how dear ours are beside those
    that were published."""
    head = ["technique", "text", *PASSES, "instructions", "registers", "bytes a pixel"]
    head += ["a fragment", f"{MANY:g} a pixel", "of published"]
    rows = []
    for text in (ENGINE, PUBLISHED, EXACT):
        for name in costs.techniques(text):
            passes = costs.passes(name, family, text)
            if passes is None:
                continue
            state, fragment = bytes_of(technique(name))
            total = fragment_cycles(passes, MANY)
            published = costs.nearest(technique(name), family, (PUBLISHED,))
            # what is published gathers once
            against = published[2] if published and FACTOR_SECOND not in passes else None
            rows.append(
                [
                    f"`{name}`",
                    text,
                    *(str(passes[one].cycles) if one in passes else "" for one in PASSES),
                    str(sum(one.instructions for one in passes.values())),
                    str(max(one.registers for one in passes.values())),
                    "" if state is None else f"{state:g}",
                    "" if fragment is None else f"{fragment:g}",
                    f"{total:.0f}",
                    f"{total / fragment_cycles(against, MANY):.2f}"
                    if against and text != PUBLISHED
                    else "",
                ]
            )
    return markdown_table(Table(head, rows, [True, True] + [False] * (len(head) - 2)))


def fragment_cycles(passes: dict[str, Cost], fragments: float) -> float:
    """Cycles a wave of pixels with so many fragments: of pass 2, with its factors where it has any
    and where that is cheaper than to do without; of pass 1 where there is no other. What reads
    between blocks of pixels counts with what reads their numbers."""
    found = []
    between = sum(passes[one].cycles for one in (BETWEEN, BETWEEN_SECOND) if one in passes)
    if TRANSMITTANCE in passes:
        once = sum(passes[one].cycles for one in (FACTOR, FACTOR_SECOND) if one in passes)
        each = [passes[one].cycles for one in (ACCUMULATE_SECOND, TRANSMITTANCE) if one in passes]
        found.append(once + between + fragments * sum(each))
    if FUSED in passes:
        found.append(fragments * (passes[FUSED].cycles + between))
    first = [passes[one].cycles for one in (COVERAGE, ACCUMULATE) if one in passes]
    return min(found) if found else fragments * sum(first)


def frames_table(costs: Costs, card: Card, frame: Frame, names: Iterable[str]) -> str:
    """Markdown: what techniques are predicted to take of a frame, quickest first."""
    found = []
    for name in names:
        one = technique(name)
        cost = costs.nearest(one, card.family)
        guess = predicted(one, cost[2] if cost else {}, card, frame) if cost else None
        if cost and guess:
            found.append((guess.total, name, cost[0], guess))
    head = ["technique", "text", "capture", "factors", "shade", "resolve", "all", "beyond unsorted"]
    rows = [
        [
            f"`{name}`",
            text,
            *(
                f"{guess.milliseconds[one]:.3g}" if one in guess.milliseconds else ""
                for one in head[2:6]
            ),
            f"{total:.3g}",
            f"{guess.beyond:.3g}",
        ]
        for total, name, text, guess in sorted(found, key=lambda row: row[:2])
    ]
    return markdown_table(Table(head, rows, [True, True] + [False] * 6))


def published_check(costs: Costs) -> list[tuple[str, str, float, float]]:
    """MBOIT's table 1 by the model: scene, technique, milliseconds beyond alpha blending that were
    predicted of the published passes, and that were measured."""
    card = CARDS["gtx1080ti"]
    found = []
    for i, (scene, frame) in enumerate(FRAMES.items()):
        for name, measured in TABLE_1.items():
            one = technique(name)
            passes = costs.nearest(one, card.family, (PUBLISHED,))
            guess = predicted(one, passes[2], card, frame) if passes else None
            if guess:
                found.append((scene, name, guess.beyond, measured[i][2]))
    return found


def check_table(costs: Costs) -> str:
    """The same as Markdown."""
    found = published_check(costs)
    rows = [
        [f"`{name}`", scene, f"{guess:.2f}", f"{true:.2f}", f"{guess / true:.2f}"]
        for scene, name, guess, true in found
    ]
    head = ["technique", "scene", "predicted", "measured", "ratio"]
    return markdown_table(Table(head, rows, [True, True, False, False, False]))


def report(costs: Costs, card: Card, frame: Frame) -> str:
    """Markdown: costs by family, a frame on a card, and the model against a paper."""
    stands = "" if card.own else f", for which {card.family} stands as the nearest"
    parts = [
        "# What shaders cost, by a compiler",
        f"Cycles for which a wave of 64 keeps its unit busy, by Mesa's radv {costs.driver} for "
        f"GPUs of no hardware, of SPIR-V by glslang {costs.glslang}; moit {costs.moit}. `factor` "
        f"and `resolve` are once a pixel, the others once a fragment; `fused` has none. "
        f"Texts: ours for engines; the published passes, written plainly; and ours that are exact "
        f"to the core's bits, in double, of which loops and branches are counted as some turns.",
    ]
    for family in costs.families:
        parts += [f"## {family}", costs_table(costs, family)]
    names = dict.fromkeys((*costs.techniques(ENGINE), *costs.techniques(PUBLISHED)))
    parts += [
        f"## Predicted: a frame on a {card.title}",
        f"{frame.fragments:,.0f} fragments on {frame.pixels:,.0f} pixels; {card.units} units at "
        f"{card.clock:g} GHz, {card.bandwidth:g} GB/s{stands}. Milliseconds by a model, not "
        f"measured.",
        frames_table(costs, card, frame, names),
    ]
    if "navi21" in costs.families:
        parts += [
            "## The model against a paper",
            "Milliseconds beyond alpha blending: predicted of the published passes, and measured "
            "(table 1 of Moment-Based Order-Independent Transparency, GeForce GTX 1080 Ti).",
            check_table(costs),
        ]
    return "\n\n".join(parts) + "\n"
