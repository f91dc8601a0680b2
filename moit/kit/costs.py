"""What `moit bench --gpu-cost` has stored of a technique, for its page."""

from __future__ import annotations

from typing import Any

from moit.catalog import Technique
from moit.gpu_costs.stored import ENGINE, stored


def cost_rows(technique: Technique) -> list[dict[str, Any]]:
    """Rows about this technique, without its name; none where nothing is stored."""
    names = str(technique), technique.base_name
    return [
        {key: value for key, value in row.items() if key not in ("technique", "text")}
        for row in stored().rows
        if row["text"] == ENGINE and row["technique"] in names
    ]
