"""The HTML page of a stability report: one file that needs no other and no network."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from moit.comparing.report import Row, exact
from moit.numerics.hard_cases import FAMILIES
from moit.numerics.report import (
    COLUMNS,
    NUMBERS,
    PRECISIONS,
    WORDS,
    StabilityReport,
    heading,
    shown,
)
from moit.reports.charts import Series, colours, dial_chart
from moit.reports.page import html_page

OF_WORST = ("technique", "precision", *NUMBERS)

# What is drawn over each dial, where any technique has it, and what is as good as 0 there.
MEASURES = {
    "T_p99": ("error of T, 99 %", 1e-4),
    "own_p99": ("own error, 99 %", 1e-17),
    "jump": ("jump", 1e-6),
    "bias_needed": ("bias needed", 1e-17),
}


def page(report: StabilityReport, title: str) -> str:
    """The page's text."""
    names = list(dict.fromkeys(row["technique"] for row in report.rows))
    palette = dict(zip(names, colours(len(names)), strict=True))
    keys = {name: str(i) for i, name in enumerate(names)}
    sections = "".join(_family(report, name, palette, keys) for name in report.families)
    body = f"""<h2>The worst of each technique</h2>
<p class="faint">{escape(_HOW_TO_READ)}</p>
<div class="wide">{_table(report.worst(), OF_WORST, palette, keys)}</div>
{sections}"""
    links = {name: name for name in report.families}
    return html_page(title, report.machine, links, body, ("dials.js",))


_HOW_TO_READ = (
    "Over all families and settings of their dials. T: error of the transmittance in front of each "
    "fragment against the exact one. Own: the same against the technique itself in unlimited "
    "precision and without bias. NaN: transmittances and pixels that are not finite. Jump: what "
    "another order of arrival, or a small step of one surface, changes beyond what it should. Of "
    "moments: the least pivot of their matrix without and with bias (biased), the share of rays "
    "whose stored moments are not positive definite without it (invalid), the technique's bias, "
    "and the least that makes all valid (needed). Click a heading to sort, a technique to see its "
    "curves."
)


def worst_table(report: StabilityReport) -> str:
    """One small <table> for notebooks."""
    return _plain_table(report.worst(), OF_WORST)


def _table(
    rows: list[Row], columns: tuple[str, ...], palette: dict[str, str], keys: dict[str, str]
) -> str:
    columns = tuple(c for c in columns if any(row[c] not in (None, "") for row in rows))
    head = "".join(
        f"<th{_word(column)}><button>{escape(heading(column))}</button></th>" for column in columns
    )
    body = []
    for row in rows:
        cells = []
        for column in columns:
            value = row[column]
            text, full = escape(shown(column, value)), escape(exact(value))
            if column == "technique":
                text = f'<span class="dot" style="background:{palette[value]}"></span>{text}'
                if row["note"]:
                    text += f'<div class="note">{escape(row["note"])}</div>'
            cells.append(f'<td{_word(column)} data-value="{full}" title="{full}">{text}</td>')
        body.append(f'<tr data-key="{keys[row["technique"]]}">{"".join(cells)}</tr>')
    return (
        f'<table class="sortable"><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table>"
    )


def _plain_table(rows: list[Row], columns: tuple[str, ...]) -> str:
    """Numbers alone, to look them up."""

    def line(tag: str, texts: list[str]) -> str:
        cells = zip(columns, texts, strict=True)
        return "".join(f"<{tag}{_word(c)}>{escape(text)}</{tag}>" for c, text in cells)

    head = line("th", [heading(column) for column in columns])
    body = "".join(
        f"<tr>{line('td', [shown(column, row[column]) for column in columns])}</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _word(column: str) -> str:
    return ' class="word"' if column in WORDS else ""


def _family(
    report: StabilityReport, name: str, palette: dict[str, str], keys: dict[str, str]
) -> str:
    rows = report.of_family(name)
    known = FAMILIES.get(name)
    dial = known.dial if known else "dial"
    about = f'<p class="faint">{escape(known.about)}</p>' if known else ""
    names = list(dict.fromkeys(row["technique"] for row in rows))
    legend = "".join(
        f'<span data-key="{keys[one]}"><span class="dot" style="background:{palette[one]}"></span>'
        f"{escape(one)}</span>"
        for one in names
    )
    charts = "".join(
        _charts(rows, measure, words, least, dial, palette, keys)
        for measure, (words, least) in MEASURES.items()
    )
    columns = tuple(column for column in COLUMNS if column not in ("family", "note"))
    return (
        f'<section><h2 id="{escape(name)}">{escape(name)}</h2>{about}{charts}'
        f'<div class="legend">{legend}</div><details><summary>All numbers</summary>'
        f'<div class="wide">{_plain_table(rows, columns)}</div></details></section>'
    )


def _charts(
    rows: list[Row],
    measure: str,
    words: str,
    least: float,
    dial: str,
    palette: dict[str, str],
    keys: dict[str, str],
) -> str:
    """A chart per precision, all of one scale."""
    if not any(row[measure] is not None for row in rows):
        return ""
    values = list(dict.fromkeys(row["dial"] for row in rows))
    found = [row[measure] for row in rows if row[measure] is not None]
    charts = []
    for precision in PRECISIONS:
        of_names: dict[str, dict[float, float]] = {}
        for row in rows:
            if row["precision"] == precision and row[measure] is not None:
                of_names.setdefault(row["technique"], {})[row["dial"]] = row[measure]
        series = [
            Series(
                name,
                np.array([at.get(value, math.nan) for value in values]),
                palette[name],
                keys[name],
            )
            for name, at in of_names.items()
        ]
        if series:
            chart = dial_chart(values, series, dial, found, least)
            charts.append(f"<div><h3>{escape(precision)}: {escape(words)}</h3>{chart}</div>")
    return f'<div class="plots three">{"".join(charts)}</div>'
