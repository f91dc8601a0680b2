"""The experiments, by name."""

from __future__ import annotations

from moit.experiments import (
    line_sets,
    moment_based,
    moment_based_rays,
    moment_based_shadows,
    moment_transparency,
    neural,
    vkquake,
    weighted,
)
from moit.experiments.description import Experiment

EXPERIMENTS: dict[str, Experiment] = {
    one.name: one
    for paper in (
        moment_transparency,
        moment_based_rays,
        moment_based,
        moment_based_shadows,
        weighted,
        neural,
        vkquake,
        line_sets,
    )
    for one in paper.EXPERIMENTS
}


def names() -> list[str]:
    """The names of all experiments, as `moit.experiment` takes them."""
    return list(EXPERIMENTS)
