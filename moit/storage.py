"""Numbers as render targets hold them, for techniques of one's own that count what they store.

Each function gives what is read back of what is written, in the dtype that it was given; what adds
up in a target is rounded after every fragment (`added`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import one_of
from moit.checks.arrays import as_array
from moit.fragments.fragments import Fragments

__all__ = ["BITS", "added", "float32", "half", "rounded", "unorm8", "unorm16"]

Array = NDArray[Any]

BITS = {"unorm8": 8, "unorm16": 16, "half": 16, "float32": 32}
LARGEST_HALF = 65504.0


def half(values: ArrayLike) -> Array:
    """Floats of 16 bits, to the nearest; what is larger than the largest becomes it, 65504.

    values : real numbers of any shape; float32 and float64 keep their dtype, others give float64.

    >>> moit.storage.half([0.1, 1e9]).tolist()
    [0.0999755859375, 65504.0]
    """
    found = _real(values)
    return np.clip(found, -LARGEST_HALF, LARGEST_HALF).astype(np.float16).astype(found.dtype)


def float32(values: ArrayLike) -> Array:
    """Floats of 32 bits, to the nearest. Arguments as `half`.

    >>> moit.storage.float32([0.1]).tolist()
    [0.10000000149011612]
    """
    found = _real(values)
    with np.errstate(over="ignore"):
        return found.astype(np.float32).astype(found.dtype)


def unorm16(values: ArrayLike) -> Array:
    """Numbers of [0, 1] in 65,535 steps, to the nearest; what lies outside is clamped, NaN gives 0.
    Arguments as `half`.

    >>> (65535 * moit.storage.unorm16([0.25, 2.0])).tolist()
    [16384.0, 65535.0]
    """
    return _unorm(values, 16)


def unorm8(values: ArrayLike) -> Array:
    """The same in 255 steps.

    >>> (255 * moit.storage.unorm8([0.25, 2.0])).tolist()
    [64.0, 255.0]
    """
    return _unorm(values, 8)


_WAYS: dict[str, Callable[[ArrayLike], Array]] = {
    "unorm8": unorm8,
    "unorm16": unorm16,
    "half": half,
    "float32": float32,
}


def rounded(values: ArrayLike, storage: str) -> Array:
    """`values` as a target holds them: "half", "unorm16", "unorm8" or "float32".

    >>> moit.storage.rounded([0.1], "half").tolist()
    [0.0999755859375]
    """
    one_of("storage", storage, tuple(_WAYS))
    return _WAYS[storage](values)


def added(fragments: Fragments, values: ArrayLike, storage: str | None = None) -> Array:
    """The sum over each pixel's fragments, as blending adds them up in a target.

    values : (N,) or (N, S), a row for each fragment.
    storage : what the target holds, into which the sum is rounded after every fragment, in the
        order of arrival; None: nothing is rounded.

    Returns (P,) or (P, S), 0 in pixels without fragments; float32 and float64 keep their dtype.
    Raises ValueError where shapes disagree.

    >>> f = moit.Fragments([0, 2, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.storage.added(f, f.alpha, "unorm8").round(3).tolist()
    [1.0, 0.0]
    """
    one_of("storage", storage, (None, *_WAYS))
    found = _real(values)
    if not isinstance(fragments, Fragments):
        raise TypeError(f"fragments: expected Fragments, got {type(fragments).__name__}")
    if found.ndim not in (1, 2) or len(found) != len(fragments):
        raise ValueError(
            f"values: expected ({len(fragments)},) or ({len(fragments)}, S), got {found.shape}"
        )
    counts, begins = fragments.counts, fragments.offsets[:-1]
    sums = np.zeros((len(counts), *found.shape[1:]), found.dtype)
    order = np.argsort(-counts, kind="stable")  # pixels that still have fragments come first
    left = np.searchsorted(-counts[order], -np.arange(counts.max(initial=0)), side="left")
    for layer, pixels in enumerate(left):
        here = order[:pixels]
        more = sums[here] + found[begins[here] + layer]
        sums[here] = more if storage is None else rounded(more, storage)
    return sums


def _real(values: ArrayLike) -> Array:
    array = as_array(values, "values")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"values: expected real numbers, got {array.dtype}")
    return array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)


def _unorm(values: ArrayLike, bits: int) -> Array:
    """As csrc/kernels/storage.h has it: which side of a half a number lies on is exact."""
    found = _real(values)
    inside = np.clip(np.nan_to_num(found, nan=0.0), 0, 1)
    wide = inside * found.dtype.type(2**bits)
    near = np.rint(wide - inside)
    apart = wide - near
    word = near + (apart - 0.5 >= inside) - (apart + 0.5 < inside)
    held: Array = (word / found.dtype.type(2**bits - 1)).astype(found.dtype)
    return held
