"""moit.experiment: runs a description."""

from __future__ import annotations

import os
import time

from moit.checks.arguments import nearest, one_of
from moit.engines import gpu_of
from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.description import SIZES, Experiment, Setting
from moit.experiments.result import ExperimentResult
from moit.system.environment import machine
from moit.system.progress import Progress, steps


def experiment_named(name: str | Experiment) -> Experiment:
    """The experiment of that name; ValueError with the nearest match where there is none."""
    if isinstance(name, Experiment):
        return name
    if not isinstance(name, str):
        raise TypeError(f"name: expected the name of an experiment, got {type(name).__name__}")
    if name not in EXPERIMENTS:
        hint = nearest(name, list(EXPERIMENTS))
        raise ValueError(f"name: there is no experiment {name!r:.80}{hint}")
    return EXPERIMENTS[name]


def experiment(
    name: str | Experiment,
    size: str = "small",
    *,
    device: str = "cpu",
    progress: Progress = True,
    out: str | os.PathLike[str] | None = None,
) -> ExperimentResult:
    """A figure or table of a paper, measured here, beside what the paper says of it.

    name : as `moit experiment --list` shows them, or an Experiment.
    size : "tiny" takes seconds and tests that all runs; "small" takes up to two minutes on two
        processors; "full" has the paper's resolution.
    device : "cpu" or "gpu", for pictures and times.
    progress : True, False, or a callable (done, total, label).
    out : a folder that gets each result of a comparison as soon as it is there. Called again with
        the same folder, what it holds for the same question is not measured again.

    Raises ValueError for an unknown name or size, GpuError where a device is missing.

    >>> moit.experiment("mt-fig2", "tiny", progress=False).size
    'tiny'
    """
    described = experiment_named(name)
    one_of("size", size, SIZES)
    one_of("device", device, ("cpu", "gpu"))
    gpu_of(device)
    folder = None if out is None else os.fspath(out)
    start = time.perf_counter()
    with steps(progress, sum(part.steps() for part in described.parts), described.name) as done:
        setting = Setting(size, device, folder, done)
        sections = [part.run(setting) for part in described.parts]
    return ExperimentResult(
        described, sections, size, device, machine(), time.perf_counter() - start
    )
