"""The HTML page of a stability report: one file that needs no other and no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from moit.catalog.palette import Look, technique_looks
from moit.comparing.rows import Row
from moit.numerics.charts import MEASURES, dial_chart
from moit.numerics.columns import COLUMNS, NUMBERS, PRECISIONS, table, worst
from moit.numerics.hard_cases import FAMILIES
from moit.reports.legend import Entry, legend
from moit.reports.page import html_page
from moit.reports.svg import svg
from moit.reports.tables import html_table

OF_WORST = ("technique", "precision", *NUMBERS)


def page(rows: Sequence[Row], machine: str, title: str) -> str:
    """The page's text."""
    names = list(dict.fromkeys(row["technique"] for row in rows))
    palette = dict(zip(names, technique_looks(names), strict=True))
    colours = {name: look.colour for name, look in palette.items()}
    keys = {name: str(i) for i, name in enumerate(names)}
    found = worst(rows)
    columns = [c for c in OF_WORST if any(row[c] not in (None, "") for row in found)]
    families: dict[str, list[Row]] = {}
    for row in rows:
        families.setdefault(row["family"], []).append(row)
    sections = "".join(_family(name, own, palette, keys) for name, own in families.items())
    body = f"""<h2>The worst of each technique</h2>
<p class="faint">{escape(_HOW_TO_READ)}</p>
<div class="wide">{html_table(table(found, columns, colours, keys), page=True)}</div>
{sections}"""
    return html_page(title, machine, {name: name for name in families}, body, ("dials.js",))


_HOW_TO_READ = (
    "Over all families and settings of their dials. T: error of the transmittance in front of each "
    "fragment against the exact one. Own: the same against the technique itself in unlimited "
    "precision and without bias. Brightness: how far a pixel's weights are from summing to what is "
    "covered. NaN: transmittances and pixels that are not finite. Jump: what another order of "
    "arrival, or a small step of one surface, changes beyond what it should. Of moments: the least "
    "pivot of their matrix without and with bias (biased), the share of rays whose stored moments "
    "are not positive definite without it (invalid), the technique's bias, and the least that "
    "makes all valid (needed). Click a heading to sort, a technique to see its curves."
)


def _family(name: str, rows: list[Row], palette: dict[str, Look], keys: dict[str, str]) -> str:
    known = FAMILIES.get(name)
    about = f'<p class="faint">{escape(known.about)}</p>' if known else ""
    names = list(dict.fromkeys(row["technique"] for row in rows))
    entries = [Entry(one, palette[one].colour, palette[one].line, keys[one]) for one in names]
    charts = "".join(
        _charts(rows, measure, words, palette, keys) for measure, (words, _) in MEASURES.items()
    )
    columns = tuple(column for column in COLUMNS if column not in ("family", "note"))
    return (
        f'<section><h2 id="{escape(name)}">{escape(name)}</h2>{about}{charts}'
        f"{legend(entries)}<details><summary>All numbers</summary>"
        f'<div class="wide">{html_table(table(rows, columns), page=True)}</div></details></section>'
    )


def _charts(
    rows: list[Row], measure: str, words: str, palette: dict[str, Look], keys: dict[str, str]
) -> str:
    """A chart per precision, all of one scale."""
    colours = {name: look.colour for name, look in palette.items()}
    lines = {name: look.line for name, look in palette.items()}
    charts = []
    for precision in PRECISIONS:
        shown = {precision: "solid"}
        chart = dial_chart(rows, measure, colours, keys, shown, lines)
        if chart.series:
            drawn = svg(chart, (420, 250))
            charts.append(f"<div><h3>{escape(precision)}: {escape(words)}</h3>{drawn}</div>")
    return f'<div class="plots three">{"".join(charts)}</div>' if charts else ""
