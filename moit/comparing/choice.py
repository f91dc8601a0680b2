"""What `PerPixel` chooses for an image, what it comes to, and how far off it is."""

from __future__ import annotations

import dataclasses
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit.catalog import PerPixel, Sorted, Technique
from moit.catalog import technique as technique_named
from moit.checks.arguments import truth
from moit.checks.exceptions import FragmentsError
from moit.core.pieces import surfaces
from moit.core.questions import background_for, in_precision
from moit.gpu_costs.predicting import on_gpu
from moit.inputs import as_fragments
from moit.per_pixel.plan import Plan, plan_of
from moit.per_pixel.questions import PerPixelQuestion
from moit.per_pixel.selection import Selection, brightness
from moit.questions import Input
from moit.reports.columns import number
from moit.system.environment import thread_count
from moit.system.progress import Progress, steps

Array = NDArray[Any]
SHARES = {"p99": 0.99, "p999": 0.999, "worst": 1.0}
COLUMNS = ("technique", "share", "bits_per_pixel", "bits", "p99", "p999", "worst")


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """Which technique each pixel of an image got. `str` is a table of all this.

    technique : the PerPixel.
    techniques : what there was to choose from, cheapest first and `sorted` last.
    map : (height, width) which of them each pixel got; -1 where there are no fragments.
    image : (height, width, 4) as `composite` gives it.
    error : (height, width) the largest of the differences of its channels from the exact image.
    tried : (height, width) whether the pixel was one of the sample, whose errors were measured.
    rows : a dict for each technique that has pixels, and for all: technique; share of the image's
        pixels; bits_per_pixel, the mean of its own; bits, what it adds to the mean of the image;
        fragments, which opaque ones do not hide; p99, p999 and worst of its pixels' errors.
    bits_per_pixel : the mean over the image.
    predicted : {"p99", "p999", "worst"}: errors to be expected of pixels with fragments that were
        not tried, from those of the sample's second part; with certify=True, what they are at most.
    measured : the same of what they are; where all were tried, of all that have fragments.
    beyond : the share of these pixels that are off by more than max_error.

    >>> choice = moit.choose(moit.scenes.load("panes", (8, 6)))
    >>> choice.image.shape, str(choice.techniques[-1])
    ((6, 8, 4), 'sorted')
    """

    technique: PerPixel
    techniques: tuple[Technique, ...]
    map: NDArray[np.int64]
    image: Array
    error: NDArray[np.float64]
    tried: NDArray[np.bool_]
    rows: tuple[dict[str, Any], ...]
    bits_per_pixel: float
    predicted: dict[str, float]
    measured: dict[str, float]
    beyond: float

    def gpu_ms(
        self, gpu: str | None = None, resolution: tuple[int, int] | None = None
    ) -> dict[str, float | None]:
        """Milliseconds that a frame is predicted to take on a GPU, of each technique on the pixels
        that got it, and "all", as if these were told apart before they are drawn.

        gpu, resolution : as `Report.on_gpu`.

        None where nothing is known, as of `sorted`, and for "all" where that is so of any.

        >>> choice = moit.choose(moit.scenes.load("panes", (8, 6)))
        >>> "all" in choice.gpu_ms("rx6800")
        True
        """
        where = on_gpu(gpu, resolution)
        whole = int(np.prod(self.map.shape))
        found: dict[str, float | None] = {}
        for row in self.rows:
            if row["technique"] not in ("all", "no fragments"):
                one = technique_named(row["technique"])
                covered = round(row["share"] * whole)
                found[row["technique"]] = where.milliseconds(one, row["fragments"], whole, covered)
        known = [one for one in found.values() if one is not None]
        return {**found, "all": sum(known) if len(known) == len(found) else None}

    def __repr__(self) -> str:
        height, width = self.map.shape
        return (
            f"Choice({self.technique}, {height}x{width}, {self.bits_per_pixel:.4g} bits a pixel, "
            f"{self.beyond:.3%} beyond)"
        )

    def __str__(self) -> str:
        cells = self._cells()
        widths = [max(len(line[i]) for line in cells) for i in range(len(COLUMNS))]
        lines = [
            "  ".join(
                cell.ljust(width) if i == 0 else cell.rjust(width)
                for i, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in cells
        ]
        return "\n".join([str(self.technique), *lines, *self._sentences()])

    def _repr_html_(self) -> str:
        heads, *lines = [
            "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in line)
            for tag, line in zip(["th"] + ["td"] * len(self.rows), self._cells(), strict=True)
        ]
        body = "".join(f"<tr>{line}</tr>" for line in lines)
        said = "".join(f"<p>{escape(one)}</p>" for one in self._sentences())
        return f"<table><tr>{heads}</tr>{body}</table>{said}"

    def _cells(self) -> list[list[str]]:
        lines = [
            [
                str(row["technique"]),
                f"{row['share']:.2%}",
                *(number(row[column]) for column in COLUMNS[2:]),
            ]
            for row in self.rows
        ]
        return [list(COLUMNS), *lines]

    def _sentences(self) -> list[str]:
        def told(errors: dict[str, float]) -> str:
            return ", ".join(f"{name} {number(value)}" for name, value in errors.items())

        kind = "at most" if self.technique.certify else "predicted"
        return [
            f"errors of pixels with fragments{'' if self.tried.all() else ' that were not tried'}:"
            f" {kind} {told(self.predicted)}; measured {told(self.measured)};"
            f" {self.beyond:.3%} beyond {number(self.technique.max_error)}"
        ]


def choose(
    f: Input,
    technique: PerPixel | str = "per-pixel",
    *,
    background: ArrayLike = (0, 0, 0),
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    progress: Progress = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> Choice:
    """Which technique `PerPixel` gives each pixel, what that comes to, and how far off it is.

    f : Fragments with colour, a path or a scene's name.
    technique : a PerPixel, or its name.

    progress : True, False, or a callable (done, total, label).

    Other arguments are those of `composite`, whose image the choice has. To measure errors, all
    pixels are sorted too, in float64. Emission, of which errors are not foretold, is left out.

    Raises TypeError and ValueError for what is none of that, FragmentsError without colour.

    >>> moit.choose(moit.scenes.load("panes", (8, 6))).map.shape
    (6, 8)
    """
    how = technique_named(technique)
    if not isinstance(how, PerPixel):
        raise TypeError(f"technique: expected a PerPixel, got {how}")
    workers = thread_count(threads)
    given = as_fragments(f, part=part, layer=layer)
    fragments, _ = surfaces(in_precision(given, dtype))
    if fragments.color is None:
        raise FragmentsError("color: choose needs the fragments' colour; found None")
    how.fields_for(fragments)
    behind = background_for(background, fragments)
    culls = truth("cull_opaque", cull_opaque)
    with steps(progress, 3, "choose", patient=True) as done:
        done.now("tries techniques on a sample")
        seen = Selection(fragments, culls, workers)
        plan = plan_of(seen, how, brightness(behind))
        done("the choice")
        done.now("the picture")
        image = PerPixelQuestion(seen, how).image(plan, behind)
        done("the picture")
        done.now("the exact picture")
        exact = seen.ask(in_precision(fragments, np.float64), Sorted()).composite(behind)
        done("the exact picture")
    error = np.abs(image - exact).max(axis=2)
    return _told(how, plan, image, error)


def _told(how: PerPixel, plan: Plan, image: Array, error: NDArray[np.float64]) -> Choice:
    shape, off = error.shape, error.ravel()
    filled = plan.counts > 0
    tried = np.zeros(len(off), bool)
    tried[plan.tried] = True
    untried = filled & ~tried if (filled & ~tried).any() else filled
    groups = [
        (str(one), filled & (plan.of_pixel == index)) for index, one in enumerate(plan.techniques)
    ]
    groups += [("no fragments", ~filled)]
    groups = [*((name, here) for name, here in groups if here.any()), ("all", np.ones_like(filled))]
    rows = [_row(name, plan, off, here) for name, here in groups]
    return Choice(
        how,
        plan.techniques,
        np.where(filled, plan.of_pixel, -1).reshape(shape),
        image,
        error,
        tried.reshape(shape),
        tuple(rows),
        float(plan.bits.mean()) if len(off) else 0.0,
        _shares(plan.predicted, plan.weights),
        _shares(off[untried], np.ones(int(untried.sum()))),
        float((off[untried] > how.max_error).mean()) if untried.any() else 0.0,
    )


def _row(
    name: str, plan: Plan, error: NDArray[np.float64], here: NDArray[np.bool_]
) -> dict[str, Any]:
    bits = plan.bits
    return {
        "technique": name,
        "share": float(here.mean()) if len(here) else 0.0,
        "bits_per_pixel": float(bits[here].mean()) if here.any() else 0.0,
        "bits": float(bits[here].sum() / max(len(here), 1)),
        "fragments": int(plan.counts[here].sum()),
        **_shares(error[here], np.ones(int(here.sum()))),
    }


def _shares(errors: NDArray[np.float64], weights: NDArray[np.float64]) -> dict[str, float]:
    """The errors that 99 % and 99.9 % of the weight do not exceed, and the greatest; 0 of none."""
    kept = weights > 0
    if not kept.any():
        return dict.fromkeys(SHARES, 0.0)
    order = np.argsort(errors[kept], kind="stable")
    rising, reached = errors[kept][order], np.cumsum(weights[kept][order])
    return {
        name: float(rising[min(np.searchsorted(reached, share * reached[-1]), len(rising) - 1)])
        for name, share in SHARES.items()
    }
