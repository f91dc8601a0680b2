"""Checkpoints of a training: files that appear whole or not at all, and from which it goes on."""

from __future__ import annotations

import json
import os
import zipfile
from typing import Any

import numpy as np

from moit.checks.arguments import path_name
from moit.checks.exceptions import MoitError
from moit.neural.backpropagation import Adam, Perceptron, parameter_count
from moit.neural.fitting import State
from moit.system.files import writing

VERSION = 1
NAMES = ("version", "plan", "parameters", "first", "second", "steps", "losses")


class CheckpointError(MoitError, ValueError):
    """A checkpoint that cannot be read, or that belongs to another training."""


def write(path: str | os.PathLike[str], state: State, plan: dict[str, Any]) -> None:
    """Keeps a state, with all that what comes of it depends on."""
    with writing(path) as file:
        np.savez(
            file,
            version=np.int64(VERSION),
            plan=np.array(json.dumps(plan, sort_keys=True)),
            parameters=state.network.parameters,
            first=state.adam.first,
            second=state.adam.second,
            steps=np.int64(state.adam.steps),
            losses=np.array(state.losses, np.float64).reshape(-1, 2),
        )


def read(path: str | os.PathLike[str], plan: dict[str, Any]) -> State:
    """The state that `write` kept of the same plan.

    Raises CheckpointError for a damaged file and where the plan differs, saying in what; OSError
    for a file that cannot be read.
    """
    name = path_name(path, "checkpoint")
    with open(name, "rb") as file:
        try:
            with np.load(file, allow_pickle=False) as archive:
                found = {key: archive[key] for key in NAMES}
            version, kept = int(found["version"]), json.loads(str(found["plan"]))
        except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
            raise CheckpointError(f"{name!r}: not a readable checkpoint: {error}") from error
    if version != VERSION:
        raise CheckpointError(f"{name!r}: found version {version}; needed {VERSION}")
    for key, value in json.loads(json.dumps(plan)).items():
        if not isinstance(kept, dict) or kept.get(key) != value:
            other = kept.get(key) if isinstance(kept, dict) else None
            raise CheckpointError(
                f"{name!r} is of another training: {key} was {other!r:.80} and is {value!r:.80}"
            )
    sizes, losses = plan["sizes"], found["losses"]
    numbers = [found[key] for key in ("parameters", "first", "second")]
    if any(
        one.shape != (parameter_count(sizes),)
        or one.dtype != np.float32
        or not np.isfinite(one).all()
        for one in numbers
    ) or losses.shape != (len(losses), 2):
        raise CheckpointError(f"{name!r}: damaged: its arrays do not fit a network of {sizes}")
    return State(
        Perceptron(sizes, numbers[0]),
        Adam(numbers[1], numbers[2], int(found["steps"])),
        len(losses),
        [(float(first), float(second)) for first, second in losses],
    )
