"""What an experiment is: a paper's figure or table as scenes, techniques, measures and claims."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from moit.comparing.report import Row
from moit.experiments.claims import Claim

Array = NDArray[Any]

SIZES = ("tiny", "small", "full")
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
class Picture:
    """A picture of a section: linear (H, W, 3), or an (H, W) map of errors in [0, 1]."""

    name: str
    caption: str
    image: Array


@dataclass(frozen=True)
class Chart:
    """A chart of a section, as SVG."""

    name: str
    caption: str
    svg: str


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
    charts: Sequence[Chart] = ()
    published: Published | None = None

    def _repr_html_(self) -> str:
        from moit.experiments.document import section_fragment

        return section_fragment(self)


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
