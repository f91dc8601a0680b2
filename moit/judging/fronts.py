"""Which techniques nothing beats for their bytes, among those that a program can afford."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from moit.catalog.technique import ACCESS
from moit.comparing.rows import Row

PASSES = (1, 2, 3)
AFFORDED = ACCESS[:3]  # each has those before it
BUDGETS = (8, 16, 20, 32, 44, 64)  # bytes of a pixel
WORDS = {
    "blend": "blending alone",
    "atomics": "atomics, no order",
    "ordered": "ordered access",
}


@dataclass(frozen=True)
class Means:
    """What a program can afford.

    passes : over transparent geometry, at most. access : what it has; "atomics" has blending, too,
    and "ordered" both. bytes : of a pixel, at most. What is right only on the mean over random
    numbers is not allowed: it trades errors for noise that each frame has anew.
    """

    passes: int = 3
    access: str = "ordered"
    bytes: float = math.inf

    def allow(self, row: Row) -> bool:
        known = row["bytes"] is not None and row["passes"] is not None
        return (
            known
            and not row["random"]
            and row["passes"] <= self.passes
            and row["bytes"] <= self.bytes
            and row["access"] in AFFORDED[: AFFORDED.index(self.access) + 1]
        )


def known(rows: Sequence[Row], by: str) -> list[Row]:
    return [row for row in rows if row[by] is not None]


def best(rows: Sequence[Row], means: Means, by: str = "flip") -> Row | None:
    """The row with least error among those that are allowed, of equals that of fewer bytes."""
    allowed = [row for row in known(rows, by) if means.allow(row)]
    return min(allowed, key=lambda row: (row[by], row["bytes"]), default=None)


def front(rows: Sequence[Row], means: Means, by: str = "flip") -> list[Row]:
    """Rows that nothing allowed beats in both bytes and error, by bytes."""
    return falling([row for row in known(rows, by) if means.allow(row)], by)


def falling(rows: Sequence[Row], by: str) -> list[Row]:
    """Of rows by bytes those that err less than all before them."""
    found: list[Row] = []
    for row in sorted(rows, key=lambda row: (row["bytes"], row[by])):
        if not found or row[by] < found[-1][by]:
            found.append(row)
    return found
