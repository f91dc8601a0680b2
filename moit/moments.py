"""The two passes of moment techniques by themselves: gather moments, read transmittance back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.arrays import as_array
from moit.catalog import PowerMoments, Technique, technique as technique_named
from moit.environment import thread_count
from moit.questions import Input, _Question, check_finite

__all__ = ["bounds", "gather", "transmittance"]


def gather(
    f: Input,
    technique: str | Technique,
    raw: bool = False,
    *,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Pass 1 alone: (b0 (P,), b (P, m)), as the technique stores them, before bias.

    b0 is the total absorbance in nepers; b the mean powers of warped depth, weighted by absorbance
    (moments divided by b0), 0 where b0 is. Sums run in double precision and are rounded once.
    raw : the stored words; for 32-bit storage the same numbers.

    Raises TypeError where the technique stores no moments, else as moit.composite.
    MBOIT section 3.1.
    """
    _moments_of(technique)
    q = _Question(f, technique, "cpu", threads, dtype, cull_opaque)
    return _core.gather(*q.for_core())


def transmittance(
    technique: str | Technique,
    b0: ArrayLike,
    b: ArrayLike,
    z: ArrayLike,
    *,
    threads: int | None = None,
) -> NDArray[Any]:
    """Pass 2's reconstruction alone: the transmittance in front of z, (P, K).

    b0 : (P,) total absorbance, not negative; 0 gives 1.
    b : (P, m) moments divided by b0, before bias.
    z : (P, K) warped depth, in the technique's `unit_range`.

    Computes in float64 where any of the arrays is float64, else in float32. Raises ValueError
    where shapes disagree or a number is not finite, TypeError where the technique stores no
    moments. MBOIT algorithm 1.
    """
    found = _moments_of(technique)
    arrays = _arrays(found, b0=b0, b=b, z=z)
    return _core.moments_transmittance(_fields(found, arrays[0]), thread_count(threads), *arrays)


def bounds(
    technique: str | Technique,
    b0: ArrayLike,
    b: ArrayLike,
    z: ArrayLike,
    alpha: ArrayLike | None = None,
    *,
    threads: int | None = None,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """What moments prove about the transmittance in front of z: (lower, upper), (P, K) each.

    alpha : (P, K) opacities of surfaces known to lie at z, which do not occlude themselves.

    Other arguments and errors as `transmittance`. Wide enough for what rounding to the arrays'
    dtype may have done to b0 and b, and for one unit in the last place of z.
    """
    found = _moments_of(technique)
    b0, b, z, *rest = _arrays(found, b0=b0, b=b, z=z, alpha=alpha)
    own = rest[0] if rest else None
    if own is not None and own.size and not (own.min() >= 0 and own.max() <= 1):
        raise ValueError("alpha: expected numbers from 0 to 1")
    return _core.moments_bounds(_fields(found, b0), thread_count(threads), b0, b, z, own)


def _moments_of(technique: str | Technique) -> PowerMoments:
    found = technique_named(technique)
    if not isinstance(found, PowerMoments):
        raise TypeError(f"technique: expected one that stores moments, got {found}")
    return found


def _fields(technique: PowerMoments, array: NDArray[Any]) -> dict[str, Any]:
    return {**technique.fields_for_core(), "bias": technique.bias_for(array.dtype)}


def _arrays(technique: PowerMoments, **given: ArrayLike | None) -> list[NDArray[Any]]:
    """The arrays in one dtype, with the shapes that the technique needs, finite."""
    found = {name: as_array(value, name) for name, value in given.items() if value is not None}
    for name, array in found.items():
        if array.dtype.kind not in "fiu":
            raise TypeError(f"{name}: expected real numbers, got {array.dtype}")
    double = any(a.dtype.kind == "f" and a.dtype.itemsize == 8 for a in found.values())
    pixels = found["b0"].shape[0] if found["b0"].ndim == 1 else -1
    depths = found["z"].shape[1] if found["z"].ndim == 2 else -1
    needed = {
        "b0": (pixels,),
        "b": (pixels, technique.count),
        "z": (pixels, depths),
        "alpha": (pixels, depths),
    }
    for name, array in found.items():
        if array.shape != needed[name]:
            raise ValueError(
                f"{name}: with {technique.base_name}, b0 must be (P,), b (P, {technique.count}), "
                f"z and alpha (P, K); got "
                + ", ".join(f"{n} {a.shape}" for n, a in found.items())
            )
    dtype = np.float64 if double else np.float32
    with np.errstate(over="ignore"):
        ready = [np.require(array, dtype, ["C", "A"]) for array in found.values()]
    for name, array in zip(found, ready, strict=True):
        check_finite(array, name)
    if ready[0].size and ready[0].min() < 0:
        at = int(np.argmin(ready[0] >= 0))
        raise ValueError(f"b0[{at}]: found {ready[0][at]}; needed a number that is not negative")
    return ready
