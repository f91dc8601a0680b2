"""Derivatives of a technique's answers by the numbers of fragments."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.catalog import Technique, techniques
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError
from moit.core.questions import CoreQuestion, background_for
from moit.questions import Asked, Input, depths_for

__all__ = ["Gradients", "composite", "total_transmittance", "transmittance"]

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of a loss by the numbers of fragments, in the fragments' precision.

    depth, alpha : (N,).
    color : (N, 3); None where the fragments have none.
    transmission : (N, 3); None where the fragments have none.
    network : by the weights of the technique's network as `Network.packed` has them, float64; None
        where it has none.
    background : of the shape that the background was given in; None where none was.

    >>> f = moit.Fragments([0, 1], [1.0], [0.5], dtype="float64")
    >>> total, pullback = moit.gradients.total_transmittance(f, "sorted")
    >>> pullback([[1.0]]).alpha.tolist()
    [-1.0]
    """

    depth: Array
    alpha: Array
    color: Array | None
    background: Array | None
    transmission: Array | None
    network: Array | None = None


Pullback = Callable[[ArrayLike], Gradients]

# What pullbacks call their argument.
SEEDS = {
    "composite": "d_image",
    "transmittance": "d_transmittance",
    "total_transmittance": "d_total",
}


def composite(
    f: Input,
    technique: str | Technique,
    *,
    background: ArrayLike = (0, 0, 0),
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[Array, Pullback]:
    """The picture that a technique makes of fragments, and its pullback.

    Arguments as `moit.composite`, whose picture this gives, to the last bit. Depth, alpha, colour,
    transmission and the background vary; the fragments' depth_range, the number of fragments, and
    of "unsorted" their order stay as they are. Computed on the CPU, between the fragments' numbers
    and the results in double, with the same bits for any number of threads.

    pullback(d_image) : d_image (height, width, 4), finite: derivatives of a loss by the picture.
        Returns `Gradients`. It may be called at any time, from threads, too, and answers anew:
        nothing is kept but the arguments, of which fragments that share arrays with the caller
        show changes of these.

    Derivatives are numbers: of one that the dtype does not hold, its largest. Where an answer has a
    kink, they are those of one side:

    - Fragments of equal depth keep their order, of moments each its place.
    - Alpha beyond `max_alpha` absorbs no more, and up to it as it does below.
    - An opaque surface stays one: where it is culled (`cull_opaque`) its alpha and all behind it
      get 0. Otherwise alpha 1 is on the side of less.
    - A bound that is reached (a weight's, a colour's greatest channel) stays reached.
    - With depth_range="pixel" the first of the nearest and of the farthest fragments moves that
      range.
    - depth of "sorted" and "unsorted" gets 0: their answers jump where an order changes.

    - Which fragments are kept or come first, what rounding adds to steps of slices, between which
      slices a network sees a fragment, and shares of blocks that go by opaque surfaces stay.
    - "stochastic" gives what its samples estimate: by transmittances and, with normalize=False, by
      pictures, derivatives that are on average those of "sorted".
    - Slices at a bound of moments (`inside`) are on its side.
    - What state holds in 16 bits, or keys of front layers in 32, moves as if these held all digits
      (straight-through).

    Raises ValueError for a technique without derivatives, saying why and what is nearest that has
    some, and for what does not fit; FragmentsError for fragments with a back, a deviation or
    emission, or without colour; else as `moit.composite`.

    Sources: power moments by the envelope theorem for the linear program whose optimum they are
    (Krein and Nudelman 1977); the others by the chain rule from back to front.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], [[1, 0, 0], [0, 1, 0]])
    >>> image, pullback = moit.gradients.composite(f, "sorted")
    >>> d = pullback(image - [[[1, 0, 0, 1]]])  # of half the squared distance
    >>> d.alpha.round(4).tolist()
    [-0.75, 0.0]
    """
    asked = _asked(f, technique, threads, dtype, cull_opaque)
    question = _question(asked, "composite", background)
    # a caller may write over his array before he pulls back
    return dataclasses.replace(question, background=np.array(question.background)).answered()


def transmittance(
    f: Input,
    technique: str | Technique,
    depth: ArrayLike | None = None,
    *,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[Array, Pullback]:
    """The transmittance in front of each fragment, (N,), or at depths, and its pullback.

    As `moit.transmittance`; pullback(d_transmittance) takes its shape: (N,), or with depths (K,)
    the curves' (height, width, K). Depths that are asked about stay as they are. Other arguments,
    kinks and errors as `composite`, but that colour is not needed; TypeError where depths are given
    and the technique has no curve.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> T, pullback = moit.gradients.transmittance(f, "power4(exclude_self=True)")
    >>> pullback([0, 1]).alpha.round(3).tolist()
    [-1.0, 0.0]
    """
    asked = _asked(f, technique, threads, dtype, cull_opaque)
    depths = depths_for(depth, asked.technique)
    depths = depths if depths is None else np.array(depths)
    return dataclasses.replace(_question(asked, "transmittance"), depths=depths).answered()


def total_transmittance(
    f: Input,
    technique: str | Technique,
    *,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[Array, Pullback]:
    """What a technique lets through to the background, and its pullback.

    As `moit.total_transmittance`; pullback(d_total) takes its shape, (height, width) or with
    transmission (height, width, 3). Arguments, kinks and errors as `composite`, but that colour is
    not needed.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.25], dtype="float64")
    >>> total, pullback = moit.gradients.total_transmittance(f, "power4")
    >>> pullback([[1.0]]).alpha.round(3).tolist()
    [-0.75, -0.5]
    """
    asked = _asked(f, technique, threads, dtype, cull_opaque)
    return _question(asked, "total_transmittance").answered()


def _asked(
    f: Input,
    technique: str | Technique,
    threads: int | None,
    dtype: DTypeLike | None,
    cull_opaque: bool,
) -> Asked:
    asked = Asked.of(f, technique, threads, dtype, cull_opaque)
    if not asked.technique.has_gradient:
        raise ValueError(_why_none(asked.technique))
    for name in ("back", "deviation", "emission"):
        if getattr(asked.fragments, name) is not None:
            raise FragmentsError(
                f"{name}: there are derivatives of surfaces only; expected None, got an array"
            )
    return asked


# Why kinds have no derivatives, and what is nearest that has.
CHOOSES = "which fragments merge is chosen by what they do to a curve, and jumps with it"
DRAWN = "what its samples keep is drawn, and a picture of them is steps"
REASONS = {
    "hashed-alpha": (DRAWN, "stochastic8"),
    "adaptive": (CHOOSES, "hybrid4"),
    "mlab": (CHOOSES, "hybrid4"),
    "deep-shadow": (CHOOSES, "sorted"),
    "avboit": ("light behind slices is kept in 255 steps", "slices64"),
    "anchors": ("what is kept is chosen by importance, and jumps with it", "hybrid4"),
    "strong": ("what is kept is chosen by importance, and jumps with it", "hybrid4"),
}


def _why_none(technique: Technique) -> str:
    able = ", ".join(dict.fromkeys(t.kind for t in techniques() if t.has_gradient))
    why, nearest = REASONS.get(technique.kind, ("it is not of the core", "sorted"))
    return (
        f"technique: {technique} has no derivatives: {why}; "
        f"the nearest that has is {nearest} (all that have: {able})"
    )


def _question(asked: Asked, asks: str, background: ArrayLike | None = None) -> Differentiable:
    """Put to the core, of a technique whose options allow derivatives."""
    behind = None
    if asks == "composite":
        if asked.fragments.color is None:
            raise FragmentsError("color: composite needs the fragments' colour; found None")
        behind = background_for((0, 0, 0) if background is None else background, asked.fragments)
    question = CoreQuestion(asked.fragments, asked.technique, **asked.how)
    why = _core.gradient_refusal(question.fields)
    if why is not None:
        raise ValueError(f"technique: {asked.technique} has no derivatives: {why}")
    return Differentiable(question, asks, behind)


@dataclasses.dataclass(frozen=True, eq=False)
class Differentiable:
    """A question whose answer has derivatives.

    asks : "composite", "transmittance" (in front of each fragment) or "total_transmittance".
    background : as engines take it; None where the question has none.
    depths : of curves, which transmittance asks for then; None: there are none.
    """

    question: CoreQuestion
    asks: str
    background: NDArray[Any] | None
    depths: NDArray[np.float64] | None = None

    @classmethod
    def of(
        cls,
        asks: str,
        f: Input,
        technique: str | Technique,
        background: ArrayLike | None = None,
        threads: int | None = None,
        cull_opaque: bool = True,
    ) -> Differentiable:
        """Arguments as `composite`, which are checked."""
        return _question(_asked(f, technique, threads, None, cull_opaque), asks, background)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the answer."""
        f = self.question.given[0]
        if self.depths is not None:
            return (*f.shape, len(self.depths))
        if self.asks == "transmittance":
            return (len(f.depth),)
        if self.asks == "composite":
            return (*f.shape, 4)
        return f.shape if f.transmission is None else (*f.shape, 3)

    def answered(self) -> tuple[Array, Pullback]:
        return self.answer(), self.pull

    def answer(self) -> Array:
        if self.background is not None:
            return self.question.composite(self.background)
        if self.asks == "transmittance":
            return self.question.transmittance(self.depths)
        return self.question.total_transmittance()

    def pull(self, seed: ArrayLike) -> Gradients:
        """The derivatives of sum(seed * answer); it answers anew, so nothing need be kept."""
        f, name = self.question.given[0], SEEDS[self.asks]
        by_answer = checked_seed(seed, name, self.shape, f.depth.dtype)
        if self.depths is not None and self.depths.size:
            return _gradients(_core.curve_pullback(*self.question.given, self.depths, by_answer))
        if self.depths is not None:  # of none
            by_answer = np.zeros(len(f.depth), f.depth.dtype)
        if self.background is None:
            ask = getattr(_core, f"{self.asks}_pullback")
            return _gradients(ask(*self.question.given, by_answer))
        found = _core.composite_pullback(*self.question.given, self.background, by_answer)
        behind: Any = found[4]
        return _gradients(found, behind.astype(f.depth.dtype))


def checked_seed(given: ArrayLike, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> Array:
    """Derivatives of a loss by an answer, as pullbacks take them."""
    array = as_array(given, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got {array.dtype}")
    if array.shape != shape:
        raise ValueError(f"{name}: expected shape {shape}, got {array.shape}")
    return finite(array, name, dtype)


def _gradients(found: tuple[Any, ...], background: Array | None = None) -> Gradients:
    depth, alpha, color, transmission, _, network = found
    return Gradients(depth, alpha, color, background, transmission, network)
