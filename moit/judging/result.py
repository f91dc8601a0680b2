"""The result of `moit.frontier`, and the files that it writes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

from moit.comparing.rows import write_rows
from moit.judging.findings import Findings
from moit.judging.page import blocks_of
from moit.reports.blocks import Block, Markdown, fragment, page, text
from moit.system.files import write_text


@dataclass(frozen=True)
class Frontier(Findings):
    """The result of `moit.frontier`; in a notebook it shows itself.

    draw : of rays and scenes; its text is its kind and seed. size : as given.
    techniques : what was judged. machine : on what.

    >>> found = moit.frontier("wboit", size="tiny", progress=False)
    >>> found.row("wboit").bytes, str(found.draw)
    (1.0, 'check-0')
    """

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes all rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, self.columns, self.rows)

    def blocks(self) -> Iterator[Block]:
        """What it says, in order."""
        return blocks_of(self)

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Writes one page that needs no other file."""
        write_text(path, page("frontier", self.blocks()))

    def write(self, folder: str | os.PathLike[str]) -> list[str]:
        """Writes frontier.md with its charts, frontier.csv and frontier.html; their paths."""
        os.makedirs(folder, exist_ok=True)
        stem = os.path.join(os.fspath(folder), "frontier")
        self.to_csv(f"{stem}.csv")
        self.to_html(f"{stem}.html")
        written = Markdown(os.path.join(os.fspath(folder), "pictures"), "pictures/")
        write_text(f"{stem}.md", written(self.blocks()) + "\n")
        return [f"{stem}.md", f"{stem}.csv", f"{stem}.html"]

    def __str__(self) -> str:
        return text(self.blocks())

    def __repr__(self) -> str:
        return f"Frontier({self.draw}, {self.size}, {len(self.techniques)} techniques)"

    def _repr_html_(self) -> str:
        return fragment(self.blocks())
