"""The two passes of moment techniques by themselves: gather moments, read transmittance back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.catalog import MomentTechnique, Technique
from moit.catalog import technique as technique_named
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite
from moit.questions import Asked, Input
from moit.system.environment import thread_count

__all__ = ["bounds", "gather", "least_bias", "least_pivot", "transmittance"]

# b0 and b of one pass, where a technique has two.
Pair = tuple[ArrayLike, ArrayLike]

HALF_MOST = 65504.0

# How far a depth in the unit range and a mean power may be outside: what rounding may add.
ROUNDED = 1e-6


def gather(
    f: Input,
    technique: str | Technique,
    raw: bool = False,
    *,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> tuple[Any, Any]:
    """Pass 1 alone: (b0 (P,), b (P, m)), as the technique stores them, before bias.

    b0 is the total absorbance in nepers; b the mean powers of warped depth, or of its point on the
    unit circle (trigonometric moments: complex64 or complex128), weighted by absorbance (moments
    divided by b0), 0 where b0 is; with transmission both are of the net coverage. Sums run in
    double precision and are rounded once; with 16-bit storage, b0 and b are what the stored words
    stand for.
    raw : with 16-bit storage give uint16 words instead, as fragments left them in the order of
        their arrival: (P, m) for power moments, (P, 2m) real and imaginary in turn for
        trigonometric; with 32-bit storage the same numbers.

    A technique of two passes of moments gives two such pairs, ((b0, b), (b0, b)). Moment
    Transparency makes its words of gathered moments: b is these, and `raw` gives the words (P, 4)
    and b0 as they are read. With a resolution above 1 it gives what each pixel reads of its blocks.

    Raises TypeError where the technique stores no moments, else as moit.composite.
    MBOIT section 3.1.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> b0, b = moit.moments.gather(f, "power4")
    >>> b0.round(3).tolist(), b.shape
    ([1.386], (1, 4))
    """
    found = technique_of_moments(technique)
    q = Asked.of(f, technique, threads, dtype, cull_opaque, part=part, layer=layer).in_core()
    b0, b = q.moments(truth("raw", raw))
    if found.moments_are_complex and b.dtype.kind == "f":
        b = b.view(np.result_type(b, 1j))
    sets = [(b0, b)]
    if found.moment_sets == 2:
        m = found.moment_count
        sets = [(b0, b[:, :m]), (b[:, m], b[:, m + 1 :])]
    if raw and found.keeps_words_of_moments:
        sets = [
            (
                np.minimum(b0, HALF_MOST).astype(np.float16).astype(b0.dtype),
                _core.moment_words(q.fields, q.threads, b),
            )
            for b0, b in sets
        ]
    pairs = [(np.ascontiguousarray(b0), np.ascontiguousarray(b)) for b0, b in sets]
    return (pairs[0], pairs[1]) if found.moment_sets == 2 else pairs[0]


def transmittance(
    technique: str | Technique,
    b0: ArrayLike | Pair,
    b: ArrayLike | Pair,
    z: ArrayLike,
    *,
    threads: int | None = None,
) -> NDArray[Any]:
    """Pass 2's reconstruction alone: the transmittance in front of z, (P, K).

    b0 : (P,) total absorbance, not negative; 0 gives 1.
    b : (P, m) moments divided by b0, before bias, each in [-1, 1]; trigonometric: complex, real and
        imaginary part each in [-1, 1].
    z : (P, K) warped depth, in the technique's `unit_range`.

    With two passes of moments `b0` and `b` are what `gather` gives: the pairs (b0, b) of the first
    and of the second pass.

    Computes in float64 where any of the arrays is float64 or complex128, else in float32. Raises
    ValueError where shapes disagree or a number is not finite or out of range, TypeError where the
    technique stores no moments. MBOIT algorithms 1 and 2.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> b0, b = moit.moments.gather(f, "power4")
    >>> moit.moments.transmittance("power4", b0, b, [[-1.0, 1.0]]).shape
    (1, 2)
    """
    found = technique_of_moments(technique)
    read = [arrays_for(found, *one, z, threads=threads) for one in _sets(found, b0, b)]
    dtype = max(one[0].dtype for one in read)
    state = read[0][1]
    if read[1:]:
        state = np.hstack([state, *(np.column_stack(one[:2]) for one in read[1:])])
    arrays = [np.ascontiguousarray(a, dtype) for a in (read[0][0], state, read[0][2])]
    return _core.moments_transmittance(
        found.fields_for_core(arrays[0].dtype), thread_count(threads), *arrays
    )


def bounds(
    technique: str | Technique,
    b0: ArrayLike | Pair,
    b: ArrayLike | Pair,
    z: ArrayLike,
    alpha: ArrayLike | None = None,
    *,
    threads: int | None = None,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """What moments prove about the transmittance in front of z: (lower, upper), (P, K) each.

    alpha : (P, K) opacities of surfaces known to lie at z, which do not occlude themselves.

    Other arguments and errors as `transmittance`; of two passes the first alone proves. Wide
    enough for what rounding to the arrays' dtype may have done to b0 and b, and for one unit in the
    last place of z.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> b0, b = moit.moments.gather(f, "power4")
    >>> lower, upper = moit.moments.bounds("power4", b0, b, [[0.0]])
    >>> bool((lower <= upper).all())
    True
    """
    found = technique_of_moments(technique)
    first = _sets(found, b0, b)[0]
    arrays = arrays_for(found, *first, z, alpha, threads=threads)
    own = arrays[3] if alpha is not None else None
    fields = found.fields_for_core(arrays[0].dtype)
    if found.moment_sets > 1:
        fields["passes"] = 1
    b0, b, z = arrays[:3]
    return _core.moments_bounds(fields, thread_count(threads), b0, b, z, own)


def least_pivot(
    technique: str | Technique,
    b0: ArrayLike | Pair,
    b: ArrayLike | Pair,
    *,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """How far moments, biased as the technique has it, are from impossible: the least pivot of
    their Hankel or Toeplitz matrix, (P,).

    b0, b : as in `transmittance`. Of two passes each pixel's lesser pivot counts.

    Where it is not positive, the matrix is not positive definite: rounding has made the moments
    those of no distribution, or left them on the border, where those of so few surfaces are that
    moments determine them. Pivots after the first that is not positive do not count. A small one
    magnifies the rounding of the next, which may be far below 0. 1 where b0 is 0. Power moments
    are factorised in twice the digits of float64, trigonometric ones in float64.

    Raises as `transmittance`. What Moment Transparency keeps of moments in words is looked at where
    words hold moments ("unorm16"); those of "nlqm" are valid whatever they hold.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.moments.least_pivot("power4", *moit.moments.gather(f, "power4")).shape
    (1,)
    """
    return np.asarray(_pivots(technique, b0, b, threads, False).min(axis=0))


def least_bias(
    technique: str | Technique,
    b0: ArrayLike | Pair,
    b: ArrayLike | Pair,
    *,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """The least bias, to within a thousandth of itself, with which `least_pivot` is positive, (P,):
    0 where it is without, infinity where it is with none. Of less than 1e-18, which float64 does
    not see, 2e-19 is said. Arguments as there; the technique's own bias plays no part.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.moments.least_bias("power4", *moit.moments.gather(f, "power4")).shape
    (1,)
    """
    return np.asarray(_pivots(technique, b0, b, threads, True).max(axis=0))


def _pivots(
    technique: str | Technique,
    b0: ArrayLike | Pair,
    b: ArrayLike | Pair,
    threads: int | None,
    needed: bool,
) -> NDArray[np.float64]:
    """(sets, P)."""
    found = technique_of_moments(technique)
    answers = []
    for one in _sets(found, b0, b):
        total = as_array(one[0], "b0")
        none = np.zeros((*total.shape[:1], 0), np.float32)
        arrays = arrays_for(found, total, one[1], none, threads=threads)
        fields = found.fields_for_core(arrays[0].dtype)
        pivots = _core.moments_pivots(fields, thread_count(threads), arrays[0], arrays[1], needed)
        answers.append(pivots)
    return np.stack(answers)


def _sets(
    technique: MomentTechnique, b0: ArrayLike | Pair, b: ArrayLike | Pair
) -> list[tuple[Any, Any]]:
    """The (b0, b) of each pass, from what `gather` gives."""
    if technique.moment_sets == 1:
        return [(b0, b)]
    for name, pair in (("b0", b0), ("b", b)):
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise ValueError(
                f"{name}: with {technique.base_name}, b0 and b must be the pairs of b0 (P,) and "
                f"b (P, {technique.moment_count}) of the first and of the second pass; got "
                f"{type(pair).__name__}"
            )
    return [tuple(b0), tuple(b)]  # type: ignore[arg-type, list-item]


def technique_of_moments(technique: str | Technique) -> MomentTechnique:
    """One that stores moments, or TypeError."""
    found = technique_named(technique)
    if not isinstance(found, MomentTechnique):
        raise TypeError(f"technique: expected one that stores moments, got {found}")
    return found


def arrays_for(
    technique: MomentTechnique,
    b0: ArrayLike,
    b: ArrayLike,
    z: ArrayLike,
    alpha: ArrayLike | None = None,
    *,
    threads: int | None = None,
) -> list[NDArray[Any]]:
    """The arrays in one dtype, with the shapes and of the values that the technique needs."""
    given = {"b0": b0, "b": b, "z": z} | ({} if alpha is None else {"alpha": alpha})
    found = {name: as_array(value, name) for name, value in given.items()}
    for name, array in found.items():
        complex_too = name == "b" and technique.moments_are_complex
        if array.dtype.kind not in ("fiuc" if complex_too else "fiu"):
            numbers = "complex" if complex_too else "real"
            raise TypeError(f"{name}: expected {numbers} numbers, got {array.dtype}")
    double = any(
        a.dtype.kind in "fc" and np.finfo(a.dtype).dtype.itemsize == 8 for a in found.values()
    )
    pixels = found["b0"].shape[0] if found["b0"].ndim == 1 else -1
    depths = found["z"].shape[1] if found["z"].ndim == 2 else -1
    needed = {
        "b0": (pixels,),
        "b": (pixels, technique.moment_count),
        "z": (pixels, depths),
        "alpha": (pixels, depths),
    }
    for name, array in found.items():
        if array.shape != needed[name]:
            raise ValueError(
                f"{name}: with {technique.base_name}, b0 must be (P,), b "
                f"(P, {technique.moment_count}), z and alpha (P, K); got "
                + ", ".join(f"{n} {a.shape}" for n, a in found.items())
            )
    dtype = np.float64 if double else np.float32
    if technique.moments_are_complex:
        numbers_of_b = np.ascontiguousarray(found["b"], np.complex128 if double else np.complex64)
        found["b"] = numbers_of_b.view(dtype)
    most = technique._most_moment + ROUNDED
    assert technique.unit_range is not None
    near, far = technique.unit_range
    limits = {
        "b0": (0, np.inf),
        "b": (-most, most),
        "z": (near - ROUNDED, far + ROUNDED),
        "alpha": (0, 1),
    }
    with np.errstate(over="ignore"):  # what becomes infinite is reported as such
        ready = {name: np.require(array, dtype, ["C", "A"]) for name, array in found.items()}
    # One look in lanes, on threads; what it is that is wrong, if anything, is found one by one.
    greatest = float(np.finfo(dtype).max)
    checks = tuple(
        (array, float(limits[name][0]), min(float(limits[name][1]), greatest))
        for name, array in ready.items()
    )
    if _core.numbers_within(thread_count(threads), checks):
        return list(ready.values())
    for name, array in found.items():
        ready[name] = finite(array, name, dtype)
    for name, array in ready.items():
        check_within(array, name, *limits[name])
    return list(ready.values())


def check_within(array: NDArray[Any], name: str, least: float, most: float) -> None:
    # The ends first: they need no array of truths, which take longer than four moments do.
    if not array.size or (array.min() >= least and array.max() <= most):
        return
    good = (array >= least) & (array <= most)
    if not good.all():
        at = np.unravel_index(int(np.argmin(good)), array.shape)
        place = ", ".join(str(int(i)) for i in at)
        limits = f"from {least:.3g} to {most:.3g}" if most < np.inf else "that is not negative"
        raise ValueError(f"{name}[{place}]: found {array[at]}; needed a number {limits}")
