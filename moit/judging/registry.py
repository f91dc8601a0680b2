"""What was tuned on which draw, by how many variants: registry.json, which who tunes adds to."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Tuned:
    """technique : whose constants or rules. what : which. draw : what variants were compared on.
    variants : how many were."""

    technique: str
    what: str
    draw: str
    variants: int


@functools.cache
def registry() -> tuple[Tuned, ...]:
    """All that was tuned, in the order in which it was."""
    content = json.loads(Path(__file__).with_name("registry.json").read_text(encoding="utf-8"))
    return tuple(Tuned(**one) for one in content["tuned"])
