"""How likely techniques err by too much on a pixel, learned from pixels whose errors are known.

Boosted trees (Friedman, "Greedy function approximation", 2001) predict all techniques' errors at
once from facts of pixels; what they leave over says how far off they may be. Their answers only
rank choices: what is claimed of them is tested on other pixels (`least_price`). Everything is
sums in a fixed order, so the same numbers in give the same bits out.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Places = NDArray[np.int64]

BINS = 32  # of each fact
ROUNDS, DEPTH, RATE = 15, 5, 0.3  # trees that add up, their levels, and the share of each
LEAST_LEAF = 20
VIEWS = 3  # random sums of techniques' errors that one tree looks at
TAIL = 0.01  # the share of greatest surprises that a tail is fitted to
LEAST_SPREAD = 0.02


def excess(error: Numbers, most: float) -> Numbers:
    """Errors as numbers from -1 to 1, 0 at `most`: steep where it matters, and flat far away."""
    return (error - most) / (error + most)


class _Tree:
    """Cells of pixels, each with the means of its techniques' targets.

    place : (n, facts) bins; target : (n, techniques); seen : (n, views), by which cells are cut.
    """

    def __init__(
        self, place: Places, target: Numbers, seen: Numbers, depth: int, least: int
    ) -> None:
        pixels, facts = place.shape
        self.cuts: list[tuple[Places, Places]] = []
        self.cell = np.zeros(pixels, np.int64)
        for level in range(depth):
            cells = 2**level
            gain = self._gains(place, seen, cells, least)
            flat = gain.reshape(cells, facts * BINS)
            best = flat.argmax(axis=1)
            fact_of, last = best // BINS, best % BINS
            last[flat.max(axis=1) <= 1e-12] = BINS  # no cut
            self.cuts.append((fact_of, last))
            self.cell = self._below(place, self.cell, level)
        count = np.maximum(np.bincount(self.cell, minlength=2**depth), 1)
        self.means = np.stack(
            [np.bincount(self.cell, column, minlength=2**depth) / count for column in target.T],
            axis=1,
        )

    def _gains(self, place: Places, seen: Numbers, cells: int, least: int) -> Numbers:
        """(cells, facts, BINS): what squares fall by where a cell is cut behind a fact's bin."""
        facts = place.shape[1]
        shape = (cells, facts, BINS)
        key = ((self.cell * facts)[:, None] + np.arange(facts)) * BINS + place
        flat, size = key.ravel(), cells * facts * BINS
        left = np.bincount(flat, minlength=size).reshape(shape).cumsum(axis=2)
        every = left[:, :, -1:]
        right = every - left
        gains = np.zeros(shape)
        for view in seen.T:
            sums = np.bincount(flat, np.repeat(view, facts), minlength=size)
            below = sums.reshape(shape).cumsum(axis=2)
            total = below[:, :, -1:]
            gains += below**2 / np.maximum(left, 1) + (total - below) ** 2 / np.maximum(right, 1)
            gains -= total**2 / np.maximum(every, 1)
        return np.where((left >= least) & (right >= least), gains, 0)

    def _below(self, place: Places, cell: Places, level: int) -> Places:
        fact_of, last = self.cuts[level]
        bins = np.take_along_axis(place, fact_of[cell][:, None], axis=1)[:, 0]
        return 2 * cell + (bins > last[cell])

    def at(self, place: Places) -> Places:
        """(n,) the cells of pixels."""
        cell = np.zeros(len(place), np.int64)
        for level in range(len(self.cuts)):
            cell = self._below(place, cell, level)
        return cell


class _Sum:
    """Trees that add up to targets (n, techniques)."""

    def __init__(self, place: Places, target: Numbers, random: np.random.Generator) -> None:
        self.start = target.mean(axis=0)
        self.trees = []
        left = target - self.start
        for _ in range(ROUNDS):
            tree = _Tree(place, left, _views(left, random, VIEWS), DEPTH, LEAST_LEAF)
            tree.means *= RATE
            left = left - tree.means[tree.cell]
            self.trees.append(tree)

    def at(self, place: Places) -> Numbers:
        found = np.tile(self.start, (len(place), 1))
        for tree in self.trees:
            found += tree.means[tree.at(place)]
        return found


def _views(target: Numbers, random: np.random.Generator, count: int) -> Numbers:
    """Random sums of columns; written out, as a product of matrices has no order of its own."""
    weights = random.normal(size=(target.shape[1], count))
    seen = np.zeros((len(target), count))
    for column, weight in zip(target.T, weights, strict=True):
        seen += column[:, None] * weight
    return seen


