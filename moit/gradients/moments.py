"""Derivatives of what moments by themselves say: of `moit.moments.transmittance` and `bounds`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core, moments
from moit.catalog import MomentTechnique, Technique, TrigonometricMoments
from moit.gradients.composites import checked_seed
from moit.moments import arrays_for, technique_of_moments
from moit.system.environment import thread_count

__all__ = ["MomentGradients", "moments_bounds", "moments_transmittance"]

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True, eq=False)
class MomentGradients:
    """Derivatives of a loss by moments and by what is asked of them, in their precision.

    b0 : (P,), with b as it is: mean powers do not hang on it.
    b : (P, m); of trigonometric moments complex: by the real parts, and i times by the imaginary.
    z : (P, K).
    alpha : (P, K); None where none was given.

    >>> z = [[-0.5, 0.5]]
    >>> T, pullback = moit.gradients.moments_transmittance("power4", [1.0], [[0, 0.5, 0, 0.4]], z)
    >>> pullback(np.ones_like(T)).b.shape
    (1, 4)
    """

    b0: Array
    b: Array
    z: Array
    alpha: Array | None


def moments_transmittance(
    technique: str | Technique,
    b0: ArrayLike,
    b: ArrayLike,
    z: ArrayLike,
    *,
    threads: int | None = None,
) -> tuple[Array, Callable[[ArrayLike], MomentGradients]]:
    """The transmittance that moments give in front of z, (P, K), and its pullback.

    Arguments as `moit.moments.transmittance`, of one pass of moments: power and trigonometric
    moments, and Moment Transparency in one pass, of floats. pullback(d_transmittance) takes (P, K).

    Where z crosses a node, or where what is absorbed is clamped to 0 or b0, derivatives are of one
    side. Few surfaces have moments that determine them: at these z what moments say turns fast.

    Raises ValueError for a technique without derivatives; else as `moit.moments.transmittance`.
    Source: the envelope theorem, as `moit.gradients.composite`.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], dtype="float64")
    >>> b0, b = moit.moments.gather(f, "power4")
    >>> T, pullback = moit.gradients.moments_transmittance("power4", b0, b, [[1.0]])
    >>> bool((pullback([[1.0]]).b0 < 0).all())
    True
    """
    found = _differentiable(technique)
    total, means, at = _own_arrays(found, b0, b, z)
    fields = found.fields_for_core(at.dtype)
    answer = moments.transmittance(found, b0, b, z, threads=threads)

    def pullback(d_transmittance: ArrayLike) -> MomentGradients:
        seed = checked_seed(d_transmittance, "d_transmittance", answer.shape, answer.dtype)
        workers = thread_count(threads)
        pulled = _core.moments_pullback(fields, workers, total, means, at, False, seed)
        return _gradients(found, pulled)

    return answer, pullback


def moments_bounds(
    technique: str | Technique,
    b0: ArrayLike,
    b: ArrayLike,
    z: ArrayLike,
    alpha: ArrayLike | None = None,
    *,
    threads: int | None = None,
) -> tuple[tuple[Array, Array], Callable[[ArrayLike, ArrayLike], MomentGradients]]:
    """What moments prove about the transmittance in front of z: (lower, upper), and the pullback.

    Arguments as `moit.moments.bounds`, of power moments; pullback(d_lower, d_upper) takes (P, K)
    each. What bounds are widened by for rounding stays as it is. Where a node of their polynomial
    would lie beyond [-2, 2] it is kept within, and the others' motion counts. Kinks and errors as
    `moments_transmittance`.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], dtype="float64")
    >>> b0, b = moit.moments.gather(f, "power4")
    >>> (lower, upper), pullback = moit.gradients.moments_bounds("power4", b0, b, [[0.1]])
    >>> pullback([[1.0]], [[0.0]]).z.shape
    (1, 1)
    """
    found = _differentiable(technique)
    if isinstance(found, TrigonometricMoments):
        raise ValueError(
            f"technique: {found} has no derivatives of bounds: what trigonometric moments prove "
            "does not hang on them; there are those of power moments"
        )
    total, means, at, *own = _own_arrays(found, b0, b, z, alpha)
    fields = found.fields_for_core(at.dtype)
    answer = moments.bounds(found, b0, b, z, alpha, threads=threads)
    shape, dtype = answer[0].shape, answer[0].dtype

    def pullback(d_lower: ArrayLike, d_upper: ArrayLike) -> MomentGradients:
        seeds = (
            checked_seed(d_lower, "d_lower", shape, dtype),
            checked_seed(d_upper, "d_upper", shape, dtype),
        )
        workers, alphas = thread_count(threads), own[0] if own else None
        pulled = _core.moments_bounds_pullback(fields, workers, total, means, at, alphas, *seeds)
        return _gradients(found, pulled)

    return answer, pullback


def _own_arrays(technique: MomentTechnique, *given: ArrayLike | None) -> list[Array]:
    """Which the caller cannot write over before he pulls back."""
    b0, b, z, *alpha = given
    assert b0 is not None and b is not None and z is not None
    return [np.array(one) for one in arrays_for(technique, b0, b, z, *alpha)]


def _differentiable(technique: str | Technique) -> MomentTechnique:
    found = technique_of_moments(technique)
    why = _core.moments_gradient_refusal(found.fields_for_core(np.dtype(np.float64)))
    if why is not None:
        raise ValueError(f"technique: {found} has no derivatives: {why}")
    return found


def _gradients(technique: MomentTechnique, found: tuple[Any, ...]) -> MomentGradients:
    b0, b, z, alpha = found
    if technique.moments_are_complex:
        b = b.view(np.result_type(b, 1j))
    return MomentGradients(b0, b, z, alpha)
