"""Which technique a scene needs: the cheapest whose error is small enough."""

from __future__ import annotations

import math
import os
import statistics
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import metrics as image_metrics
from moit.catalog import AlphaBlend, Technique, listed, techniques
from moit.catalog import technique as technique_named
from moit.catalog.technique import EXACT
from moit.checks.arguments import one_of
from moit.checks.exceptions import FragmentsError, MoitError
from moit.comparing.comparison import compare
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.per_pixel.plan import SORTED_BITS
from moit.questions import composite
from moit.system.progress import Progress, steps

Source = Fragments | str | os.PathLike[str]

METRICS = ("flip", "hdr_flip", "mse", "rmse", "mae")  # those that are 0 where images are equal
SIDE = 48  # of a window, in pixels
SAMPLE = 24  # windows at most
# What is this far from enough in the windows is not tried on the whole.
HOPELESS = 1.5


@dataclass(frozen=True)
class Estimate:
    """What a technique was found to be in windows of the image.

    seconds, bits : of the whole image by what the windows took; bits a pixel on the mean.
    note : why there is no error.
    """

    technique: Technique
    error: float
    seconds: float
    bits: float
    note: str = ""


@dataclass(frozen=True)
class Recommendation:
    """The cheapest technique that keeps to an error; unpacks as (technique, report).

    technique : it.
    report : of those that were tried on the whole image, and of the exact one.
    estimates : of all candidates, in windows, cheapest first.
    reason : what decided, in a sentence.

    >>> f = moit.scenes.load("cloud", (16, 12))
    >>> answer = moit.recommend(f, max_error=1, metric="mse", by="bits",
    ...     techniques=["power4", "power8"], progress=False)
    >>> str(answer.technique)
    'power4'
    """

    technique: Technique
    report: Report
    estimates: tuple[Estimate, ...]
    reason: str

    def __iter__(self) -> Any:
        return iter((self.technique, self.report))

    def __str__(self) -> str:
        return f"{self.technique}\n{self.reason}\n\n{self.report}"

    def _repr_html_(self) -> str:
        from html import escape

        name, reason = escape(str(self.technique)), escape(self.reason)
        return f"<p><b>{name}</b>: {reason}</p>{self.report._repr_html_()}"


