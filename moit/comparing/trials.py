"""Techniques tried on fragments: in windows of the image first, then on the whole of it."""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import metrics as image_metrics
from moit.catalog import Technique
from moit.catalog.technique import EXACT
from moit.checks.exceptions import MoitError, told
from moit.comparing.rows import AFTER_METRICS, BEFORE_METRICS, Row
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.per_pixel.plan import SORTED_BITS
from moit.questions import composite
from moit.reports.columns import number

SIDE = 48  # of a window, in pixels
SAMPLE = 24  # windows at most
REPEAT = 3  # timed composites of the whole image
# What takes so many times the seconds of the best is not timed again.
HOPELESS = 2.0
FAILURES = (MoitError, ValueError, TypeError)


@dataclass(frozen=True)
class Estimate:
    """What a technique was found to be in windows of the image, before it was tried on the whole.

    seconds, bits : of the whole image by what the windows took; bits a pixel on the mean.
    note : why there is no error.
    """

    technique: Technique
    error: float
    seconds: float
    bits: float
    note: str = ""


class Trials:
    """Candidates on the whole image: the rows that tell of them."""

    def __init__(
        self,
        f: Fragments,
        metric: str,
        most: float,
        background: NDArray[np.float64],
        threads: int | None,
    ) -> None:
        self.f, self.metric, self.most = f, metric, most
        self.background, self.threads = background, threads
        self.rows: dict[Technique, Row] = {}
        exact = in_precision(f, np.float64)
        self.exact = composite(exact, "sorted", background=background, threads=threads)

    def row(self, one: Technique) -> Row:
        if one not in self.rows:
            row = Row(dict.fromkeys((*BEFORE_METRICS, self.metric, *AFTER_METRICS)))
            row.update(scene="fragments", device="cpu", technique=str(one), note="")
            row.update(bits_per_pixel=one.bits_per_pixel, bits=bits_of(one.bits_per_pixel, self.f))
            self.rows[one] = row
        return self.rows[one]

    def image(self, one: Technique) -> NDArray[Any]:
        return composite(self.f, one, background=self.background, threads=self.threads)

    def holds(self, one: Technique, image: NDArray[Any]) -> bool:
        """Whether its error, which is measured, is small enough."""
        error = float(getattr(image_metrics, self.metric)(image, self.exact))
        row = self.row(one)
        row[self.metric] = error
        if error <= self.most or one.exact_up_to == EXACT:
            return True
        row["note"] = f"{self.metric} {number(error)} is above {number(self.most)}"
        return False

    def time(self, one: Technique, best: float) -> float:
        """Median seconds; of few composites where it is beyond hope to be as quick as `best`."""
        seconds: list[float] = []
        while len(seconds) < REPEAT and not (seconds[1:] and min(seconds) > HOPELESS * best):
            start = time.perf_counter()
            self.image(one)
            seconds.append(time.perf_counter() - start)
        spread = float(np.subtract(*np.percentile(seconds, (75, 25))))
        median = float(statistics.median(seconds))
        speed = len(self.f) / max(median, 1e-9)
        self.row(one).update(seconds=median, seconds_iqr=spread, fragments_per_second=speed)
        return median

    def fail(self, one: Technique, failure: Exception) -> None:
        self.row(one)["note"] = told(failure)


def bits_of(bits: float | None, f: Fragments) -> float:
    return SORTED_BITS * len(f) / max(1, f.counts.size) if bits is None else bits


def estimates_of(
    trials: Trials, candidates: list[Technique], seed: int, done: Any
) -> list[Estimate]:
    f = trials.f
    places = windows_of(f, seed)
    is_image = trials.background.ndim == 3
    windows = [
        (f[place], trials.background[place] if is_image else trials.background, trials.exact[place])
        for place in places
    ]
    scale = len(f) / max(1, sum(len(window) for window, _, _ in windows))
    found = []
    for one in candidates:
        found.append(estimate_of(trials, one, windows, scale))
        done(str(one))
    return found


def estimate_of(
    trials: Trials, one: Technique, windows: list[tuple[Fragments, Any, Any]], scale: float
) -> Estimate:
    metric = trials.metric
    measure = image_metrics.mse if metric == "rmse" else getattr(image_metrics, metric)
    bits = bits_of(one.bits_per_pixel, trials.f)
    try:
        errors, pixels, spent = 0.0, 0, 0.0
        for window, behind, exact in windows:
            start = time.perf_counter()
            image = composite(window, one, background=behind, threads=trials.threads)
            spent += time.perf_counter() - start
            errors += measure(image, exact) * window.counts.size
            pixels += window.counts.size
    except FAILURES as failure:
        return Estimate(one, math.inf, math.inf, bits, told(failure))
    error = errors / pixels
    if metric == "rmse":
        error = math.sqrt(error)
    return Estimate(one, error, scale * spent, bits)


def windows_of(f: Fragments, seed: int) -> list[tuple[slice, slice]]:
    """Some squares of the image: half of them those with most fragments, the others random."""
    height, width = f.shape
    tall, wide = min(SIDE, height), min(SIDE, width)
    counts = f.counts.reshape(f.shape)
    places = [
        (min(y, height - tall), min(x, width - wide))
        for y in range(0, height, tall)
        for x in range(0, width, wide)
    ]
    places = list(dict.fromkeys(places))
    full = sorted(places, key=lambda at: -int(counts[_window(at, tall, wide)].sum()))
    rest = full[SAMPLE // 2 :]
    order = np.random.default_rng(seed).permutation(len(rest))
    chosen = full[: SAMPLE // 2] + [rest[i] for i in order[: SAMPLE - SAMPLE // 2]]
    return [_window(at, tall, wide) for at in chosen]


def _window(at: tuple[int, int], tall: int, wide: int) -> tuple[slice, slice]:
    return slice(at[0], at[0] + tall), slice(at[1], at[1] + wide)
