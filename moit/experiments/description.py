"""What an experiment is: a paper's figure or table as scenes, techniques, measures and claims."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from moit.comparing.rows import Row
from moit.experiments.claims import Claim
from moit.reports.blocks import Block, Gallery, Paragraph, Picture, Plot, fragment
from moit.reports.columns import WORDS, heading, shown
from moit.reports.tables import Table

Array = NDArray[Any]

SIZES = ("tiny", "small", "full")
MEMORY = ("bits", "bytes")  # headings of what hangs on no machine
PICTURE = {"tiny": (64, 40), "small": (480, 300), "full": (1920, 1080)}


@dataclass(frozen=True)
class Setting:
    """How an experiment is run.

    folder : where a comparison keeps its results, or None.
    done : called with what was done, after each step.
    """

    size: str
    device: str
    folder: str | None
    done: Callable[[str], None]


@dataclass(frozen=True)
class Published:
    """Numbers that a paper prints, shown beside ours under headings that name the machine.

    machine : what they were measured on, with the year; "" for what hangs on none.
    columns : {column: {(scene, technique): number}}; a scene None stands for all.
    """

    source: str
    machine: str
    columns: Mapping[str, Mapping[tuple[str | None, str], float]]

    def of(self, column: str, scene: str, technique: str) -> float | None:
        found = self.columns[column]
        return found.get((scene, technique), found.get((None, technique)))


@dataclass(frozen=True)
class Section:
    """What a part found.

    columns : those of `rows` that are shown, in order; rows hold more.
    gallery : rows of pictures, shown one below the other.
    published : where columns that begin with "paper_" come from.
    """

    title: str
    text: str
    columns: tuple[str, ...] = ()
    rows: Sequence[Row] = ()
    gallery: Sequence[Sequence[Picture]] = ()
    charts: Sequence[Plot] = ()
    published: Published | None = None

    def blocks(self) -> Iterator[Block]:
        """What it shows below its title."""
        if self.text:
            yield Paragraph(self.text)
        yield from self.charts
        yield from map(Gallery, self.gallery)
        if self.rows:
            yield self._table()

    def _table(self) -> Table:
        columns = [
            column
            for column in self.columns
            if any(row.get(column) is not None for row in self.rows)
        ]
        if len({row.get("scene") for row in self.rows}) == 1 and "scene" in columns:
            columns.remove("scene")
        notes = any(row.get("note") for row in self.rows)
        columns += ["note"] if notes and "note" not in columns else []
        return Table(
            [self.heading(column) for column in columns],
            [[shown(column, row.get(column), 3) for column in columns] for row in self.rows],
            [column in WORDS for column in columns],
            [(row.get("scene"), row.get("setting")) for row in self.rows],
        )

    def heading(self, column: str) -> str:
        """A column's name; of published ones with the machine."""
        own = heading(column.removeprefix("paper_"))
        if not column.startswith("paper_"):
            return own
        machine = "" if self.published is None else self.published.machine
        return f"{own}, paper ({machine})" if machine and own not in MEMORY else f"{own}, paper"

    def _repr_html_(self) -> str:
        return fragment(self.blocks())


class Part(Protocol):
    """A part of an experiment: what is measured, and how."""

    @property
    def title(self) -> str:
        """Of its section."""

    def steps(self) -> int:
        """How often it calls `setting.done`."""

    def run(self, setting: Setting) -> Section:
        """Measures."""


@dataclass(frozen=True)
class Experiment:
    """A figure or table of a paper.

    name : what `moit experiment` takes. paper, figure : where it comes from.
    about : what is shown, and what is different here.
    claims : what the paper says of it.
    """

    name: str
    paper: str
    figure: str
    title: str
    about: str
    parts: Sequence[Part]
    claims: Sequence[Claim] = field(default=())
