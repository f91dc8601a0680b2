"""Moment bounds as users of diffmoments call them: changing the import is all that is to be done.

    from moit.gradients.moment_bounds import compute_moment_bounds, compute_moment_bounds_backward

Worchel and Alexa, "Moment Bounds are Differentiable: Efficiently Approximating Measures in Inverse
Rendering", SIGGRAPH 2025, whose package these are named after; the computation is moit's own.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.catalog import PowerMoments, technique
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite
from moit.gradients.composites import checked_seed
from moit.moments import arrays_for
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
    rows = finite(rows, "moments", dtype)
    mass = rows[0]
    found = technique(f"power{len(rows) - 1}")
    assert isinstance(found, PowerMoments)
    chosen = dataclasses.replace(found, bias=bias, overestimation=overestimation_weight)
    means = np.divide(rows[1:], mass, out=np.zeros_like(rows[1:]), where=mass > 0)
    b0, b, z = arrays_for(chosen, mass, np.ascontiguousarray(means.T), at.astype(dtype)[:, None])
    fields = chosen.fields_for_core(dtype)
    bounds = _core.moments_absorbance(fields, thread_count(None), b0, b, z)[:, 0]
    if not truth("return_backward_context", return_backward_context):
        return bounds
    given = tuple(map(np.array, (b0, b, z)))  # not those that the caller may write over
    return bounds, {"fields": fields, "given": given}


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
    b0, b, z = ctx["given"]
    seed = checked_seed(δbounds, "δbounds", b0.shape, b0.dtype)
    by_b0, by_b, by_z, _ = _core.moments_pullback(
        ctx["fields"], thread_count(None), b0, b, z, True, np.ascontiguousarray(seed[:, None])
    )
    there = b0 > 0
    by_powers = np.divide(by_b, b0[:, None], out=np.zeros_like(by_b), where=there[:, None])
    by_mass = by_b0 - (by_powers * b).sum(axis=1)
    return np.vstack([by_mass, by_powers.T]), by_z[:, 0]
