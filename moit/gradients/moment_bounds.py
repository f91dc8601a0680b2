"""Moment bounds as users of diffmoments call them: changing the import is all that is to be done.

    from moit.gradients.moment_bounds import compute_moment_bounds, compute_moment_bounds_backward

Worchel and Alexa, "Moment Bounds are Differentiable: Efficiently Approximating Measures in Inverse
Rendering", SIGGRAPH 2025, whose package these are named after; the computation is moit's own.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.catalog import PowerMoments, technique
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite
from moit.gradients.composites import checked_seed
from moit.moments import ROUNDED, check_within
from moit.system.environment import thread_count

__all__ = ["compute_moment_bounds", "compute_moment_bounds_backward"]

Array = NDArray[Any]


def compute_moment_bounds(
    moments: ArrayLike,
    η: ArrayLike,
    bias: float,
    overestimation_weight: float,
    retain_roots: bool = False,
    return_backward_context: bool = False,
) -> Any:
    """The mass in front of η that moments bound, (N,); with the context (bounds, context).

    moments : (2n + 1, N), n from 1 to 4: sums of mass times the powers 0 to 2n of where it lies in
        [-1, 1]; mass is not negative.
    η : (N,) in [-1, 1].
    bias : share of a safe distribution mixed in, in [0, 1].
    overestimation_weight : 0 is the lower bound, 1 the upper.
    retain_roots : without effect: no derivative goes through roots.
    return_backward_context : give what `compute_moment_bounds_backward` needs, too.

    Computes in float64 where an array is, else in float32. Raises ValueError where shapes disagree,
    for other n, and for numbers out of range. Sources: `moit.gradients.moments_transmittance`.

    >>> from moit.gradients.moment_bounds import compute_moment_bounds
    >>> moments = np.array([[1.0], [0.0], [0.5], [0.0], [0.4]])  # of one unit of mass
    >>> compute_moment_bounds(moments, np.array([0.9]), 1e-6, 1.0).shape
    (1,)
    """
    truth("retain_roots", retain_roots)
    rows, at = as_array(moments, "moments"), as_array(η, "η")
    if rows.ndim != 2 or rows.shape[0] not in (3, 5, 7, 9) or at.shape != rows.shape[1:]:
        raise ValueError(
            "moments: expected shape (2n + 1, N) with n from 1 to 4, and η of (N,); "
            f"got {rows.shape} and {at.shape}"
        )
    dtype = np.result_type(rows, at, np.float32)
    dtype = np.dtype(np.float64 if dtype == np.float64 else np.float32)
    with np.errstate(over="ignore"):
        held, places = (np.require(one, dtype, ["C", "A"]) for one in (rows, at))
    numbers = isinstance(bias, (int, float)) and isinstance(overestimation_weight, (int, float))
    fields_for = _kept_fields if numbers else _fields
    fields = fields_for(len(rows) - 1, bias, overestimation_weight, dtype)
    keeps = truth("return_backward_context", return_backward_context)
    bounds, by_moments, by_place, all_fit = _core.bound_of_rows(
        fields, thread_count(None), held, places, keeps, 1 + ROUNDED
    )
    if not all_fit:  # the core sees to it as it goes, and knows no words
        _check_means(finite(rows, "moments", dtype))
        check_within(finite(at, "η", dtype), "η", -1 - ROUNDED, 1 + ROUNDED)
    return (bounds, {"slopes": (by_moments, by_place)}) if keeps else bounds


def _fields(count: int, bias: Any, overestimation: Any, dtype: np.dtype[Any]) -> dict[str, Any]:
    found = technique(f"power{count}")
    assert isinstance(found, PowerMoments)
    chosen = dataclasses.replace(found, bias=bias, overestimation=overestimation, storage=None)
    return chosen.fields_for_core(dtype)  # two moments by themselves are no half floats


# As losses are asked for in small batches: checking options anew would take longer than the answer.
_kept_fields = functools.lru_cache(maxsize=16, typed=True)(_fields)


def _check_means(rows: Array) -> None:
    """That there is some mass with these powers: it is not negative, and no mean is beyond 1."""
    mass, powers = rows[0], rows[1:]
    check_within(mass, "moments[0]", 0, np.inf)
    most = (1 + ROUNDED) * mass
    if (powers.max(axis=0, initial=0) > most).any() or (
        powers.min(axis=0, initial=0) < -most
    ).any():
        k, i = np.argwhere(np.abs(powers) > most)[0]
        raise ValueError(
            f"moments[{k + 1}, {i}]: found {powers[k, i]}; needed at most the mass {mass[i]}, "
            "in size"
        )


def compute_moment_bounds_backward(ctx: dict[str, Any], δbounds: ArrayLike) -> tuple[Array, Array]:
    """From the derivatives of a loss by bounds, (N,), to those by moments, (2n + 1, N), and by η.

    ctx : from `compute_moment_bounds`, which it leaves as it is.

    >>> from moit.gradients import moment_bounds
    >>> moments = np.array([[1.0], [0.0], [0.5], [0.0], [0.4]])
    >>> bounds, ctx = moment_bounds.compute_moment_bounds(
    ...     moments, np.array([0.9]), 1e-6, 0.25, return_backward_context=True
    ... )
    >>> by_moments, by_η = moment_bounds.compute_moment_bounds_backward(ctx, np.ones(1))
    >>> by_moments.shape, by_η.shape
    ((5, 1), (1,))
    """
    by_moments, by_place = ctx["slopes"]
    seed = checked_seed(δbounds, "δbounds", by_place.shape, by_place.dtype)
    return by_moments * seed, by_place * seed
