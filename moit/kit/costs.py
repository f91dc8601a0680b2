"""What `moit bench --gpu-cost` has stored of a technique's text, for its page."""

from __future__ import annotations

from moit.catalog import Technique
from moit.gpu_costs.stored import ENGINE, stored

SHOWN = ("family", "pass", "cycles", "instructions", "registers")


def cost_rows(technique: Technique) -> list[dict[str, str]]:
    """By GPU family and pass; none where nothing is stored of this technique."""
    return [
        {name: str(row[name]) for name in SHOWN}
        for row in stored().rows
        if row["text"] == ENGINE and row["technique"] in (str(technique), technique.base_name)
    ]
