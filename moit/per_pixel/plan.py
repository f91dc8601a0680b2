"""A technique for every pixel: what `PerPixel` does, and what it says of it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import PerPixel, Sorted, Technique
from moit.catalog import technique as technique_named
from moit.checks.exceptions import FragmentsError
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.per_pixel.selection import Selection, worst_of

Array = NDArray[Any]
Places = NDArray[np.int64]

# What is tried where nobody says otherwise: found by measurement on all of moit.scenes, at 1/255
# to 16/255. Peeling is exact for few layers, but takes a pass of geometry for each: no more than 4.
CANDIDATES = (
    "weighted-sum",
    "wboit-eq7",
    "wboit-eq10",
    "depth-peeling4",
    "power4-16(exclude_self=True,overestimation=0.4)",
    "fourier7(exclude_self=True)",
    "trig4-16(exclude_self=True,overestimation=0.5)",
    "adaptive8",
    "trig4(exclude_self=True,overestimation=0.5)",
    "fourier31(exclude_self=True)",
    "adaptive16",
    "adaptive8(quantized=False)",
    "adaptive32",
    "adaptive16(quantized=False)",
    "adaptive32(quantized=False)",
)
SORTED_BITS = 96  # depth, alpha and colour of a fragment that is kept
ALLOWED = 1e-3  # share of pixels that may be off by more than max_error, where it is predicted
DOUBT = 0.001  # the chance that more are
TAUGHT = 3 / 8  # of the sample; the rest tests what was learned
LEAST_TAUGHT, MOST_TAUGHT = 200, 12288
BLOCK = 1 << 16  # pixels that are chosen for at a time: room for all candidates' chances
NEARLY_ALL = 1.25  # of a sample: so many pixels are all tried


@dataclasses.dataclass(frozen=True)
class Plan:
    """Which technique each pixel gets.

    techniques : the candidates, and `sorted` last.
    of_pixel : (P,) an index into them.
    bits : (P,) what that takes.
    counts : (P,) fragments of the pixel that no opaque surface hides.
    tried : pixels whose errors were measured, and...
    predicted : (n,) errors of pixels chosen at random among those with fragments, with their
        weights (n,): what there will be; with a certificate, what there may be at most.
    """

    techniques: tuple[Technique, ...]
    of_pixel: Places
    bits: NDArray[np.float64]
    counts: Places
    tried: Places
    predicted: NDArray[np.float64]
    weights: NDArray[np.float64]

    def groups(self) -> Iterator[tuple[Technique, Places]]:
        """Each technique that has pixels, with these."""
        for index in np.unique(self.of_pixel):
            yield self.techniques[index], np.flatnonzero(self.of_pixel == index)


def plan_of(seen: Selection, technique: PerPixel, bright: float = 1.0, curve: bool = False) -> Plan:
    """Chooses a technique for each pixel.

    bright : what backgrounds may be, from -bright to bright.
    curve : whether techniques must have one.
    """
    return _Choosing(seen, technique, bright, curve).plan()


class _Choosing:
    """How a plan comes about."""

    def __init__(self, seen: Selection, technique: PerPixel, bright: float, curve: bool) -> None:
        self.seen, self.asked, self.bright = seen, technique, bright
        f = seen.f
        self.facts = _core.pixel_facts(f, seen.cull_opaque, seen.threads)
        self.counts = self.facts[:, 0].astype(np.int64)
        named = candidates(f, self.asked, curve)
        self.candidates = sorted(named, key=lambda one: float(one.bits_per_pixel or 0))
        self.bits = np.array([one.bits_per_pixel for one in self.candidates], np.float64)
        exact = np.array([one.exact_up_to for one in self.candidates], np.int64)
        # By count: what is right without a doubt and takes least, and what it takes.
        self.last = len(self.candidates)
        every = np.arange(self.counts.max(initial=0) + 1)
        bits = np.where(exact[:, None] >= every, self.bits[:, None], np.inf)
        sure = np.vstack([bits, SORTED_BITS * every])
        self.sure, self.sure_bits = sure.argmin(axis=0), sure.min(axis=0)
        self.of_pixel = np.where(self.counts == 0, self.last, self.sure[self.counts])
        cheapest = self.bits.min(initial=np.inf)
        self.open = np.flatnonzero((self.counts > 0) & (cheapest < self.sure_bits[self.counts]))
        self.tried = np.empty(0, np.int64)
        self.predicted = np.zeros(1)
        self.weights = np.ones(1)

    def plan(self) -> Plan:
        if len(self.open):
            if self.asked.certify:
                self.prove()
            else:
                self.predict()
        bits = np.append(self.bits, 0)[self.of_pixel]
        bits = np.where(self.of_pixel == self.last, SORTED_BITS * self.counts, bits)
        return Plan(
            (*self.candidates, Sorted()),
            self.of_pixel,
            bits,
            self.counts,
            self.tried,
            self.predicted,
            self.weights,
        )

    # ---- By errors of a sample

    def predict(self) -> None:
        random = np.random.default_rng(self.asked.seed)
        size = self.asked.sample
        drawn = random.permutation(self.open)
        if len(drawn) > NEARLY_ALL * size:
            drawn = drawn[:size]
        taught = min(int(len(drawn) * TAUGHT), MOST_TAUGHT)
        if len(drawn) == len(self.open) or taught < LEAST_TAUGHT:
            taught = 0
        # Neighbours lie side by side in memory; which of the two parts they are in is kept.
        lessons, tests = np.sort(drawn[:taught]), np.sort(drawn[taught:])
        self.tried = np.concatenate([lessons, tests])
        error = self.errors(self.tried)
        good = np.append(error <= self.asked.max_error, np.ones((len(error), 1), bool), axis=1)
        measured = np.where(good, self.prices(self.tried), np.inf).argmin(axis=1)
        if taught:
            self.generalize(lessons, tests, error)
        elif len(drawn) == len(self.open):
            truth = np.append(error, np.zeros((len(error), 1)), axis=1)
            unseen = int((self.counts > 0).sum()) - len(self.tried)  # which are exact
            self.foresee(truth, measured, unseen or len(self.tried))
        self.of_pixel[self.tried] = measured

    def prices(self, pixels: Places) -> NDArray[np.float64]:
        """(n, techniques): bits of each, `sorted` last."""
        counts = self.counts[pixels]
        each = np.tile(np.append(self.bits, 0), (len(pixels), 1))
        each[:, -1] = SORTED_BITS * counts
        return each

    def generalize(self, lessons: Places, tests: Places, error: Array) -> None:
        """Chooses for pixels that were not tried."""
        from moit.per_pixel.error_chances import Chances, least_price

        most, last = self.asked.max_error, self.last
        known = Chances(self.features(lessons), error[: len(lessons)], most, self.asked.seed)
        others = np.setdiff1d(self.open, self.tried, assume_unique=True)
        truth = np.append(error[len(lessons) :], np.zeros((len(tests), 1)), axis=1)
        bits, chance = self.prices(tests), self.chances(known, tests)

        def failures(price: float) -> int:
            chosen = (bits + price * chance).argmin(axis=1)
            return int((truth[np.arange(len(tests)), chosen] > most).sum())

        unseen = int((self.counts > 0).sum()) - len(self.tried)
        price = least_price(failures, len(tests), len(others), int(ALLOWED * unseen), DOUBT)
        if price is None:
            chosen = self.sure[self.counts[tests]]
        else:
            chosen = (bits + price * chance).argmin(axis=1)
            for begin in range(0, len(others), BLOCK):
                some = others[begin : begin + BLOCK]
                cost = self.prices(some) + price * self.chances(known, some)
                self.of_pixel[some] = cost.argmin(axis=1)
        self.foresee(np.where(np.arange(last + 1) == last, 0, truth), chosen, unseen)

    def chances(self, known: Any, pixels: Places) -> NDArray[np.float64]:
        """(n, techniques) of failure; 0 where a technique is exact, as `sorted` is."""
        found = np.append(known.at(self.features(pixels)), np.zeros((len(pixels), 1)), axis=1)
        counts = self.counts[pixels, None]
        exact = np.array([one.exact_up_to for one in self.candidates] + [np.iinfo(np.int64).max])
        return np.where(counts <= exact, 0, found)

    def features(self, pixels: Places) -> NDArray[np.float64]:
        return _features(self.facts[pixels])

    def foresee(self, error: Array, chosen: Places, pixels: int) -> None:
        """Keeps what errors there will be of so many pixels: those of pixels that were open, and
        none elsewhere."""
        found = error[np.arange(len(chosen)), chosen]
        sure = int((self.counts > 0).sum()) - len(self.open)
        share = max(pixels - sure, 0) / max(len(found), 1)
        self.predicted = np.append(found, 0)
        self.weights = np.append(np.full(len(found), share), sure)

    def errors(self, pixels: Places) -> NDArray[np.float64]:
        """(n, candidates): how far each is off."""
        if self.seen.f.color is None:
            return self.errors_of_transmittance(pixels)
        coloured, levels = self.seen.f.transmission is not None, self.seen.levels(self.bright)
        behind = [np.full(3, level) for level in levels]
        sorted_f = in_precision(self.seen.part(pixels), np.float64)
        exact = [self.seen.ask(sorted_f, Sorted()).composite(b).reshape(-1, 4) for b in behind]
        found = np.empty((len(pixels), len(self.candidates)))
        for j, one in enumerate(self.candidates):
            given = np.stack([self.seen.colors(pixels, one, b) for b in behind])
            found[:, j] = worst_of(np.abs(given - exact), self.bright, coloured)
        return found

    def errors_of_transmittance(self, pixels: Places) -> NDArray[np.float64]:
        part = self.seen.part(pixels)
        exact = self.seen.ask(in_precision(part, np.float64), Sorted()).transmittance(None)
        pixel = np.repeat(np.arange(len(pixels)), part.counts)
        found = np.empty((len(pixels), len(self.candidates)))
        for j, one in enumerate(self.candidates):
            off = part.coverage * np.abs(self.seen.ask(part, one).transmittance(None) - exact)
            found[:, j] = np.bincount(pixel, off, minlength=len(pixels))
        return found

    # ---- By proof

    def prove(self) -> None:
        """Takes the cheapest candidate that is good enough whatever the exact answer is."""
        from moit.per_pixel.certificates import ColorsBetween, SumsBetween

        left, far = self.open, np.zeros(len(self.counts))
        part = self.seen.part(left)
        error_of = (
            SumsBetween(self.seen, left, part)
            if part.color is None
            else ColorsBetween(self.seen, left, part, self.bright)
        )
        place = np.flatnonzero(error_of.least <= self.asked.max_error)
        for j, one in enumerate(self.candidates):
            place = place[self.sure_bits[self.counts[left[place]]] > self.bits[j]]
            if not len(place):
                break
            error = error_of(one, place)
            good = error <= self.asked.max_error
            self.of_pixel[left[place[good]]] = j
            far[left[place[good]]] = error[good]
            place = place[~good]
        shown = self.counts > 0
        self.predicted, self.weights = far[shown], np.ones(int(shown.sum()))


def candidates(f: Fragments, how: PerPixel, curve: bool) -> list[Technique]:
    """What may be chosen for these fragments."""
    if how.techniques is not None:
        found = [technique_named(name) for name in how.techniques]
        return [one for one in found if one.has_curve or not curve]
    return [
        one
        for one in _made(f.depth_range[0] > 0)
        if (one.has_curve or not curve)
        and (f.transmission is None or one.supports_transmission)
        and _takes(one, f)
    ]


@functools.cache
def _made(log: bool) -> tuple[Technique, ...]:
    found = []
    for one in map(technique_named, CANDIDATES):
        warps = one.depth_warp is not None and not log
        options: dict[str, Any] = {"warp": "linear"} if warps else {}
        found.append(dataclasses.replace(one, **options))
    return tuple(found)


def _takes(one: Technique, f: Fragments) -> bool:
    try:
        one.fields_for(f)
    except FragmentsError:
        return False
    return True


def _features(facts: NDArray[np.float64]) -> NDArray[np.float64]:
    """What is learned from: the facts of moit_fact, and products that errors are like."""
    covered, overlap = facts[:, 2], facts[:, 3]
    twice = np.minimum(covered, overlap)
    color = facts[:, 8:12] * np.stack([twice, covered, covered, covered], axis=1)
    return np.column_stack([facts[:, :8], color, facts[:, 12]])
