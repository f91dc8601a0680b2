"""Derivatives of pictures forwards: how an answer moves as fragments do."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.arrays import as_array, finite
from moit.fragments import Fragments
from moit.gradients.composites import Gradients, composite, total_transmittance
from moit.inputs import as_fragments
from moit.questions import Input

__all__ = ["composite_jvp", "total_transmittance_jvp"]

Array = NDArray[Any]


def composite_jvp(
    f: Input,
    technique: str | Technique,
    *,
    d_depth: ArrayLike | None = None,
    d_alpha: ArrayLike | None = None,
    d_color: ArrayLike | None = None,
    d_transmission: ArrayLike | None = None,
    background: ArrayLike = (0, 0, 0),
    d_background: ArrayLike | None = None,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[Array, Array]:
    """The picture, and how it moves as fragments and the background move: (image, d_image).

    d_depth, d_alpha : (N,) motions; d_color, d_transmission : (N, 3); d_background : (3,) or
        (height, width, 3). None: what stays. They are finite.

    Other arguments, kinks and errors as `moit.gradients.composite`. Pixels hang on their own
    fragments, so four pullbacks tell it, of all pixels at once; of `transmittance`, which has a
    number a fragment, none would be cheap.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], [[1, 0, 0], [0, 1, 0]])
    >>> image, moves = moit.gradients.composite_jvp(f, "sorted", d_alpha=[0.1, 0])
    >>> moves.round(3).tolist()
    [[[0.1, -0.05, 0.0, 0.05]]]
    """
    given = _of_own_pixels(f, technique)
    behind = np.broadcast_to(as_array(background, "background"), (*given.shape, 3))
    image, pullback = composite(
        given, technique, background=behind, threads=threads, dtype=dtype, cull_opaque=cull_opaque
    )
    motions = _motions(
        len(given.depth),
        image.dtype,
        depth=d_depth,
        alpha=d_alpha,
        color=d_color,
        transmission=d_transmission,
    )
    if d_background is not None:
        moved = finite(as_array(d_background, "d_background"), "d_background", image.dtype)
        if moved.shape not in ((3,), behind.shape):
            raise ValueError(
                f"d_background: expected shape (3,) or {behind.shape}, got {moved.shape}"
            )
        motions["background"] = np.broadcast_to(moved, behind.shape)
    moves = np.empty_like(image)
    for channel in range(4):
        seed = np.zeros_like(image)
        seed[..., channel] = 1
        moves[..., channel] = _moved(pullback(seed), motions, given.offsets, given.shape)
    return image, moves


def total_transmittance_jvp(
    f: Input,
    technique: str | Technique,
    *,
    d_depth: ArrayLike | None = None,
    d_alpha: ArrayLike | None = None,
    d_transmission: ArrayLike | None = None,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[Array, Array]:
    """What is let through to the background, and how that moves as fragments do.

    As `composite_jvp`, of `moit.gradients.total_transmittance`.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], dtype="float64")
    >>> total, moves = moit.gradients.total_transmittance_jvp(f, "sorted", d_alpha=[0.1, 0])
    >>> moves.round(3).tolist()
    [[-0.05]]
    """
    given = _of_own_pixels(f, technique)
    total, pullback = total_transmittance(
        given, technique, threads=threads, dtype=dtype, cull_opaque=cull_opaque
    )
    motions = _motions(
        len(given.depth), total.dtype, depth=d_depth, alpha=d_alpha, transmission=d_transmission
    )
    by_channel = total.reshape(*given.shape, 1 if given.transmission is None else 3)
    moves = np.empty_like(by_channel)
    for channel in range(by_channel.shape[2]):
        seed = np.zeros_like(by_channel)
        seed[..., channel] = 1
        found = pullback(seed.reshape(total.shape))
        moves[..., channel] = _moved(found, motions, given.offsets, given.shape)
    return total, moves.reshape(total.shape)


def _of_own_pixels(f: Input, technique: str | Technique) -> Fragments:
    """Fragments, of a technique whose pixels hang on their own."""
    if not technique_named(technique).local:
        raise ValueError(
            f"technique: pixels of {technique} hang on their neighbours' fragments, so four "
            "pullbacks do not tell how they move; use resolution=1"
        )
    return as_fragments(f)


def _motions(n: int, dtype: DTypeLike, **given: ArrayLike | None) -> dict[str, Array]:
    """Those that are there, checked."""
    found: dict[str, Array] = {}
    for name, motion in given.items():
        if motion is None:
            continue
        array = finite(as_array(motion, f"d_{name}"), f"d_{name}", dtype)
        needed = (n, 3) if name in ("color", "transmission") else (n,)
        if array.shape != needed:
            raise ValueError(f"d_{name}: expected shape {needed}, got {array.shape}")
        found[name] = array
    return found


def _moved(
    by: Gradients, motions: dict[str, Array], offsets: Array, shape: tuple[int, int]
) -> Array:
    """What an answer a pixel moves by: sums over each pixel's fragments, in double."""
    parts = np.zeros(int(offsets[-1]))
    of_pixels = np.zeros(shape)
    for name, motion in motions.items():
        slope = getattr(by, name)
        if slope is None:
            raise ValueError(f"d_{name}: the fragments have no {name}; expected None")
        product = slope.astype(np.float64) * motion
        if name == "background":
            of_pixels += product.sum(axis=-1)
        else:
            parts += product if product.ndim == 1 else product.sum(axis=1)
    pixel = np.repeat(np.arange(of_pixels.size), np.diff(offsets.ravel()))
    return of_pixels + np.bincount(pixel, parts, of_pixels.size).reshape(shape)
