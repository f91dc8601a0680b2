"""Tables, and their writers: text for a terminal, Markdown, HTML, LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from moit.reports.charts import on_page


@dataclass(frozen=True)
class Cell:
    """A field of a table that a page can sort.

    exact : all digits, shown where one points at it. colour : of a dot before the text.
    note : below the text. best : of its group.
    """

    text: str
    exact: str = ""
    colour: str = ""
    note: str = ""
    best: bool = False


@dataclass(frozen=True)
class Table:
    """Cells below headings.

    words : which columns are texts. groups : a line is drawn where it changes; (): nowhere.
    hints : what headings say where one points at them. keys : mark rows for the page's script.
    listed : lines that a terminal, which has no room for long texts, shows instead.
    """

    heads: Sequence[str]
    cells: Sequence[Sequence[str | Cell]]
    words: Sequence[bool]
    groups: Sequence[object] = ()
    hints: Sequence[str] = ()
    keys: Sequence[str] = ()
    listed: Sequence[str] = ()

    @property
    def texts(self) -> list[list[str]]:
        return [[one.text if isinstance(one, Cell) else one for one in row] for row in self.cells]

    def starts_group(self, i: int) -> bool:
        """Whether a row begins a group that is not the first."""
        return bool(i and self.groups and self.groups[i] != self.groups[i - 1])


def text_table(table: Table) -> str:
    """Lines of columns: words to the left, numbers to the right, a blank line between groups."""
    if table.listed:
        return "\n".join(table.listed)
    cells = table.texts
    widths = [max(map(len, column)) for column in zip(table.heads, *cells, strict=True)]

    def line(texts: Sequence[str]) -> str:
        padded = (
            f"{text:<{width}}" if is_word else f"{text:>{width}}"
            for is_word, text, width in zip(table.words, texts, widths, strict=True)
        )
        return "  ".join(padded).rstrip()

    lines = [line(table.heads), line(["-" * width for width in widths])]
    for i, texts in enumerate(cells):
        lines += [""] * table.starts_group(i) + [line(texts)]
    return "\n".join(lines)


def markdown_table(table: Table, padded: bool = False) -> str:
    """padded : columns are aligned, for those who read it as it stands. The best is bold."""

    def marked(one: str | Cell) -> str:
        text = (one if isinstance(one, str) else one.text).replace("|", "\\|")
        return f"**{text}**" if isinstance(one, Cell) and one.best else text

    lines = [list(map(marked, row)) for row in (table.heads, *table.cells)]
    widths = [max(map(len, column)) if padded else 2 for column in zip(*lines, strict=True)]
    rule = [
        f":{'-' * (width - padded)}" if is_word else f"{'-' * (width - padded)}:"
        for is_word, width in zip(table.words, widths, strict=True)
    ]
    lines.insert(1, rule)
    if padded:
        lines = [[f"{t:<{w}}" for t, w in zip(row, widths, strict=True)] for row in lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in lines)


LATEX = {
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def latex_table(table: Table) -> str:
    """A tabular with the rules of booktabs; the best is bold, "-" is a dash."""

    def escaped(text: str) -> str:
        power = re.fullmatch(r"(-?[0-9.]+)e(-?[0-9]+)", text)
        if power:
            return rf"{power[1]}\times10^{{{power[2]}}}"
        return "--" if text == "-" else "".join(LATEX.get(letter, letter) for letter in text)

    def cell(one: str | Cell) -> str:
        text = escaped(one if isinstance(one, str) else one.text)
        best, is_power = isinstance(one, Cell) and one.best, r"\times" in text
        if is_power:
            return rf"$\mathbf{{{text}}}$" if best else f"${text}$"
        return rf"\textbf{{{text}}}" if best else text

    lines = [rf"\begin{{tabular}}{{{''.join('l' if word else 'r' for word in table.words)}}}"]
    lines += [r"\toprule", " & ".join(map(cell, table.heads)) + r" \\", r"\midrule"]
    for i, row in enumerate(table.cells):
        lines += [r"\midrule"] * table.starts_group(i) + [" & ".join(map(cell, row)) + r" \\"]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def html_table(table: Table, page: bool = False) -> str:
    """One <table>, everything escaped.

    page : for our pages, whose style sheet and script know what is a word, the best and what to
        sort by; else each cell says its side itself, for notebooks.
    """
    hints = table.hints or [""] * len(table.heads)

    def attributes(is_word: bool, hint: str = "", best: bool = False) -> str:
        if page:
            kind = "best" if best else "word" if is_word else ""
            said = f' class="{kind}"' if kind else ""
        else:
            said = f' style="text-align:{"left" if is_word else "right"}"'
        return said + (f' title="{escape(hint)}"' if hint else "")

    def cell(is_word: bool, one: str | Cell) -> str:
        if isinstance(one, str):
            return f"<td{attributes(is_word)}>{escape(one)}</td>"
        dot = (
            f'<span class="dot" style="background:{on_page(one.colour)}"></span>'
            if one.colour
            else ""
        )
        note = f'<div class="note">{escape(one.note)}</div>' if one.note else ""
        full = escape(one.exact)
        said = f'{attributes(is_word, best=one.best)} data-value="{full}" title="{full}"'
        return f"<td{said}>{dot}{escape(one.text)}{note}</td>"

    sortable = any(isinstance(one, Cell) for row in table.cells for one in row)
    inner = "<button>{}</button>" if sortable else "{}"
    head = "".join(
        f"<th{attributes(is_word, hint)}>{inner.format(escape(text))}</th>"
        for text, is_word, hint in zip(table.heads, table.words, hints, strict=True)
    )
    body = []
    for i, row in enumerate(table.cells):
        first = " class=first" if table.starts_group(i) else ""
        key = f' data-key="{escape(table.keys[i])}"' if table.keys else ""
        cells = "".join(map(cell, table.words, row))
        body.append(f"<tr{first}{key}>{cells}</tr>")
    kind = ' class="sortable"' if sortable else ""
    return f"<table{kind}><thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>"
