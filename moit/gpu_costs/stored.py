"""Costs that were measured once and lie in the package, so that everyone has them."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from moit.catalog import Technique, listed
from moit.catalog.blocks import InBlocks
from moit.gpu_costs.cost import Cost
from moit.gpu_costs.frames import ACCUMULATE, BETWEEN, MEANS
from moit.system.files import write_text

FILE = Path(__file__).with_name("costs.json")
COMMAND = "moit bench --gpu-cost -o moit/gpu_costs/costs.json"

# What a text is: ours for engines (moit.export); the published one, written plainly; ours that is
# exact to the core's bits, which has loops and branches that count as some turns.
ENGINE, PUBLISHED, EXACT = "engine", "published", "exact"
ROW = (
    "technique",
    "text",
    "family",
    "pass",
    "cycles",
    "instructions",
    "registers",
    "spilled",
    "bytes",
)


@dataclasses.dataclass(frozen=True)
class Costs:
    """What shaders cost, and what they were compiled by.

    driver, glslang, moit : versions.
    digests : of the compiled texts, by "text technique pass".
    rows : dicts with the fields of ROW.
    """

    driver: str
    glslang: str
    moit: str
    digests: Mapping[str, str]
    rows: tuple[Mapping[str, Any], ...]

    @functools.cached_property
    def _passes(self) -> dict[tuple[str, str, str], dict[str, Cost]]:
        found: dict[tuple[str, str, str], dict[str, Cost]] = {}
        for row in self.rows:
            key = row["text"], row["technique"], row["family"]
            cost = Cost(*(row[field] for field in ROW[4:]))
            found.setdefault(key, {})[row["pass"]] = cost
        return found

    @property
    def families(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(row["family"] for row in self.rows))

    def techniques(self, text: str = ENGINE) -> tuple[str, ...]:
        """Names of those that have costs of such a text."""
        return tuple(dict.fromkeys(r["technique"] for r in self.rows if r["text"] == text))

    def passes(self, technique: str, family: str, text: str = ENGINE) -> dict[str, Cost] | None:
        """By pass; None where they are not there."""
        return self._passes.get((text, technique, family))

    def only(self, techniques: Iterable[Technique | str] | None, families: Iterable[str]) -> Costs:
        """Rows of some techniques, None for all, and families. ValueError where there are none."""
        wanted = None if techniques is None else {str(one) for one in listed(techniques)}
        kept = tuple(
            row
            for row in self.rows
            if row["family"] in set(families) and (wanted is None or row["technique"] in wanted)
        )
        if not kept:
            raise ValueError(
                f"nothing stored of these; there are {', '.join(self.families)} of "
                f"{', '.join(dict.fromkeys(row['technique'] for row in self.rows))}"
            )
        return dataclasses.replace(self, rows=kept)

    def nearest(
        self, one: Technique, family: str, texts: Sequence[str] = (ENGINE, PUBLISHED)
    ) -> tuple[str, str, dict[str, Cost]] | None:
        """A text, a technique's name and its costs: of the technique itself, else of its name
        without options, else so of the next of `texts`; None where there are none of these."""
        base = one.base_name
        names = (str(one), base, base.removesuffix("-16"), *one.costs_like, one.kind)
        for text in texts:
            for name in names:
                found = self.passes(name, family, text)
                if found is not None:
                    in_blocks = isinstance(one, InBlocks) and one.block_side > 1
                    if in_blocks and text == ENGINE and MEANS not in found:
                        found = found | self._of_blocks(family, found[ACCUMULATE].bytes)
                    return text, name, found
        return None

    def _of_blocks(self, family: str, size: int) -> dict[str, Cost]:
        """What passes between blocks cost beside, whose states have nearly so many bytes."""
        found = [
            passes
            for (text, _, of), passes in self._passes.items()
            if (text, of) == (ENGINE, family) and MEANS in passes
        ]
        nearest = min(found, key=lambda passes: abs(passes[MEANS].bytes - size), default={})
        return {name: cost for name, cost in nearest.items() if name in (MEANS, BETWEEN)}


def stored() -> Costs:
    """The package's own."""
    return _read(FILE)


def read(path: str | os.PathLike[str]) -> Costs:
    """A file that `write` wrote. Raises ValueError where it is none."""
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
        rows = tuple(dict(zip(ROW, row, strict=True)) for row in found["rows"])
        return Costs(found["driver"], found["glslang"], found["moit"], dict(found["digests"]), rows)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{os.fspath(path)}: no costs as moit writes them: {error}") from None


_read = functools.cache(read)


def write(path: str | os.PathLike[str], costs: Costs) -> None:
    """As JSON, a row a line."""
    head = {
        "made_by": COMMAND,
        "driver": costs.driver,
        "glslang": costs.glslang,
        "moit": costs.moit,
        "columns": ROW,
        "digests": dict(costs.digests),
    }
    rows = _lines([row[field] for field in ROW] for row in costs.rows)
    text = json.dumps(head, indent=1)[:-2]
    write_text(path, f'{text},\n "rows": [\n{rows}\n ]\n}}\n')


def _lines(rows: Iterable[list[Any]]) -> str:
    return ",\n".join(f"  {json.dumps(row)}" for row in rows)
