"""Which technique a scene needs: the cheapest whose error is small enough."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from moit import metrics as image_metrics
from moit.catalog import AlphaBlend, Technique, listed, techniques
from moit.catalog.forms import better
from moit.catalog.winners import winners
from moit.checks.arguments import one_of, truth, whole
from moit.checks.exceptions import FragmentsError
from moit.checks.randomness import seed_of
from moit.comparing.comparison import compare
from moit.comparing.report import Report
from moit.comparing.rows import BEFORE_METRICS, LESS_IS_BETTER, Result, Row
from moit.comparing.trials import FAILURES, Estimate, Trials, bits_of, estimates_of
from moit.core.questions import background_for
from moit.fragments.fragments import Fragments
from moit.gpu_costs.predicting import OnGpu, on_gpu
from moit.inputs import as_fragments
from moit.reports.columns import number
from moit.reports.tables import Table, html_table, text_table
from moit.system.environment import machine
from moit.system.progress import Progress, preparing, steps

Source = Fragments | str | os.PathLike[str]

METRICS = LESS_IS_BETTER
COSTS = {"seconds": "seconds", "bits": "bits", "gpu": "gpu_ms"}  # columns of rows
# What is said of what costs more, and as much.
KEEPS = ("keeps more bits", "with the same bits")
TAKES = ("would take longer", "in the same time")


@dataclass(frozen=True)
class Conditions:
    """What a technique has to keep to, whatever its error."""

    max_bits: float | None = None
    ordered: bool = True
    max_passes: int | None = None
    exact: bool = True

    def broken(self, one: Technique, bits: float) -> list[str]:
        """How a technique that takes so many bits a pixel does not."""
        passes = one.geometry_passes
        found = []
        if self.max_bits is not None and bits > self.max_bits:
            found.append(f"keeps {bits:.4g} bits of at most {self.max_bits:.4g}")
        if not self.ordered and one.needs_order:
            found.append("needs rasterizer-ordered access")
        if self.max_passes is not None and (passes is None or passes > self.max_passes):
            drawn = "who knows how many" if passes is None else f"{passes}"
            found.append(f"draws geometry {drawn} times, at most {self.max_passes} allowed")
        if not self.exact and one.sorts:
            found.append("sorts fragments")
        return found


@dataclass(frozen=True)
class Recommendation:
    """The cheapest technique that keeps to an error; unpacks as (technique, report).

    technique : it; None where none keeps to the error and the conditions.
    nearest : then the one that misses least; else the technique.
    rows : of all candidates, cheapest first: fields as in a report's rows, with `note` for why it
        was chosen or was not, `bits` for the bits a pixel on the mean, and with by="gpu" `gpu_ms`
        for what is predicted. What was not measured on
        the whole image, as it was dearer than the answer or broke a condition, is None.
    report : of those that were measured on the whole image, the answer last.
    estimates : of those that keep to the conditions, in windows of the image, cheapest first.
    reason : what decided, in a sentence.

    >>> f = moit.scenes.load("cloud", (16, 12))
    >>> answer = moit.recommend(f, max_error=1, metric="mse", by="bits",
    ...     techniques=["power4", "power8"], progress=False)
    >>> str(answer.technique)
    'power4'
    """

    technique: Technique | None
    report: Report
    estimates: tuple[Estimate, ...]
    reason: str
    rows: tuple[Row, ...] = ()
    nearest: Technique | None = None

    def __iter__(self) -> Iterator[Any]:
        return iter((self.technique, self.report))

    def __str__(self) -> str:
        name = "nothing fits" if self.technique is None else str(self.technique)
        return f"{name}\n{self.reason}\n\n{text_table(self._table())}"

    def _repr_html_(self) -> str:
        from html import escape

        name = "nothing fits" if self.technique is None else str(self.technique)
        title = f"<p><b>{escape(name)}</b>: {escape(self.reason)}</p>"
        return title + html_table(self._table())

    def _table(self) -> Table:
        (metric,) = self.report.metrics
        predicted = any("gpu_ms" in row for row in self.rows)
        cells = [
            [
                str(row["technique"]),
                f"{row['bits']:.4g}",
                *([_shown(row["gpu_ms"])] if predicted else []),
                "" if row["seconds"] is None else number(1e3 * row["seconds"]),
                "" if row[metric] is None else number(row[metric]),
                str(row["note"]),
            ]
            for row in self.rows
        ]
        gpu = ["gpu ms"] if predicted else []
        head = ["technique", "bits", *gpu, "ms", metric, "why"]
        return Table(head, cells, [True, *[False] * (len(head) - 2), True])


def _shown(value: float | None) -> str:
    return "" if value is None else number(value)


def recommend(
    f: Source,
    *,
    max_error: float,
    metric: str = "flip",
    by: str = "seconds",
    techniques: Technique | str | Iterable[Technique | str] | None = None,
    max_bits: float | None = None,
    ordered: bool = True,
    max_passes: int | None = None,
    exact: bool = True,
    background: ArrayLike = (0, 0, 0),
    threads: int | None = None,
    seed: int = 0,
    rng: Any = None,
    progress: Progress = True,
    part: int | str | None = None,
    layer: str | None = None,
    gpu: str | None = None,
    resolution: tuple[int, int] | None = None,
) -> Recommendation:
    """The cheapest technique whose picture of `f` is at most `max_error` from the exact one.

    f : Fragments with colour, a path or a scene's name; at least 11 pixels a side.
    max_error : from 0, in the metric's own measure.
    metric : flip, hdr_flip, mse, rmse or mae.
    by : what is cheap: "seconds" of the composite here, "bits" a pixel keeps, where fragments
        that are kept (`sorted`) take 96 bits each, or "gpu": milliseconds that a frame is predicted
        to take on a GPU that need not be here (docs/gpu_costs.md), which candidates without a
        prediction are left out of. Of equal bits, or milliseconds, the one with less error.
    techniques : candidates, of which one is the answer; None: `moit.techniques()`, as they are and
        with all options that make them better (`normalize`, `merge`, `exclude_self`), and what
        docs/frontier.md names as best for its bytes; but for what is random, `unsorted`, which is
        right by luck, and `per-pixel`, which has an error of its own (`moit.choose`).
    max_bits : that a pixel may keep, on the mean.
    ordered : False: leave out what needs rasterizer-ordered access (`needs_order`).
    max_passes : over transparent geometry (`geometry_passes`), at least 1.
    exact : False: leave out what sorts all fragments of a pixel (`sorts`).
    background, threads : as `composite`.
    seed : of the windows that are looked at first.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.
    gpu, resolution : with by="gpu" what frames are predicted for: a GPU's name, None for "rx6800",
        and (width, height), None for 1920 x 1080, where each pixel has as many fragments as here.
    part, layer : of a deep EXR that is given by path, as `composite`.

    Windows of the image, those with most fragments and random ones, say in which order candidates
    are tried on the whole image, and nothing else: the answer is the cheapest of all that were, or
    that are cheaper than any that was not. `sorted` has no error but that of rounding.

    Where nothing fits, `.technique` is None, and `.nearest` and `.reason` say what misses least.

    Raises TypeError and ValueError for bad arguments, FragmentsError without colour.

    >>> f = moit.scenes.load("cloud", (16, 12))
    >>> technique, report = moit.recommend(f, max_error=1, metric="mse", by="bits",
    ...     techniques=["power4", "power8"], progress=False)
    >>> str(technique)
    'power4'
    """
    number_of_windows = seed_of(seed, rng)
    one_of("by", by, tuple(COSTS))
    one_of("metric", metric, METRICS)
    most = _number("max_error", max_error)
    conditions = Conditions(
        None if max_bits is None else _number("max_bits", max_bits),
        truth("ordered", ordered),
        None if max_passes is None else whole("max_passes", max_passes, 1),
        truth("exact", exact),
    )
    where = _where(by, gpu, resolution)
    with preparing(progress, "recommend") as reading:
        reading.now("reads f")
        fragments = as_fragments(f, "f", part, layer)
    if fragments.color is None:
        raise FragmentsError("color: recommend needs the fragments' colour; found None")
    if min(fragments.shape) < image_metrics.LEAST_SIDE:
        raise ValueError(
            f"f: expected at least {image_metrics.LEAST_SIDE} pixels a side, got "
            f"{fragments.shape[0]} x {fragments.shape[1]} (height x width)"
        )
    behind = background_for(background, fragments)
    candidates = _candidates(techniques)
    bits = {one: bits_of(one.bits_per_pixel, fragments) for one in candidates}
    broken = {one: conditions.broken(one, bits[one]) for one in candidates}
    spent = {one: _predicted(one, fragments, where) for one in candidates} if where else {}
    for one, milliseconds in spent.items():
        if milliseconds is None:
            broken[one].append("no frame is predicted for it")
    allowed = [one for one in candidates if not broken[one]]
    with preparing(progress, "recommend") as exact_picture:
        exact_picture.now("the exact picture")
        trials = Trials(fragments, metric, most, behind, threads)
    with steps(progress, 2 * len(allowed), "recommend") as done:
        estimates = estimates_of(trials, allowed, number_of_windows, done)
        if where:
            costs = {one: math.inf if ms is None else ms for one, ms in spent.items()}
            estimates.sort(key=lambda one: (costs[one.technique], one.error))
            found = _least(trials, estimates, costs, TAKES, done)
        elif by == "bits":
            estimates.sort(key=lambda one: (one.bits, one.error))
            found = _least(trials, estimates, bits, KEEPS, done)
        else:
            likely = sorted(estimates, key=lambda one: (one.error > most, one.seconds))
            found = _quickest(trials, likely, done)
            estimates.sort(key=lambda one: (one.seconds, one.error))
    for one in candidates:
        if broken[one]:
            trials.row(one).update(note="; ".join(broken[one]))
    for one, milliseconds in spent.items():
        trials.row(one)["gpu_ms"] = milliseconds
    return _told(trials, candidates, broken, found, tuple(estimates), by, where)


def _where(by: str, gpu: str | None, resolution: tuple[int, int] | None) -> OnGpu | None:
    if by == "gpu":
        return on_gpu(gpu, resolution)
    if gpu is not None or resolution is not None:
        raise ValueError(f"gpu, resolution: expected with by='gpu' alone, got by={by!r}")
    return None


def _predicted(one: Technique, f: Fragments, where: OnGpu) -> float | None:
    return where.milliseconds(one, len(f), f.counts.size)


def _least(
    trials: Trials,
    estimates: list[Estimate],
    costs: Mapping[Technique, float],
    words: tuple[str, str],
    done: Any,
) -> Technique | None:
    """Of those that hold and cost least, as is known beforehand, the one with least error; the rest
    is not tried."""
    more, same = words
    found: list[tuple[float, Technique]] = []
    least = math.inf
    for estimate in estimates:
        one = estimate.technique
        if costs[one] > least:
            trials.row(one)["note"] = f"{more} than {found[0][1]}; not tried"
            done(str(one))
            continue
        try:
            if trials.holds(one, trials.image(one)):
                found.append((trials.row(one)[trials.metric], one))
                least = costs[one]
            trials.time(one, math.inf)
        except FAILURES as failure:
            trials.fail(one, failure)
        done(str(one))
    if not found:
        return None
    best = min(found, key=lambda pair: pair[0])[1]
    for _, one in found:
        if one != best:
            trials.row(one)["note"] = f"holds {same}; {best} errs less"
    return best


def _quickest(trials: Trials, estimates: list[Estimate], done: Any) -> Technique | None:
    """The one that takes least time of those that hold. All are timed on the whole image; the error
    is measured of those that are quicker than what was best until then."""
    best: Technique | None = None
    least = math.inf
    for estimate in estimates:
        one = estimate.technique
        try:
            image = trials.image(one)
            seconds = trials.time(one, least)
            if seconds >= least:
                trials.row(one)["note"] = f"slower than {best}"
            elif trials.holds(one, image):
                if best is not None:
                    trials.row(best)["note"] = f"holds; slower than {one}"
                best, least = one, seconds
        except FAILURES as failure:
            trials.fail(one, failure)
        done(str(one))
    return best


def _told(
    trials: Trials,
    candidates: list[Technique],
    broken: dict[Technique, list[str]],
    found: Technique | None,
    estimates: tuple[Estimate, ...],
    by: str,
    where: OnGpu | None,
) -> Recommendation:
    metric, most = trials.metric, trials.most
    rows = {one: trials.row(one) for one in candidates}

    def cost(one: Technique) -> float:
        spent = rows[one][COSTS[by]]
        return math.inf if spent is None else float(spent)

    measured = [one for one in candidates if rows[one][metric] is not None]
    nearest = found
    count = f"{len(candidates)} candidates"
    if found is not None:
        rows[found]["note"] = "the answer"
        row = rows[found]
        reason = f"{metric} {row[metric]:.3g} of at most {most:g} at {_cost(row, by, where)}; "
        missed = [one for one in measured if rows[one][metric] > most and cost(one) <= cost(found)]
        missed = [one for one in missed if one != found]
        if missed:
            close = min(missed, key=lambda one: rows[one][metric])
            reason += (
                f"of {count} {len(missed)} would be cheaper and miss it, by least {close} with "
                f"{rows[close][metric]:.3g}"
            )
        else:
            reason += f"no other of {count} is cheaper"
        left_out = sum(map(bool, broken.values()))
        reason += f"; {left_out} left out by the conditions" if left_out else ""
    elif measured:
        nearest = min(measured, key=lambda one: (rows[one][metric], cost(one)))
        reason = (
            f"none of {count} keeps to {metric} {most:g} and the conditions; nearest is {nearest} "
            f"with {rows[nearest][metric]:.3g} at {_cost(rows[nearest], by, where)}"
        )
    else:
        nearest = min(candidates, key=lambda one: (len(broken[one]), rows[one]["bits"]))
        reason = (
            f"none of {count} keeps to the conditions; nearest is {nearest}: "
            f"{rows[nearest]['note']}"
        )
    ordered = sorted(rows, key=lambda one: (bool(broken[one]), cost(one), rows[one]["bits"]))
    return Recommendation(
        found,
        _report(trials, [one for one in ordered if one in measured], nearest),
        estimates,
        reason,
        tuple(rows[one] for one in ordered),
        nearest,
    )


def _report(trials: Trials, measured: list[Technique], last: Technique | None) -> Report:
    """Of those measured, with the picture and curves of the last."""
    results = [Result(trials.row(one)) for one in measured if one != last]
    if last not in measured:
        return Report(results, {}, (trials.metric,), "sorted", machine(trials.threads))
    shown = compare(
        trials.f,
        last,
        metrics=trials.metric,
        repeat=1,
        background=trials.background,
        threads=trials.threads,
        progress=False,
    )
    (result,) = shown.results
    kept = trials.row(last)
    own = {name: kept[name] for name in (*BEFORE_METRICS[4:], trials.metric, "note")}
    results.append(Result(Row({**result.row, **own}), result.image, result.curves))
    return Report(results, shown.scenes, shown.metrics, shown.reference, shown.machine)


def _cost(row: Row, by: str, where: OnGpu | None = None) -> str:
    if by == "gpu":
        return f"{row['gpu_ms']:.3g} ms predicted on {where}"
    if by == "seconds":
        return f"{1e3 * row['seconds']:.3g} ms"
    return f"{row['bits']:.3g} bits a pixel"


def _candidates(given: Any) -> list[Technique]:
    if given is not None:
        return listed(given)
    usual = [
        one
        for one in techniques()
        if not one.random and one.engine == "core" and not isinstance(one, AlphaBlend)
    ]
    found = dict.fromkeys(form for one in usual for form in (one, better(one)))
    return list(found | dict.fromkeys(winners()))


def _number(name: str, given: float) -> float:
    try:
        found = float(given)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {given!r:.80}") from None
    if isinstance(given, bool | str) or not (math.isfinite(found) and found >= 0):
        raise ValueError(f"{name}: expected a finite number of at least 0, got {given!r:.80}")
    return found
