"""What was tuned on which draw, by how many variants, and what was aimed at before it was judged.

Both are files that who tunes adds to: registry.json, aims.json.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Tuned:
    """technique : whose constants or rules. what : which. draw : what variants were compared on.
    variants : how many were."""

    technique: str
    what: str
    draw: str
    variants: int


@dataclass(frozen=True)
class Aim:
    """technique : by its name. measure : a column of `Frontier.rows`. floor : what it should not
    exceed. aim : what was hoped for; None: the same."""

    technique: str
    measure: str
    floor: float
    aim: float | None

    def verdict(self, found: float) -> str:
        """What is to be said where so much was measured."""
        if found > self.floor:
            return "missed"
        return "kept" if self.aim is None or found <= self.aim else "kept, not the aim"


@functools.cache
def registry() -> tuple[Tuned, ...]:
    """All that was tuned, in the order in which it was."""
    return tuple(Tuned(**one) for one in _content("registry")["tuned"])


@functools.cache
def aims() -> tuple[Aim, ...]:
    """All aims, set before the draw that they are judged on was looked at."""
    return tuple(Aim(**one) for one in _content("aims")["aims"])


def _content(name: str) -> Any:
    return json.loads(Path(__file__).with_name(f"{name}.json").read_text(encoding="utf-8"))
