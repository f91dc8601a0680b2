"""How sure a mean is: intervals from rays, or scenes, drawn again with replacement.

Efron, "Bootstrap Methods: Another Look at the Jackknife", Annals of Statistics 1979.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

AGAIN = 1000
SHARE = 0.95  # of what is drawn again lies in an interval


class Estimate(NamedTuple):
    """A number, and between which numbers it would likely be on another draw."""

    value: float
    low: float
    high: float


def estimate(total: Array, count: Array | None = None, root: bool = False) -> Estimate:
    """The mean of (n,) totals by (n,) counts (None: 1 each), or its root.

    An estimate of nothing, where all counts are 0, is NaN.
    """
    total = np.asarray(total, np.float64)
    counts = np.ones(len(total)) if count is None else np.asarray(count, np.float64)
    weights = _weights(len(total))
    with np.errstate(invalid="ignore", divide="ignore"):
        value = total.sum() / counts.sum()
        again = (weights @ total) / (weights @ counts)
    again = again[np.isfinite(again)]
    tail = (1 - SHARE) / 2
    low, high = np.quantile(again, (tail, 1 - tail)) if len(again) else (np.nan, np.nan)
    numbers = np.array([value, low, high])
    return Estimate(*map(float, np.sqrt(np.maximum(numbers, 0)) if root else numbers))


@functools.lru_cache(4)
def _weights(count: int) -> Array:
    """(AGAIN, count) how often each is drawn; the same in each call."""
    rng = np.random.default_rng(count)
    return rng.multinomial(count, np.full(count, 1 / max(count, 1)), AGAIN).astype(np.float64)