class Chances:
    """What pixels with known errors teach.

    facts : (n, facts) of pixels, any finite numbers: only their order counts.
    error : (n, techniques), not negative.
    most : what an error may be.
    """

    def __init__(self, facts: Numbers, error: Numbers, most: float, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.edges = [_edges(column) for column in facts.T]
        place, target = self._place(facts), excess(error, most)
        half = len(facts) // 2
        first, second = slice(0, half), slice(half, None)
        foreseen = np.empty_like(target)
        for known, other in ((first, second), (second, first)):
            foreseen[other] = _Sum(place[known], target[known], random).at(place[other])
        self.sum = _Sum(place, target, random)
        missed = np.abs(target - foreseen)
        self.spread = _Tree(place, missed, _views(missed, random, 2 * VIEWS), DEPTH, 50)
        self.spread.means += LEAST_SPREAD
        surprise = (target - foreseen) / self.spread.means[self.spread.cell]
        self.surprises = np.sort(surprise, axis=0)

    def _place(self, facts: Numbers) -> Places:
        columns = zip(self.edges, facts.T, strict=True)
        return np.stack([np.searchsorted(edges, column) for edges, column in columns], axis=1)

    def at(self, facts: Numbers) -> Numbers:
        """(n, techniques): the chance that each errs by more than `most`."""
        place = self._place(facts)
        room = -self.sum.at(place) / self.spread.means[self.spread.at(place)]
        return np.stack(
            [_share_above(room[:, j], self.surprises[:, j]) for j in range(room.shape[1])], axis=1
        )


def _edges(column: Numbers) -> Numbers:
    """BINS - 1 numbers that cut a fact into bins: where they are few, each value is its own."""
    values = np.unique(column)
    if len(values) >= BINS:
        values = np.quantile(column, np.arange(1, BINS) / BINS)
        few = np.unique(column)[: BINS // 4]  # small counts are worth telling apart
        values[: len(few)] = np.minimum(values[: len(few)], few)
        values = np.maximum.accumulate(values)
    return values[: BINS - 1]


def _share_above(room: Numbers, surprises: Numbers) -> Numbers:
    """The share of surprises above `room`: counted, and in the tail as it falls there."""
    count = len(surprises)
    begin = min(int(count * (1 - TAIL)), count - 1)
    low = surprises[begin]
    reach = math.sqrt(float(((surprises[begin:] - low) ** 2).mean())) + 0.1
    counted = (count - np.searchsorted(surprises, room, side="right")) / count
    far = np.maximum(room - low, 0) / reach
    # 1 / exp(far), but of plain sums and products: libraries' last digits differ
    falling = 1 + far * (1 + far * (1 / 2 + far * (1 / 6 + far / 24)))
    return np.where(room < low, counted, TAIL / falling)


def chance_of_so_few(found: int, tested: int, others: int, bad: int) -> float:
    """The chance of at most `found` bad ones among `tested` of `tested + others`, of which
    `bad` are bad and which were drawn at random."""
    if bad > tested + others:
        return 0.0
    whole = _log_choose(tested + others, bad)
    return sum(
        math.exp(_log_choose(tested, k) + _log_choose(others, bad - k) - whole)
        for k in range(max(0, bad - others), min(found, tested, bad) + 1)
    )


def _log_choose(n: int, k: int) -> float:
    if not 0 <= k <= n:
        return -math.inf
    return math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1)


def least_price(
    choose: Callable[[float], int], tested: int, others: int, allowed: int, doubt: float
) -> float | None:
    """The least price of a chance, from the dearest on, that passes the test; None: none does.

    choose : price -> how many of the tested pixels err too much with the choice it makes.
    allowed : how many of the `others`, which nobody has looked at, may err too much.
    doubt : the chance that more do although the test was passed.

    Prices are tried in a fixed order and the first that fails ends it, so that trying many costs
    nothing (fixed-sequence testing; Angelopoulos et al., "Learn then Test", 2021). The test is
    exact for pixels drawn at random: were `allowed` exceeded, so few bad ones among those tested
    were less likely than `doubt`.
    """
    passed = None
    for step in range(PRICES):
        price = DEAREST * 2.0 ** (-step / 4)
        found = choose(price)
        if chance_of_so_few(found, tested, others, found + allowed + 1) > doubt:
            break
        passed = price
    return passed


# Bits that a certain failure is worth: from where nothing is risked to where nothing counts.
DEAREST, PRICES = 2.0**28, 96
