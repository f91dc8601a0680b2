"""The page of a frontier."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from moit.catalog import Technique
from moit.catalog.palette import technique_colours
from moit.comparing.rows import Row
from moit.gpu_costs.predicting import on_gpu
from moit.judging.draws import PAN, SETS
from moit.judging.findings import Findings
from moit.judging.fronts import AFFORDED, PASSES, WORDS, Means, falling, front, known
from moit.judging.measuring import JUMP, ORDERS, STILL, size_name
from moit.judging.registry import aims, registry
from moit.judging.sentences import COUNTS, brief, paragraphs
from moit.reports.blocks import Block, Heading, Paragraph, Plot
from moit.reports.charts import ErrorChart, Point
from moit.reports.columns import plain_number
from moit.reports.tables import Table

CHART = (820, 420)
ON_PIXEL = 8  # fragments, of frames that are predicted
PIXELS = 1920 * 1080
SHOWN = 3.0  # times the error of the best of fewer bytes: what is farther off is not in charts
KINDS = {
    "tune": "the tuning draw, on which constants may be chosen: no number of it is for a page",
    "check": "the checking draw: choices between a few may have been made on it",
    "final": "the final draw of this version, on which nothing was chosen",
}


def blocks_of(found: Findings) -> Iterator[Block]:
    yield Heading(1, "The frontier")
    yield Paragraph(_marks(found))
    if len(found.techniques) > 1:
        yield Heading(2, "What to take")
        yield Paragraph(
            "Generated from the numbers below: for each number of bytes, what a pixel keeps beside "
            "one colour accumulator, what errs least, by what a GPU has to offer. FLIP is the mean "
            "over scenes, in brackets the interval in which 95 % of such means over other scenes "
            "would lie."
        )
        yield from map(Paragraph, paragraphs(found))
        yield from _charts(found)
    yield Heading(2, "Pictures")
    yield Paragraph(
        "Means over scenes. A star: nothing that keeps no more errs less, whatever it needs. GPU "
        f"ms: what a frame with {ON_PIXEL} fragments a pixel is predicted to take on {on_gpu()}, "
        "by the costs that a driver's compiler gives (docs/gpu_costs.md); -: not known. Flicker, "
        "in ten-thousandths, and jumps, in thousandths of pixels, as of rays below: of scenes of "
        f"triangles, at the first size, past which the camera goes {PAN:g} of a pixel in a frame."
    )
    yield _pictures(found)
    yield Heading(2, "Rays")
    yield Paragraph(_rays_words())
    yield _rays(found)
    failed = [row for row in found.rows if row["note"]]
    if failed:
        yield Heading(2, "What could not be measured")
        yield Table(
            ["technique", "why"], [[row["technique"], row["note"]] for row in failed], [True, True]
        )
    yield from _aims(found)
    yield Heading(2, "What was tuned on what")
    yield Paragraph(
        "Rules and constants of moit's own were chosen among variants, on draws other than that of "
        "this page."
    )
    yield Table(
        ["technique", "what", "draw", "variants"],
        [[one.technique, one.what, one.draw, str(one.variants)] for one in registry()],
        [True, True, True, False],
    )


def _marks(found: Findings) -> str:
    from moit.system.version import VERSION

    draw = found.draw
    variants = sum(one.variants for one in registry())
    sizes = " and ".join(size_name(size) for size in found.sizes)
    seed = "" if draw.kind == "final" or not draw.seed else f" --seed {draw.seed}"
    return (
        f"`moit experiment frontier --draw {draw.kind} --size {found.size}{seed}`, moit {VERSION}, "
        f"{len(found.techniques)} techniques. This is {KINDS[draw.kind]}: rays of seed "
        f"{draw.seed}, scenes of seed {draw.scene_seed} at {sizes}. {variants} variants were tried "
        "on other draws (at the end of the page)."
    )


def _charts(found: Findings) -> Iterator[Block]:
    yield Heading(2, "Error over bytes")
    yield Paragraph(
        "Filled, by name and joined by a line: what nothing beats that needs no more access. What "
        f"keeps nothing, or errs {SHOWN:g} times as much as something that keeps no more, is left "
        "out."
    )
    for passes in PASSES:
        rows = [row for row in known(found.rows, "flip") if Means(passes).allow(row)]
        if rows:
            title = f"In up to {COUNTS[passes]}" if passes > 1 else "In one pass"
            yield Plot(f"frontier-{passes}", title, chart(rows, passes), CHART)


def chart(rows: Sequence[Row], passes: int, by: str = "flip") -> ErrorChart:
    """Error over bytes in so many passes, with a front for each access."""
    fronts = {access: front(rows, Means(passes, access), by) for access in AFFORDED}
    shown = [
        row
        for row in rows
        if row["bytes"]
        and row[by] <= SHOWN * min(r[by] for r in rows if r["bytes"] <= row["bytes"])
    ]
    colours = technique_colours([row["technique"] for row in shown])
    points = [
        Point(
            brief(row["technique"]),
            row["bytes"],
            row[by],
            colour,
            row["technique"],
            row in falling([r for r in shown if r["access"] == row["access"]], by)
            and row in fronts[row["access"]],
            WORDS[row["access"]],
            row["technique"],
        )
        for row, colour in zip(shown, colours, strict=True)
    ]
    groups = tuple(WORDS[access] for access in AFFORDED)
    return ErrorChart(points, "bytes a pixel", "mean FLIP", "bits", groups=groups)


def gpu_time(one: Technique) -> str:
    """Milliseconds of a frame, as the page's table has them; "-" where no costs are known."""
    return _number(on_gpu().milliseconds(one, ON_PIXEL * PIXELS, PIXELS))


