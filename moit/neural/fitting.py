"""Fitting a perceptron to examples: shuffled batches, Adam, and a state that can be kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from moit.neural.backpropagation import Adam, Perceptron

Array = NDArray[Any]


class Units(Protocol):
    """What is learnt from: units that are shuffled, each of some examples that stay together."""

    @property
    def features(self) -> Array: ...

    @property
    def starts(self) -> Array:
        """(units + 1,) where the examples of each unit begin, and the end."""
        ...

    def taken(self, units: Array) -> Self: ...

    def between(self, first: int, last: int) -> Self: ...

    def loss(self, name: str, raw: Array) -> tuple[float, Array]: ...


@dataclass(frozen=True)
class Schedule:
    """How long and how fast.

    epochs : how often every example is seen.
    batch : about how many examples there are to a step.
    rate : Adam's learning rate; falling: to 0 by half a cosine, else constant.
    loss : its name.
    seed : of initial weights and of shuffling.
    """

    epochs: int
    batch: int
    rate: float
    falling: bool
    loss: str
    seed: int


@dataclass
class State:
    """Where a fit stands after `epoch` epochs.

    losses : (epoch, 2) the loss on the examples and on those held out, NaN where there are none.
    """

    network: Perceptron
    adam: Adam
    epoch: int = 0
    losses: list[tuple[float, float]] = field(default_factory=list)

    @classmethod
    def start(cls, sizes: Sequence[int], seed: int) -> State:
        network = Perceptron.random(sizes, np.random.default_rng((seed, 0)), np.float32)
        return cls(network, Adam.for_parameters(network.parameters))

    def copy(self) -> State:
        return State(
            Perceptron(self.network.sizes, self.network.parameters.copy()),
            Adam(self.adam.first.copy(), self.adam.second.copy(), self.adam.steps),
            self.epoch,
            list(self.losses),
        )


def batches(units: Units, size: int) -> Iterator[tuple[int, int]]:
    """Consecutive units of about `size` examples, as (first, last + 1)."""
    count = max(round(int(units.starts[-1]) / size), 1)
    cuts = np.searchsorted(units.starts, np.linspace(0, units.starts[-1], count + 1))
    for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        if last > first:
            yield first, last


def fit(
    state: State,
    units: Units,
    held_out: Units | None,
    schedule: Schedule,
    after: Callable[[State], object] = lambda state: None,
) -> None:
    """Goes on from `state`, which it changes, to the end of the schedule.

    after : called with the state after each epoch; nothing of it changes before the next begins.

    The same state, units and schedule give the same bits on one machine: what is random depends on
    the seed and on the number of the epoch alone.
    """
    parameters = state.network.parameters
    count = len(units.starts) - 1
    steps = sum(1 for _ in batches(units, schedule.batch)) * schedule.epochs
    while state.epoch < schedule.epochs:
        rng = np.random.default_rng((schedule.seed, state.epoch + 1))
        shuffled = units.taken(rng.permutation(count))
        total, examples = 0.0, 0
        for first, last in batches(shuffled, schedule.batch):
            batch = shuffled.between(first, last)
            held = state.network.forward(batch.features)
            loss, upstream = batch.loss(schedule.loss, held[-1])
            rate = schedule.rate
            if schedule.falling:
                rate *= 0.5 + 0.5 * math.cos(math.pi * state.adam.steps / steps)
            state.adam.step(parameters, state.network.gradient(held, upstream), rate)
            total += loss * (last - first)
            examples += last - first
        state.epoch += 1
        state.losses.append((total / examples, loss_of(state.network, held_out, schedule.loss)))
        after(state)


def loss_of(network: Perceptron, units: Units | None, name: str) -> float:
    if units is None:
        return math.nan
    return units.loss(name, network.forward(units.features)[-1])[0]
