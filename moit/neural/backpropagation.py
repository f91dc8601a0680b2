"""Multilayer perceptrons with ReLU between layers, and their gradients, by hand in NumPy.

Rumelhart, Hinton and Williams, "Learning representations by back-propagating errors", Nature 1986;
Kingma and Ba, "Adam: A Method for Stochastic Optimization", ICLR 2015. Numbers are float32 or
float64, whatever the parameters are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

if TYPE_CHECKING:
    from numpy.random import Generator  # NumPy loads it on first use, since that takes long

Array = NDArray[Any]


def parameter_count(sizes: Sequence[int]) -> int:
    """How many numbers a perceptron with layers of `sizes`, the inputs first, has."""
    return sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))


class Perceptron:
    """Layers of `sizes`, the inputs first; ReLU between them and nothing after the last.

    parameters : (parameter_count(sizes),) per layer and output its weights, then its bias: the
        order in which the core takes them. Not copied: who changes them changes the perceptron.
    """

    def __init__(self, sizes: Sequence[int], parameters: Array) -> None:
        assert parameters.shape == (parameter_count(sizes),)
        self.sizes = tuple(sizes)
        self.parameters = parameters
        self._layers = _layers(self.sizes, parameters)

    @classmethod
    def random(cls, sizes: Sequence[int], rng: Generator, dtype: DTypeLike) -> Perceptron:
        """He's initial weights for ReLU, uniform, and small biases."""
        made = cls(sizes, np.empty(parameter_count(sizes), dtype))
        for layer in made._layers:
            inputs = layer.shape[1] - 1
            layer[:, :-1] = rng.uniform(-1, 1, (len(layer), inputs)) * np.sqrt(6 / inputs)
            layer[:, -1] = rng.uniform(-0.1, 0.1, len(layer))
        return made

    @property
    def weights(self) -> list[Array]:
        """Each layer's (outputs, inputs)."""
        return [layer[:, :-1] for layer in self._layers]

    @property
    def biases(self) -> list[Array]:
        """Each layer's (outputs,)."""
        return [layer[:, -1] for layer in self._layers]

    def forward(self, inputs: Array) -> list[Array]:
        """What each layer puts out, and first what goes in, as (size, n) of inputs (n, size)."""
        held = [inputs.T]
        for i, (weights, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            out = weights @ held[-1]
            out += bias[:, None]
            if i + 1 < len(self._layers):
                np.maximum(out, 0, out=out)
            held.append(out)
        return held

    def gradient(self, held: Sequence[Array], upstream: Array) -> Array:
        """The loss's derivative by each parameter.

        held : what `forward` gave.
        upstream : (outputs, n), the loss's derivatives by what the last layer put out.
        """
        found = np.empty_like(self.parameters)
        parts = _layers(self.sizes, found)
        for i in reversed(range(len(parts))):
            parts[i][:, :-1] = upstream @ held[i].T
            parts[i][:, -1] = upstream.sum(axis=1)
            if i:
                upstream = self.weights[i].T @ upstream
                upstream *= held[i] > 0
        return found


def _layers(sizes: tuple[int, ...], parameters: Array) -> list[Array]:
    """Views (outputs, inputs + 1) of a vector of parameters; biases stand in the last column."""
    found, at = [], 0
    for inputs, outputs in pairwise(sizes):
        count = (inputs + 1) * outputs
        found.append(parameters[at : at + count].reshape(outputs, inputs + 1))
        at += count
    return found


@dataclass
class Adam:
    """The state of Adam (Kingma and Ba, algorithm 1) with its usual constants.

    first, second : running means of gradients and of their squares, of the parameters' shape.
    steps : how many there were.
    """

    first: Array
    second: Array
    steps: int = 0

    @classmethod
    def for_parameters(cls, parameters: Array) -> Adam:
        return cls(np.zeros_like(parameters), np.zeros_like(parameters))

    def step(self, parameters: Array, gradient: Array, rate: float) -> None:
        """Changes `parameters` in place."""
        self.steps += 1
        self.first += 0.1 * (gradient - self.first)
        self.second += 0.001 * (gradient**2 - self.second)
        size = rate * np.sqrt(1 - 0.999**self.steps) / (1 - 0.9**self.steps)
        parameters -= parameters.dtype.type(size) * self.first / (np.sqrt(self.second) + 1e-8)
