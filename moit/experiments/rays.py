"""Transmittance along rays: curves of a few given ones, and errors over a dial of random ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from moit.catalog.palette import technique_looks
from moit.comparing.rows import Row
from moit.experiments.description import Array, Section, Setting
from moit.fragments.fragments import Fragments
from moit.questions import transmittance
from moit.reports.blocks import Plot
from moit.reports.charts import CurveChart, DialChart, Series

SAMPLES = 2001  # depths at which a curve is held against the exact one
SHOWN = 10  # every so many of them are drawn
AWAY = 0.02  # of the range: what is nearer to a fragment says how steep a step is, not how true
RAYS = {"tiny": 40, "small": 4000, "full": 40_000}


@dataclass(frozen=True)
class Ray:
    """Fragments of one ray, in any order."""

    depths: Sequence[float]
    alphas: Sequence[float]


@dataclass(frozen=True)
class Curves:
    """The transmittance over depth of techniques on given rays.

    Columns: "curve_mean", the mean error over depth; "curve_max", the greatest that is not within
    AWAY of a fragment; "light", the mean signed error (below 0: too dark behind); "T_max" at
    fragments; "above" and "below", the greatest on either side of the exact curve; "jump", the
    greatest change of the curve within 1/2000 of the range.
    """

    title: str
    text: str
    rays: Mapping[str, Ray]
    techniques: Sequence[str]
    depth_range: tuple[float, float] = (-1.0, 1.0)
    columns: tuple[str, ...] = ("curve_mean", "curve_max", "light", "T_max")
    dtype: str = "f4"

    def steps(self) -> int:
        return len(self.rays)

    def run(self, setting: Setting) -> Section:
        rows, charts = [], []
        looks = technique_looks(self.techniques)
        for name, ray in self.rays.items():
            f = Fragments(
                [0, len(ray.depths)],
                np.array(ray.depths),
                np.array(ray.alphas),
                depth_range=self.depth_range,
                dtype=self.dtype,
            )
            depth = np.linspace(*self.depth_range, SAMPLES).astype(f.dtype)
            exact = _curve(f, "sorted", depth)
            series = []
            for one, look in zip(self.techniques, looks, strict=True):
                curve = _curve(f, one, depth)
                rows.append(self._row(f, name, one, depth, exact, curve))
                series.append(Series(one, curve[::SHOWN], look.colour, one, look.line))
            chart = CurveChart(depth[::SHOWN], series, exact[::SHOWN])
            charts.append(Plot(f"curve-{name}", name, chart, (820, 260)))
            setting.done(name)
        columns = ("scene", "technique", *self.columns)
        return Section(self.title, self.text, columns, rows, charts=charts)

    def _row(
        self, f: Fragments, scene: str, name: str, depth: Array, exact: Array, curve: Array
    ) -> Row:
        length = self.depth_range[1] - self.depth_range[0]
        away = np.abs(depth[:, None] - f.depth).min(axis=1) > AWAY * length
        off = curve - exact
        held = transmittance(f, name) - transmittance(f, "sorted", dtype=np.float64)
        return Row(
            scene=scene,
            technique=name,
            curve_mean=float(np.abs(off).mean()),
            curve_max=float(np.abs(off[away]).max(initial=0.0)),
            light=float(off.mean()),
            T_max=float(np.abs(held).max(initial=0.0)),
            above=float(off.max()),
            below=float((-off).max()),
            jump=float(np.abs(np.diff(curve)).max()),
        )


def _curve(f: Fragments, name: str, depth: Array) -> Array:
    return np.asarray(transmittance(f, name, depth), np.float64).reshape(len(depth))


Measure = Callable[[Fragments, str], Mapping[str, float | None]]


def curve_errors(f: Fragments, name: str) -> dict[str, float | None]:
    """Over all rays: "T_rmse" and "light" (signed mean) of curves at 200 depths of the range, and
    "front", what the transmittance to each ray's nearest fragment is beside 1."""
    depth = np.linspace(*f.depth_range, 200).astype(f.dtype)
    off = transmittance(f, name, depth)[0] - transmittance(f, "sorted", depth, dtype="f8")[0]
    nearest = np.minimum.reduceat(f.depth, f.offsets[:-1][f.counts > 0])
    first = f.depth == np.repeat(nearest, f.counts[f.counts > 0])
    held = transmittance(f, name)[first]
    return {
        "T_rmse": float(np.sqrt((off**2).mean())),
        "light": float(off.mean()),
        "front": float(held.mean(dtype=np.float64) - 1),
    }


@dataclass(frozen=True)
class Sweep:
    """Random rays at each setting of a dial.

    dial : what its values are. make : (rng, value, rays) -> Fragments.
    measure : (fragments, technique) -> columns. charted : which columns are drawn over the dial.
    """

    title: str
    text: str
    dial: str
    values: Sequence[float]
    make: Callable[[np.random.Generator, float, int], Fragments]
    techniques: Sequence[str]
    columns: tuple[str, ...] = ("T_rmse", "light", "front")
    charted: tuple[str, ...] = ("T_rmse",)
    measure: Measure = curve_errors
    rays: Mapping[str, int] = field(default_factory=lambda: RAYS)
    least: float = 1e-9

    def steps(self) -> int:
        return len(self.values)

    def run(self, setting: Setting) -> Section:
        rows = []
        for value in self.values:
            f = self.make(np.random.default_rng(0), value, self.rays[setting.size])
            for one in self.techniques:
                found = self.measure(f, one)
                rows.append(Row(scene=self.title, setting=value, technique=one, **found))
            setting.done(f"{self.dial} {value:g}")
        charts = [self._chart(column, rows) for column in self.charted]
        columns = ("setting", "technique", *self.columns)
        return Section(self.title, f"{self.text} Setting: {self.dial}.", columns, rows, (), charts)

    def _chart(self, column: str, rows: Sequence[Row]) -> Plot:
        def numbers(name: str) -> Array:
            found = [row.get(column) for row in rows if row["technique"] == name]
            return np.array([np.nan if one is None else abs(one) for one in found])

        looks = technique_looks(self.techniques)
        series = [
            Series(one, numbers(one), look.colour, one, look.line)
            for one, look in zip(self.techniques, looks, strict=True)
        ]
        chart = DialChart(self.values, series, self.dial, least=self.least)
        name = f"{column}-{self.title}"
        return Plot(name, f"{column} over {self.dial}", chart, (760, 270))
