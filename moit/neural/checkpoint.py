"""Checkpoints of a training: files that appear whole or not at all, and from which it goes on."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np

from moit.checks.arguments import path_name
from moit.checks.exceptions import MoitError
from moit.formats.npz import members
from moit.neural.backpropagation import Adam, Perceptron, parameter_count
from moit.neural.fitting import State
from moit.system.files import writing

VERSION = 1
MOST_BYTES = 1 << 26  # networks are small
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
            found = members(file, NAMES, MOST_BYTES)
            missing = [key for key in NAMES if key not in found]
            if missing:
                raise ValueError(f"there is no {missing[0]!r} in it")
            version, kept = int(found["version"]), json.loads(str(found["plan"]))
            steps = int(found["steps"])
        except (ValueError, TypeError, RecursionError) as error:
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
    ):
        raise CheckpointError(f"{name!r}: damaged: its arrays do not fit a network of {sizes}")
    if losses.dtype.kind != "f" or losses.ndim != 2 or losses.shape[1] != 2 or steps < 0:
        raise CheckpointError(f"{name!r}: damaged: its losses or steps are none")
    return State(
        Perceptron(sizes, numbers[0]),
        Adam(numbers[1], numbers[2], steps),
        len(losses),
        [(float(first), float(second)) for first, second in losses],
    )
