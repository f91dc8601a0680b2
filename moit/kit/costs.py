"""What `moit bench --gpu-cost` has stored of a technique's text, for its page."""

from __future__ import annotations

import json
from pathlib import Path

from moit.catalog import Technique

FILE = Path(__file__).parents[1] / "gpu_costs" / "costs.json"
SHOWN = ("family", "pass", "cycles", "instructions", "registers")


def cost_rows(technique: Technique) -> list[dict[str, str]]:
    """By GPU family and pass; none where nothing is stored of this technique."""
    if not FILE.is_file():
        return []
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    rows = (dict(zip(stored["columns"], row, strict=True)) for row in stored["rows"])
    return [
        {name: str(row[name]) for name in SHOWN}
        for row in rows
        if row["text"] == "engine" and row["technique"] in (str(technique), technique.base_name)
    ]