def _pictures(found: Findings) -> Table:
    """By access and bytes; a star at what errs least of all that keep no more, by any means."""
    by_name = {str(one): one for one in found.techniques}
    rows = _ordered(found.rows)
    best = [row["technique"] for row in falling(known(rows, "flip"), "flip")]
    columns = [f"{one}_{size_name(size)}" for size in found.sizes for one in ("flip", "rmse")]
    heads = [f"{name} {size_name(size)}" for size in found.sizes for name in ("FLIP", "RMSE")]
    heads += ["flicker", "jumps"]
    cells = [
        [
            f"`{row['technique']}`" + (" *" if row["technique"] in best else ""),
            _bytes(row["bytes"]),
            _number(row["passes"]),
            row["access"],
            gpu_time(one),
            *(_with_interval(row, column) for column in columns),
            _number(row["pan_flicker"], 1e4),
            _number(row["pan_jumps"], 1e3),
        ]
        for row in rows
        for one in [by_name[row["technique"]]]
    ]
    return Table(
        ["technique", "bytes", "passes", "access", "GPU ms", *heads],
        cells,
        [True, False, False, True, *[False] * (1 + len(heads))],
        [row["access"] for row in rows],
    )


def _rays_words() -> str:
    sets = ", ".join(f"{letter} {name}" for letter, name in SETS.items())
    return (
        f"Sets of rays (moit.neural.data, without ties in depth): {sets}. Colours: root mean "
        "square error over black. Then means over the sets: T, the root mean square error of the "
        "transmittance before fragments; order, how far colours lie from their mean over "
        f"{ORDERS} orders of arrival; flicker, the root mean square of the change in a frame, in "
        f"ten-thousandths, where the exact picture changes by less than {STILL:g} while fragments "
        f"move by a thousandth of the range; jumps, how many of a thousand such pixels change by "
        f"more than {JUMP:g}. What blocks of pixels share has no rays: these have no neighbours."
    )


def _rays(found: Findings) -> Table:
    rows = _ordered(known(found.rows, "mean_colour"))
    cells = [
        [
            f"`{row['technique']}`",
            _bytes(row["bytes"]),
            *(_number(row[f"{letter}_colour"]) for letter in SETS),
            _with_interval(row, "mean_colour"),
            _number(row["mean_T"]),
            _number(row["mean_order"]),
            _number(row["mean_flicker"], 1e4),
            _number(row["mean_jumps"], 1e3),
        ]
        for row in rows
    ]
    heads = ["technique", "bytes", *SETS, "mean", "T", "order", "flicker", "jumps"]
    return Table(heads, cells, [True, *[False] * (len(heads) - 1)], [row["access"] for row in rows])


def _aims(found: Findings) -> Iterator[Block]:
    """What was aimed at beside what was found, of techniques that were judged."""
    rows = {row["technique"]: row for row in found.rows}
    cells = []
    for one in aims():
        value = rows.get(one.technique, Row()).get(one.measure)
        if value is not None:
            aim = "-" if one.aim is None else _number(one.aim)
            numbers = [_number(one.floor), aim, _number(value)]
            measure = one.measure.replace("_", " ").replace("flip", "FLIP")
            cells.append([f"`{one.technique}`", measure, *numbers, one.verdict(value)])
    if cells:
        yield Heading(2, "What was aimed at")
        yield Paragraph("Errors that were not to be exceeded, set before this draw was looked at.")
        heads = ["technique", "measure", "floor", "aim", "found", "verdict"]
        sides = [True, True, False, False, False, True]
        yield Table(heads, cells, sides, [row[0] for row in cells])


def _ordered(rows: Sequence[Row]) -> list[Row]:
    return sorted(rows, key=lambda row: (_rank(row), row["bytes"] or 0, row["technique"]))


def _rank(row: Row) -> int:
    access = row["access"]
    return AFFORDED.index(access) if access in AFFORDED else len(AFFORDED)


def _with_interval(row: Row, column: str) -> str:
    if row[column] is None:
        return "-"
    low, high = (_number(row[f"{column}_{end}"]) for end in ("low", "high"))
    return f"{_number(row[column])} ({low} to {high})"


def _bytes(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _number(value: float | None, factor: float = 1) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else plain_number(value * factor, 3)
