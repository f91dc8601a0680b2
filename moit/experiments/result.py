"""What an experiment found: sections of tables, pictures and charts, and the paper's claims."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from moit.comparing.rows import Row, write_rows
from moit.experiments.claims import Judged, Numbers
from moit.experiments.description import Experiment, Section
from moit.reports.blocks import Block, Heading, Markdown, Paragraph, fragment, page, text
from moit.reports.tables import Table
from moit.system.files import write_text

LEADING = ("section", "scene", "device", "setting", "technique")


@dataclass(frozen=True)
class ExperimentResult:
    """The result of `moit.experiment`; in a notebook it shows itself.

    sections : tables, pictures and charts, one for each part of the experiment.
    size, device, machine : what it was measured with. seconds : how long that took.

    >>> result = moit.experiment("mt-fig2", "tiny", progress=False)
    >>> result.size, result.device
    ('tiny', 'cpu')
    """

    experiment: Experiment
    sections: Sequence[Section]
    size: str
    device: str
    machine: str
    seconds: float

    @property
    def rows(self) -> list[Row]:
        """The rows of all tables; `section` says of which."""
        return [
            Row({"section": section.title, **row})
            for section in self.sections
            for row in section.rows
        ]

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of `rows`."""
        found = dict.fromkeys(name for row in self.rows for name in row)
        return tuple(sorted(found, key=lambda name: name not in LEADING))

    @cached_property
    def claims(self) -> list[Judged]:
        """What the paper says, each with a verdict and the numbers for it."""
        numbers = Numbers(self.rows)
        return [claim.judged(numbers) for claim in self.experiment.claims]

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes all rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, self.columns, self.rows)

    def blocks(self) -> Iterator[Block]:
        """What it says, in order."""
        described = self.experiment
        device = "" if self.device == "cpu" else f", {self.device}"
        yield Heading(1, f"{described.paper}, {described.figure}: {described.title}")
        yield Paragraph(described.about)
        yield Paragraph(
            f"moit experiment {described.name} --size {self.size}{device}; "
            f"{self.seconds:.0f} s on {self.machine}."
        )
        if self.claims:
            yield Heading(2, "What the paper says of it")
            yield self._claims_table()
        for section in self.sections:
            yield Heading(2, section.title)
            yield from section.blocks()

    def _claims_table(self) -> Table:
        claims = self.claims
        return Table(
            ["claim", "where", "verdict", "numbers"],
            [[one.claim.text, one.claim.where, one.verdict, one.numbers] for one in claims],
            [True] * 4,
            listed=[
                f"{one.verdict:<13}  {one.claim.text} ({one.claim.where})\n{'':15}{one.numbers}"
                for one in claims
            ],
        )

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Writes one page that needs no other file."""
        write_text(path, page(self.experiment.name, self.blocks()))

    def write(self, folder: str | os.PathLike[str]) -> list[str]:
        """Writes NAME.md with its pictures and charts, NAME.csv and NAME.html; their paths."""
        os.makedirs(folder, exist_ok=True)
        stem = os.path.join(os.fspath(folder), self.experiment.name)
        self.to_csv(f"{stem}.csv")
        self.to_html(f"{stem}.html")
        written = Markdown(os.path.join(os.fspath(folder), "pictures"), "pictures/")
        write_text(f"{stem}.md", written(self.blocks()) + "\n")
        return [f"{stem}.md", f"{stem}.csv", f"{stem}.html"]

    def __str__(self) -> str:
        return text(self.blocks())

    def __repr__(self) -> str:
        return (
            f"ExperimentResult({self.experiment.name}, {self.size}, {len(self.rows)} rows, "
            f"{len(self.claims)} claims)"
        )

    def _repr_html_(self) -> str:
        return fragment(self.blocks())
