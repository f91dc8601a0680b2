"""Charts of a stability report: numbers over a family's dial."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from moit.comparing.rows import Row
from moit.numerics.hard_cases import FAMILIES
from moit.reports.charts import DialChart, Series

# What pages draw over each dial, and what is as good as 0 there.
MEASURES = {
    "T_p99": ("error of T, 99 %", 1e-4),
    "own_p99": ("own error, 99 %", 1e-17),
    "brightness": ("brightness", 1e-6),
    "jump": ("jump", 1e-6),
    "bias_needed": ("bias needed", 1e-17),
}
LINEAR = ("pivot", "biased_pivot", "invalid", "nan")  # of either sign, or shares


def dial_chart(
    rows: Sequence[Row],
    column: str,
    palette: Mapping[str, str],
    keys: Mapping[str, str],
    lines: Mapping[str, str],
    own_lines: Mapping[str, str] | None = None,
) -> DialChart:
    """A family's column over its dial: a series for each technique and precision.

    lines : the precisions shown, and how their lines look; all rows together set the scale.
    own_lines : those of techniques, instead of those of precisions.
    """
    dial = list(dict.fromkeys(row["dial"] for row in rows))
    scale = [row[column] for row in rows if row[column] is not None]
    held: dict[tuple[str, str], dict[float, float]] = {}
    for row in rows:
        if row["precision"] in lines and row[column] is not None:
            of = (row["technique"], row["precision"])
            held.setdefault(of, {})[row["dial"]] = row[column]
    series = [
        Series(
            name,
            np.array([at.get(value, math.nan) for value in dial]),
            palette[name],
            keys[name],
            own_lines[name] if own_lines else lines[precision],
        )
        for (name, precision), at in held.items()
    ]
    positive = [y for y in scale if 0 < y < math.inf]
    least = MEASURES[column][1] if column in MEASURES else min(positive, default=1.0)
    family = FAMILIES.get(rows[0]["family"])
    title = family.dial if family else "dial"
    return DialChart(dial, series, title, scale, least, column in LINEAR)
