"""How wrong transmittance is, as one number, and its derivative by each transmittance.

T is what a network says, `exact` the truth, alpha the fragments' own; all (n,). Fragments of a
pixel stand together; `starts` (p,) is where those of each pixel begin, `weight` (p,) how much it
counts, on the mean 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

#: The variance of colours that are uniform in [0, 1].
COLOR_VARIANCE = 1 / 12


@dataclass(frozen=True)
class Truth:
    """What losses compare with: see the module."""

    exact: Array
    alpha: Array
    starts: Array
    counts: Array
    weight: Array


def transmittance(T: Array, truth: Truth) -> tuple[float, Array]:
    """The mean of (T - exact)^2 over fragments: NMT's loss."""
    off = T - truth.exact
    scale = np.repeat(truth.weight, truth.counts) / T.dtype.type(len(T))
    return float((scale * off) @ off), 2 * scale * off


def visible(T: Array, truth: Truth) -> tuple[float, Array]:
    """The mean of alpha^2 (T - exact)^2 over fragments, and a tenth of that of (T - exact)^2."""
    off = T - truth.exact
    scale = (truth.alpha**2 + T.dtype.type(0.1)) / T.dtype.type(len(T))
    scale *= np.repeat(truth.weight, truth.counts)
    return float((scale * off) @ off), 2 * scale * off


def color(T: Array, truth: Truth, with_opacity: float = 0.0) -> tuple[float, Array]:
    """The mean over pixels of the squared error of a channel's colour after renormalisation.

    Of colours that are random, uniform in [0, 1] and independent, this is what is to be expected:
    weights alpha T are scaled by k so that they sum to those of the truth (MBOIT, eq. 2), hence
    what is left is the variance of a colour times the sum of (alpha (k T - exact))^2.

    with_opacity : the variance of what all of a pixel have in common that grows with the root of
        alpha, from -1 to 1, beside the variance of what each has of its own.
    """
    alpha, starts, counts = truth.alpha, truth.starts, truth.counts
    visible = alpha * T
    total = np.maximum(np.add.reduceat(visible, starts), np.finfo(T.dtype).tiny)
    k = np.repeat(np.add.reduceat(alpha * truth.exact, starts) / total, counts)
    off = k * visible - alpha * truth.exact
    pull = off
    if with_opacity:
        opacity = 2 * np.sqrt(alpha) - 1
        common = T.dtype.type(with_opacity) * np.add.reduceat(off * opacity, starts)
        pull = off + np.repeat(common, counts) * opacity
    scale = np.repeat(truth.weight, counts) * T.dtype.type(COLOR_VARIANCE / len(starts))
    through_k = np.add.reduceat(pull * visible, starts) / total  # since k falls where T rises
    slope = 2 * scale * k * alpha * (pull - np.repeat(through_k, counts))
    return float((scale * pull) @ off), slope


def picture(T: Array, truth: Truth) -> tuple[float, Array]:
    """As `color`, of colours that in part go with opacity, as those of smoke and things in it."""
    return color(T, truth, with_opacity=20.0)


LOSSES: dict[str, Callable[[Array, Truth], tuple[float, Array]]] = {
    "transmittance": transmittance,
    "visible": visible,
    "color": color,
    "picture": picture,
}

#: Those that look at each fragment by itself, so that fragments may be shuffled one by one.
OF_SINGLE_FRAGMENTS = ("transmittance", "visible")