def recommend(
    f: Source,
    *,
    max_error: float,
    metric: str = "flip",
    by: str = "seconds",
    techniques: Iterable[Technique | str] | None = None,
    seed: int = 0,
    progress: Progress = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> Recommendation:
    """The cheapest technique whose picture of `f` is at most `max_error` from the exact one.

    f : Fragments with colour, a path or a scene's name; at least 11 pixels a side.
    max_error : from 0, in the metric's own measure.
    metric : flip, hdr_flip, mse, rmse or mae.
    by : what is cheap: "seconds" of the composite here, or "bits" a pixel keeps, where fragments
        that are kept (`sorted`) take 96 bits each.
    techniques : candidates; None: `moit.techniques()` but for what is random, `unsorted`, which is
        right by luck, and `per-pixel`, which has an error of its own (`moit.choose`). `sorted`,
        which has no error, is one always.
    seed : of the windows that are looked at first.
    part, layer : as `composite`.

    Candidates are measured in windows of the image: those with most fragments and random ones. The
    cheapest that does there is tried on the whole image, then the next, until one does. Of what is
    returned the error is therefore measured, not estimated.

    Raises TypeError and ValueError for bad arguments, FragmentsError without colour.

    >>> f = moit.scenes.load("cloud", (16, 12))
    >>> technique, report = moit.recommend(f, max_error=1, metric="mse", by="bits",
    ...     techniques=["power4", "power8"], progress=False)
    >>> str(technique)
    'power4'
    """
    one_of("by", by, ("seconds", "bits"))
    one_of("metric", metric, METRICS)
    most = _most_error(max_error)
    fragments = as_fragments(f, "f", part, layer)
    if fragments.color is None:
        raise FragmentsError("color: recommend needs the fragments' colour; found None")
    if min(fragments.shape) < image_metrics.LEAST_SIDE:
        raise ValueError(
            f"f: expected at least {image_metrics.LEAST_SIDE} pixels a side, got "
            f"{fragments.shape[0]} x {fragments.shape[1]} (height x width)"
        )
    candidates = _candidates(techniques)
    windows = [fragments[window] for window in _windows(fragments, seed)]
    exact = [composite(in_precision(one, np.float64), "sorted") for one in windows]
    scale = len(fragments) / max(1, sum(map(len, windows)))
    found = []
    with steps(progress, len(candidates), "recommend") as done:
        for one in candidates:
            found.append(_estimate(one, windows, exact, metric, scale, fragments))
            done(str(one))
    cost = "bits" if by == "bits" else "seconds"
    found.sort(key=lambda estimate: (getattr(estimate, cost), estimate.error))
    return _confirmed(fragments, found, most, metric, by)


def _confirmed(
    f: Fragments, estimates: list[Estimate], most: float, metric: str, by: str
) -> Recommendation:
    """The first of the estimates that does on the whole image."""
    results: list[Result] = []
    tried = 0
    for estimate in estimates:
        is_exact = estimate.technique.exact_up_to == EXACT
        if not is_exact and not estimate.error <= HOPELESS * most:
            continue
        report = compare(f, [estimate.technique], metrics=[metric], repeat=3, progress=False)
        results += report.results
        tried += 1
        error = report.rows[0][metric]
        if is_exact or (error is not None and error <= most):
            break
    else:  # a reference is among the candidates
        raise AssertionError("sorted was no candidate")
    whole = Report(results, report.scenes, report.metrics, report.reference, report.machine)
    chosen = estimate.technique
    cheaper = estimates.index(estimate)
    row = report.rows[0]
    reason = f"{metric} {row[metric]:.3g} of at most {most:g} at {_cost(row, f, by)}; "
    if cheaper == 0:
        reason += f"no other of {len(estimates)} candidates is cheaper"
    else:
        nearest = min(estimates[:cheaper], key=lambda estimate: estimate.error)
        reason += (
            f"of {len(estimates)} candidates {cheaper} would be cheaper and miss it, by least "
            f"{nearest.technique} with {nearest.error:.3g} in windows of the image"
        )
    if tried > 1:
        reason += f"; {tried - 1} more did in the windows only"
    return Recommendation(chosen, whole, tuple(estimates), reason)


def _cost(row: Row, f: Fragments, by: str) -> str:
    if by == "seconds":
        return f"{1e3 * row['seconds']:.3g} ms"
    return f"{_bits(row['bits_per_pixel'], f):.3g} bits a pixel"


def _bits(bits: float | None, f: Fragments) -> float:
    return SORTED_BITS * len(f) / max(1, f.counts.size) if bits is None else bits


def _estimate(
    one: Technique,
    windows: list[Fragments],
    exact: list[NDArray[Any]],
    metric: str,
    scale: float,
    f: Fragments,
) -> Estimate:
    measure = image_metrics.mse if metric == "rmse" else getattr(image_metrics, metric)
    bits = _bits(one.bits_per_pixel, f)
    try:
        errors, pixels, seconds = 0.0, 0, []
        for window, truth in zip(windows, exact, strict=True):
            errors += measure(composite(window, one), truth) * window.counts.size
            pixels += window.counts.size
        for _ in range(3):
            start = time.perf_counter()
            for window in windows:
                composite(window, one)
            seconds.append(time.perf_counter() - start)
    except (MoitError, ValueError, TypeError) as failure:
        return Estimate(one, math.inf, math.inf, bits, f"{type(failure).__name__}: {failure}")
    error = errors / pixels
    if metric == "rmse":
        error = math.sqrt(error)
    return Estimate(one, error, scale * statistics.median(seconds), bits)


def _candidates(given: Iterable[Technique | str] | None) -> list[Technique]:
    if given is None:
        chosen = [
            one
            for one in techniques()
            if not one.random and one.engine == "core" and not isinstance(one, AlphaBlend)
        ]
    else:
        chosen = listed(given)
    return list(dict.fromkeys([*chosen, technique_named("sorted")]))


def _most_error(max_error: float) -> float:
    try:
        most = float(max_error)
    except (TypeError, ValueError):
        raise TypeError(f"max_error: expected a number, got {max_error!r:.80}") from None
    if isinstance(max_error, bool | str) or not (math.isfinite(most) and most >= 0):
        raise ValueError(f"max_error: expected a finite number of at least 0, got {max_error!r}")
    return most


def _windows(f: Fragments, seed: int) -> list[tuple[slice, slice]]:
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
