"""How good a network is on rays that it was not trained on."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.catalog.network import Network
from moit.neural import data
from moit.neural.examples import Examples, examples_of
from moit.neural.losses import LOSSES, Truth

Array = NDArray[Any]

SCORED = ("layers", "surfaces", "puffs", "tufts", "neural-training")
FRAGMENTS = 60_000
SEED = 20_240_522  # none that a user would train with


def scores(network: Network, technique: Technique) -> dict[str, float]:
    """Root mean square errors on fresh rays, as "set metric": of transmittance, and of color.

    Colours are random and weights are renormalised, as moit.neural.losses.color has it.
    """
    found: dict[str, float] = {}
    for name in SCORED:
        examples = examples_of(data.drawn(name, FRAGMENTS, SEED), technique)
        raw = network.forward(examples.features)
        T = examples.transmittance(raw.reshape(-1))[0]
        found |= {f"{name} {metric}": error for metric, error in errors(T, examples).items()}
    return found


def errors(T: Array, examples: Examples) -> dict[str, float]:
    """The same of given transmittance, by metric."""
    t = examples.truth
    exact, alpha = t.exact.astype(np.float64), t.alpha.astype(np.float64)
    truth = Truth(exact, alpha, t.starts, t.counts, t.weight)
    return {
        name: float(np.sqrt(LOSSES[name](T.astype(np.float64), truth)[0]))
        for name in ("transmittance", "color")
    }
