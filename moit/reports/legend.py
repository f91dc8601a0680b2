"""A legend as HTML, below or between the charts that it is of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from moit.reports.charts import on_page
from moit.reports.svg import DASHES


@dataclass(frozen=True)
class Entry:
    """How a name is drawn. `key` marks it for the page's script; "" where nothing follows it."""

    name: str
    colour: str
    line: str = "solid"
    key: str = ""


def legend(entries: Sequence[Entry]) -> str:
    """Names beside their lines."""
    items = []
    for one in entries:
        key = f' data-key="{escape(one.key)}"' if one.key else ""
        items.append(f"<li{key}>{_swatch(one)}{escape(one.name)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


def _swatch(one: Entry) -> str:
    return (
        '<svg width="26" height="8" viewBox="0 0 26 8" aria-hidden="true"><path d="M1 4h24" '
        f'stroke="{on_page(one.colour)}" stroke-width="2.5"{DASHES[one.line]}/></svg>'
    )
