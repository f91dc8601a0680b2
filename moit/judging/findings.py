"""What was measured on a draw, as rows: one for each technique."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.comparing.rows import Row
from moit.judging.bootstrap import Estimate, estimate
from moit.judging.draws import SETS, Draw
from moit.judging.measuring import (
    ON_PANS,
    ON_RAYS,
    ON_SCENES,
    PanUnit,
    RayUnit,
    SceneUnit,
    Unit,
    size_name,
)

Array = NDArray[Any]

MEAN = "mean"  # over the sets, in place of a set's letter


@dataclass(frozen=True)
class Measured:
    """What a technique is on a unit. note : why it is nothing."""

    estimates: Mapping[str, Estimate]
    note: str = ""


@dataclass(frozen=True)
class Findings:
    """What techniques were found to be, on units of a draw at a size."""

    draw: Draw
    size: str
    techniques: Sequence[Technique]
    units: Sequence[Unit] = field(repr=False)
    measured: Mapping[Technique, Mapping[Unit, Measured]] = field(repr=False)
    machine: str = field(default="", repr=False)

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """(width, height) of pictures, the first of which techniques are ranked by."""
        return list(dict.fromkeys(one.size for one in self.units if isinstance(one, SceneUnit)))

    @cached_property
    def rows(self) -> list[Row]:
        """A row for each technique.

        technique, bytes (beside one colour accumulator), passes (over geometry), access (one of
        "blend", "atomics", "ordered", "lists"), order_independent, random; of each set, A to G, as
        A_colour, A_T, A_order, A_flicker and A_jumps, and of their mean mean_colour and so on;
        flip, rmse (at the first size), and at each flip_320x180, rmse_320x180; each number with
        its interval, as A_colour_low, A_colour_high; pan_flicker, pan_jumps; note. None where it
        could not be measured.

        colour : root mean square error over black. T : of transmittance before fragments.
        order : how far colours are from their mean over orders of arrival. flicker : where the
        exact picture is still, root mean square of a change from frame to frame; jumps : the share
        of pixels that change by more than .02 then. flip, rmse : means over scenes. pan_flicker,
        pan_jumps : of scenes of triangles that a camera goes past, where there are fragments.
        """
        return [self._row(one) for one in self.techniques]

    def row(self, technique: Technique | str) -> Row:
        """That of a technique. LookupError where it was not judged."""
        for row in self.rows:
            if row["technique"] == str(technique):
                return row
        raise LookupError(f"technique: {technique} was not judged")

    def flips(self, technique: Technique | str, size: tuple[int, int] | None = None) -> Array:
        """(S,) FLIP by scene, in the order of `moit.scenes.names()`; NaN where it failed."""
        (one,) = (t for t in self.techniques if str(t) == str(technique))
        return self._by_scene(one, "flip", size or self.sizes[0])

    def _row(self, one: Technique) -> Row:
        bits, passes = one.bits_per_pixel, one.geometry_passes
        row = Row(
            technique=str(one),
            bytes=None if bits is None else bits / 8,
            passes=passes,
            access=one.access,
            order_independent=one.order_independent,
            random=one.random,
        )
        for measure in ON_RAYS:
            of_sets = [self._of_set(one, letter, measure) for letter in SETS]
            for letter, found in zip(SETS, of_sets, strict=True):
                _put(row, f"{letter}_{measure}", found)
            _put(row, f"{MEAN}_{measure}", _mean(of_sets))
        for measure in ON_SCENES:
            for size in self.sizes:
                values = self._by_scene(one, measure, size)
                found = None if np.isnan(values).any() else estimate(values)
                _put(row, f"{measure}_{size_name(size)}", found)
                if size == self.sizes[0]:
                    _put(row, measure, found)
        for measure in ON_PANS:
            panned = self._by_pan(one, measure)
            unknown = not len(panned) or np.isnan(panned).any()
            _put(row, measure, None if unknown else estimate(panned))
        notes = {measured.note: None for measured in self.measured[one].values() if measured.note}
        row["note"] = "; ".join(notes)
        return row

    def _of_set(self, one: Technique, letter: str, measure: str) -> Estimate | None:
        for unit, measured in self.measured[one].items():
            if isinstance(unit, RayUnit) and unit.letter == letter:
                return measured.estimates.get(measure)
        return None

    def _by_scene(self, one: Technique, measure: str, size: tuple[int, int]) -> Array:
        return np.array(
            [
                self._value(one, unit, measure)
                for unit in self.units
                if isinstance(unit, SceneUnit) and unit.size == size
            ]
        )

    def _by_pan(self, one: Technique, measure: str) -> Array:
        units = [unit for unit in self.units if isinstance(unit, PanUnit)]
        return np.array([self._value(one, unit, measure) for unit in units])

    def _value(self, one: Technique, unit: Unit, measure: str) -> float:
        """NaN where it is not known."""
        found = self.measured[one].get(unit, Measured({})).estimates.get(measure)
        return np.nan if found is None else found.value

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of `rows`, in order."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))


def _put(row: Row, name: str, found: Estimate | None) -> None:
    known = found if found is not None and np.isfinite(found.value) else (None, None, None)
    row[name], row[f"{name}_low"], row[f"{name}_high"] = known


def _mean(of_sets: Sequence[Estimate | None]) -> Estimate | None:
    """Over sets, each of which counts as much. They are drawn apart, so squared widths add."""
    known = [found for found in of_sets if found is not None]
    if len(known) < len(of_sets):
        return None
    values = np.array(known)
    value = values[:, 0].mean()
    below, above = (
        np.sqrt((off**2).sum()) / len(known) for off in (values[:, 1:].T - values[:, 0])
    )
    return Estimate(float(value), float(value - below), float(value + above))
