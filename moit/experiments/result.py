"""What an experiment found: sections of tables, pictures and charts, and the paper's claims."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from moit.comparing.report import Row, write_rows
from moit.experiments.claims import Judged, Numbers
from moit.experiments.description import Experiment, Section

LEADING = ("section", "scene", "device", "setting", "technique")


@dataclass(frozen=True)
class ExperimentResult:
    """The result of `moit.experiment`; in a notebook it shows itself.

    sections : tables, pictures and charts, one for each part of the experiment.
    size, device, machine : what it was measured with. seconds : how long that took.
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

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Writes one page that needs no other file."""
        from moit.experiments.document import page
        from moit.system.files import write_text

        write_text(path, page(self))

    def write(self, folder: str | os.PathLike[str]) -> list[str]:
        """Writes NAME.md with its pictures and charts, NAME.csv and NAME.html; their paths."""
        from moit.experiments.document import write

        return write(self, os.fspath(folder))

    def __str__(self) -> str:
        from moit.experiments.document import text

        return text(self)

    def __repr__(self) -> str:
        return (
            f"ExperimentResult({self.experiment.name}, {self.size}, {len(self.rows)} rows, "
            f"{len(self.claims)} claims)"
        )

    def _repr_html_(self) -> str:
        from moit.experiments.document import fragment

        return fragment(self)
