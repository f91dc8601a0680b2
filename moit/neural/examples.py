"""What networks learn from: features of fragments, and the transmittance that is true of them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.checks.exceptions import FragmentsError
from moit.fragments.fragments import Fragments
from moit.neural.features import features
from moit.neural.losses import LOSSES, OF_SINGLE_FRAGMENTS, Truth
from moit.questions import transmittance

if TYPE_CHECKING:
    from numpy.random import Generator  # NumPy loads it on first use, since that takes long

Array = NDArray[Any]

# What T is of the share that a network says and of the two columns that follow its features: the
# share itself, or what passes all fragments if that is more; exp(-(L + share W)), between bounds,
# of slices, too, which by themselves say the share of one of the features; A + share D, a mixture
# of two answers.
ANSWERS = {
    "neural": "share",
    "neural-image": "share",
    "neural-bounded": "absorbance",
    "neural-bounded6": "absorbance",
    "strong": "absorbance",
    "neural-slices": "slices",
    "dfa": "mixture",
}
SLICES_ALONE = 8  # the feature that is that share


@dataclass(frozen=True)
class Examples:
    """Fragments as a network sees them; those of a pixel stand together.

    features : (N, inputs).
    truth : what is true of them; its pixels are the units that are shuffled.
    answer : what T is of the share that the network says, see ANSWERS.
    from_, width : (N,) what the share of `width` is added to. Where T is the share, `from_` is what
        passes all of the pixel's fragments.
    """

    features: Array
    truth: Truth
    answer: str
    from_: Array
    width: Array

    @property
    def starts(self) -> Array:
        """(pixels + 1,) where the fragments of each pixel begin, and the end."""
        return np.append(self.truth.starts, len(self.features))

    def transmittance(self, raw: Array, floor: bool = True) -> tuple[Array, Array]:
        """T of what the network puts out, (N,), and its derivative by that.

        floor : whether a share is raised to what passes all fragments. The core does; the paper's
            loss is of what the network says.
        """
        share = 1 / (1 + np.exp(-np.clip(raw, -60, 60)))
        slope = share * (1 - share)
        if self.answer == "share":
            if not floor:
                return share, slope
            return np.maximum(share, self.from_), slope * (share > self.from_)
        sum_ = self.from_ + share * self.width
        if self.answer == "mixture":
            return sum_, self.width * slope
        T = np.exp(-sum_)
        return T, -T * self.width * slope

    def loss(self, name: str, raw: Array) -> tuple[float, Array]:
        """One of LOSSES of what the network puts out, (1, N), and its derivatives by that."""
        T, slope = self.transmittance(raw[0], name not in OF_SINGLE_FRAGMENTS)
        value, by_T = LOSSES[name](T, self.truth)
        return value, (by_T * slope)[None]

    def ease(self, name: str) -> float:
        """1 over the loss where no order is known, every T the same, or of slices over that of what
        they say by themselves: sets by this count alike."""
        known = np.full_like(self.truth.exact, 0.5)
        if self.answer == "slices":
            known = np.exp(-(self.from_ + self.features[:, SLICES_ALONE] * self.width))
        return 1 / max(LOSSES[name](known, self.truth)[0], 1e-9)

    def for_loss(self, name: str) -> Examples:
        """The same with each fragment a unit of its own, where the loss allows."""
        if name not in OF_SINGLE_FRAGMENTS:
            return self
        each = np.ones(len(self.features), np.int64)
        weight = np.repeat(self.truth.weight, self.truth.counts)
        truth = replace(
            self.truth, starts=np.arange(len(self.features)), counts=each, weight=weight
        )
        return replace(self, truth=truth)

    def at_most(self, count: int) -> Examples:
        """The first units, as many as have at most `count` examples; one at least."""
        units = int(np.searchsorted(self.starts, count, side="right")) - 1
        return self.between(0, min(max(units, 1), len(self.truth.counts)))

    def standardised(self, mean: Array, scale: Array) -> Examples:
        """The same with features less `mean`, in units of `scale`."""
        return replace(self, features=((self.features - mean) / scale).astype(np.float32))

    def taken(self, units: Array) -> Examples:
        """Those units, in that order."""
        truth = self.truth
        counts = truth.counts[units]
        starts = np.cumsum(counts) - counts
        at = np.arange(counts.sum()) + np.repeat(truth.starts[units] - starts, counts)
        return Examples(
            self.features[at],
            Truth(truth.exact[at], truth.alpha[at], starts, counts, truth.weight[units]),
            self.answer,
            self.from_[at],
            self.width[at],
        )

    def between(self, first: int, last: int) -> Examples:
        """Units first to last - 1, without a copy."""
        truth = self.truth
        begin = truth.starts[first]
        end = truth.starts[last - 1] + truth.counts[last - 1]
        part = slice(begin, end)
        return Examples(
            self.features[part],
            Truth(
                truth.exact[part],
                truth.alpha[part],
                truth.starts[first:last] - begin,
                truth.counts[first:last],
                truth.weight[first:last],
            ),
            self.answer,
            self.from_[part],
            self.width[part],
        )


def network_kind(technique: Technique) -> str:
    """The kind of the networks that a technique runs; that of none where it runs none."""
    return technique.network_kind


def examples_of(f: Fragments, technique: Technique, name: str = "data") -> Examples:
    """Examples of all fragments of `f`, float32; each pixel that has some weighs as much.

    Raises FragmentsError where there is no fragment, or a feature is not finite.
    """
    if not len(f):
        raise FragmentsError(f"{name}: found no transparent fragment; needed at least one")
    found = features(f, technique)
    if not np.isfinite(found).all():
        at = tuple(np.argwhere(~np.isfinite(found))[0].tolist())
        raise FragmentsError(
            f"{name}: features{list(at)}: found {found[at]}; needed finite numbers"
        )
    answer = ANSWERS[network_kind(technique)]
    counts = f.counts.ravel()
    counts = counts[counts > 0]
    starts = np.cumsum(counts) - counts
    if answer == "share":
        total = np.multiply.reduceat(1 - f.alpha.astype(np.float64), starts)
        found = np.column_stack([found, np.repeat(total, counts), np.zeros(len(f))])
    exact = transmittance(f, "sorted", dtype=np.float64, cull_opaque=False)
    return Examples(
        found[:, :-2].astype(np.float32),
        Truth(
            exact.astype(np.float32),
            f.alpha.astype(np.float32),
            starts,
            counts,
            np.ones(len(counts), np.float32),
        ),
        answer,
        found[:, -2].astype(np.float32),
        found[:, -1].astype(np.float32),
    )


def joined(parts: Sequence[Examples], weights: Sequence[float] | None = None) -> Examples:
    """All of them, one after the other.

    weights : how much all units of each part weigh together, by default the same.
    """
    units = np.array([len(one.truth.counts) for one in parts])
    share = np.ones(len(parts)) if weights is None else np.asarray(weights)
    each = np.repeat(share / share.sum() * units.sum() / units, units).astype(np.float32)
    counts = np.concatenate([one.truth.counts for one in parts])
    return Examples(
        np.concatenate([one.features for one in parts]),
        Truth(
            np.concatenate([one.truth.exact for one in parts]),
            np.concatenate([one.truth.alpha for one in parts]),
            np.cumsum(counts) - counts,
            counts,
            each,
        ),
        parts[0].answer,
        np.concatenate([one.from_ for one in parts]),
        np.concatenate([one.width for one in parts]),
    )


def seen(f: Fragments) -> Fragments:
    """`f` without opaque surfaces, and without what lies behind them."""
    if not (f.alpha == 1).any():
        return f
    pixel = np.repeat(np.arange(f.counts.size), f.counts.ravel())
    nearest = np.full(f.counts.size, np.inf)
    opaque = f.alpha == 1
    np.minimum.at(nearest, pixel[opaque], f.depth[opaque])
    return chosen(f, (f.depth <= nearest[pixel]) & ~opaque)


def some(f: Fragments, most: int, rng: Generator) -> Fragments:
    """Whole pixels of `f`, chosen at random, of at most `most` fragments; one pixel at least."""
    if len(f) <= most:
        return f
    counts = f.counts.ravel()
    order = rng.permutation(np.flatnonzero(counts))
    taken = np.searchsorted(np.cumsum(counts[order]), most, side="right")
    keep = np.zeros(len(counts), bool)
    keep[order[: max(int(taken), 1)]] = True
    return chosen(f, np.repeat(keep, counts))


def chosen(f: Fragments, keep: Array) -> Fragments:
    """`f` with only those fragments for which `keep`, (N,), is true."""
    kept = np.concatenate([[0], np.cumsum(keep)])[f.offsets]
    return Fragments(
        kept,
        f.depth[keep],
        f.coverage[keep],
        None if f.color is None else f.color[keep],
        shape=f.shape,
        depth_range=f.depth_range,
        dtype=f.depth.dtype,
    )


def digest(sources: Sequence[Fragments]) -> str:
    """A name for the numbers in `sources`: 16 hexadecimal digits."""
    found = hashlib.sha256()
    for f in sources:
        for array in (f.offsets, f.depth, f.alpha, np.array(f.depth_range)):
            found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:16]
