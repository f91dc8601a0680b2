"""The tables of gpu_costs.md, by the costs that come with moit: python docs/gpu_costs.py

After `moit bench --gpu-cost -o moit/gpu_costs/costs.json` and a build. tests/test_gpu_costs.py says
when the page is old.
"""

from pathlib import Path

from moit.benching.gpu_costs import TABLE_1, costs_table, published_check
from moit.catalog import technique
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.frames import Frame, predicted
from moit.gpu_costs.stored import ENGINE, PUBLISHED, stored
from moit.reports.tables import Table, markdown_table
from moit.system.files import write_text

PAGE = Path(__file__).with_suffix(".md")
COMPARED = ("power4", "power6", "power8", "trig2", "trig3", "trig4")
DENSITIES = (1, 4.5, 9, 16, 32)  # fragments a pixel
CARD = "rx6800"


def paper() -> str:
    """Predicted / measured, of both scenes."""
    found = {(scene, name): (guess, true) for scene, name, guess, true in published_check(stored())}
    rows = [
        [
            f"`{name}`",
            *("{:.2f} / {:g}".format(*found[scene, name]) for scene in ("teapots", "ship")),
        ]
        for name in TABLE_1
    ]
    return markdown_table(Table(["", "teapots", "ship"], rows, [True, False, False]))


def frames() -> str:
    """Whole frames by ours over those by the published passes."""
    rows = []
    for name in COMPARED:
        cells = [f"`{name}`"]
        for density in DENSITIES:
            frame, card = Frame(density * 1920 * 1080, 1920 * 1080), CARDS[CARD]
            passes = [stored().passes(name, card.family, text) for text in (ENGINE, PUBLISHED)]
            if passes[0] is None:
                break
            ours, theirs = (predicted(technique(name), one, card, frame) for one in passes)
            with_factors = " f" * ("factors" in ours.milliseconds)
            cells.append(f"{ours.total / theirs.total:.2f}{with_factors}")
        else:
            rows.append(cells)
    head = ["fragments a pixel", *(f"{density:g}" for density in DENSITIES)]
    return markdown_table(Table(head, rows, [True] + [False] * len(DENSITIES)))


def cards() -> str:
    rows = [
        [
            f"`{one.name}`",
            one.title,
            one.family + ("" if one.own else ", nearest"),
            *(f"{number:g}" for number in (one.units, one.clock, one.bandwidth)),
        ]
        for one in CARDS.values()
    ]
    head = ["name", "", "family", "units", "GHz", "GB/s"]
    return markdown_table(Table(head, rows, [True] * 3 + [False] * 3))


def page(text: str) -> str:
    """A page with each table in place of what stands between its marks."""
    tables = {"paper": paper(), "frames": frames(), "cards": cards()}
    tables |= {family: costs_table(stored(), family) for family in stored().families}
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}{table}\n{end}{after}"
    return text


if __name__ == "__main__":
    write_text(PAGE, page(PAGE.read_text(encoding="utf-8")))
