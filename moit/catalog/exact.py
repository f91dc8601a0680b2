"""Techniques that blend fragments one over the other."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from moit.catalog.targets import Target, Targets
from moit.catalog.technique import Technique


@dataclasses.dataclass(frozen=True)
class Sorted(Technique):
    """The exact composite: fragments front to back, equal depths in arrival order.

    The A-buffer of Carpenter 1984; what all else is measured against. Order-independent but for
    fragments of equal depth.

    >>> str(moit.Sorted())
    'sorted'
    """

    kind: ClassVar[str] = "sorted"
    family: ClassVar[str] = "exact"
    sorts: ClassVar[bool] = True
    source: ClassVar[str] = "Carpenter 1984 (A-buffer), the reference"
    papers: ClassVar[tuple[str, ...]] = ("carpenter1984",)

    @property
    def bits_per_pixel(self) -> float | None:
        return None


@dataclasses.dataclass(frozen=True)
class AlphaBlend(Technique):
    """Over in arrival order, each fragment in front of those that came before it.

    Porter and Duff 1984; right only where fragments arrive back to front.

    >>> str(moit.AlphaBlend())
    'unsorted'
    """

    kind: ClassVar[str] = "unsorted"
    family: ClassVar[str] = "unsorted"
    source: ClassVar[str] = "Porter and Duff 1984"
    papers: ClassVar[tuple[str, ...]] = ("porter1984",)

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        return Targets(shaded=(Target(f"rgba{colours}", "over"),))
