"""What `moit bench --gpu-cost` has stored of a technique, for its page."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from moit.catalog import Technique

STORED = "costs.json"


def cost_rows(technique: Technique) -> list[dict[str, Any]]:
    """Rows about this technique, without its name; none where nothing is stored."""
    stored = files("moit").joinpath("gpu_costs", STORED)
    if not stored.is_file():
        return []
    rows = json.loads(stored.read_text(encoding="utf-8"))
    return [
        {key: value for key, value in row.items() if key != "technique"}
        for row in rows
        if row["technique"] == str(technique)
    ]
