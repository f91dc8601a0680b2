"""The experiments, by name."""

from __future__ import annotations

from moit.experiments import moment_based, moment_transparency
from moit.experiments.description import Experiment

EXPERIMENTS: dict[str, Experiment] = {
    one.name: one for one in (*moment_transparency.EXPERIMENTS, *moment_based.EXPERIMENTS)
}


def names() -> list[str]:
    """The names of all experiments, as `moit.experiment` takes them."""
    return list(EXPERIMENTS)
