"""What all techniques have in common."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.targets import Target, Targets
from moit.fragments.fragments import Fragments

# The core's rows, each at its kind's number, and those numbers.
FACTS = {row["kind"]: row for row in _core.technique_facts()}
NUMBERS = {kind: number for number, kind in enumerate(FACTS)}

ROW_FACTS = (
    "order_independent",
    "ties_in_order",
    "ties",
    "has_curve",
    "stores_moments",
    "has_network",
    "adds_targets",
    "adds_texels",
    "takes_points",
    "has_gradient",
    "thick",
)

# Options of techniques of one class.
Listed = tuple[Mapping[str, Any], ...]

EXACT = 2**31 - 1  # `exact_up_to` of what always is

# What a pixel's state may need of a GPU, from what each has to what few have or can afford.
ACCESS = ("blend", "atomics", "ordered", "lists")


@dataclasses.dataclass(frozen=True)
class Technique:
    """Base of all techniques.

    What is so of a kind whatever its options are stands once, in the core's table (moit.h,
    moit_technique_facts). A class with a `kind` has it from there, or gives its `row` itself.

    order_independent : whether fragments may arrive in any order. In float64 pictures then differ
        by last digits; in float32 by no more, but where a sum falls on the edge between two floats
        (of a million pixels hardly one), and where words or half floats are rounded after each
        fragment (`bits`).
    ties_in_order : whether that holds for distinct depths only: of fragments at one depth the
        earlier is in front.
    ties : what becomes of fragments of one depth. "earlier": the earlier is in front; "later": the
        later is; "together": they are one layer, each seen through what lies in front of it and
        counted as its alpha says, and none hides another; "chosen": as the technique that a pixel
        gets. Whatever it is, what they add is no brighter than the brightest of them, as far as
        weights are made to sum to what is covered: not where `normalize` is False, as in
        weighted-sum by default, which adds up whatever there is.
    bits_per_pixel : state beyond a colour accumulation target; None where it grows with the
        fragments.
    published_bits : the same as papers count it, by the paper's short name.
    has_curve : whether there is a transmittance at every depth, not only at fragments.
    random : whether answers hang on a seed, and are right only on the mean over seeds.
    unit_range : the depths that moments are taken of, or None.
    local : whether a pixel's answer hangs on its own fragments, its display coordinates and the
        depth range alone.
    supports_transmission : whether fragments may have coloured transmission.
    stores_moments, has_network : what it keeps, and what reads it.
    adds_targets : whether what it keeps of a pixel adds up between pictures.
    adds_texels : whether what it keeps can be filtered.
    takes_points : whether fragments of alpha 0 change no answer, so that they may ask for points.
    has_gradient : whether `moit.gradients` knows it; options may speak against it.
    thick : what it is given of volumes and of Gaussians, `Fragments` with a back or a deviation.
        "points": Gaussians are three surfaces each, at the points of Gauss' rule of their
        absorbance in warped depth. "moments", "waves": so are volumes, and there are so many points
        that what it keeps, powers of depth or waves, is that of the thick fragment itself, of waves
        to 1e-9. "cells": so they are, and what slices are given of the points is what the thick
        fragment itself would give them, but for less than a step of theirs. "middle": a Gaussian
        is a surface at its depth, since what is kept adds up alpha, or is a few layers, which
        points would fill.
        "pieces": Gaussians are cut and mixed. What is not said of volumes is that they are pieces.
    exact_up_to : up to so many fragments images are those of `sorted`, but for last digits.
    geometry_passes : how often transparent geometry is drawn to composite, as published; None
        where that hangs on what is drawn.
    targets : that transparent geometry is drawn to, format and blend function of each: first those
        that hold a pixel's state, then that of colours and what else the pass that shades writes;
        () where it keeps lists of fragments.
    needs_order : whether the fragments of a pixel have to change its state one after the other,
        which needs rasterizer-ordered access (an interlock).
    sorts : whether all fragments of a pixel are kept and sorted.
    access : what of a GPU a pixel's state needs, one of ACCESS: "blend", blending or the depth test
        alone; "atomics" on integers; "ordered", see `needs_order`; "lists" of fragments.

    >>> isinstance(moit.technique("power4"), moit.Technique)
    True
    """

    kind: ClassVar[str] = ""
    engine: ClassVar[str] = "core"  # who answers: a key of moit.engines
    row: ClassVar[Mapping[str, Any]] = {}
    order_independent: ClassVar[bool]
    ties_in_order: ClassVar[bool]
    ties: ClassVar[str]
    has_curve: ClassVar[bool]
    random: ClassVar[bool]
    unit_range: ClassVar[tuple[float, float] | None]
    stores_moments: ClassVar[bool]
    has_network: ClassVar[bool]
    adds_targets: ClassVar[bool]
    adds_texels: ClassVar[bool]
    takes_points: ClassVar[bool]
    has_gradient: ClassVar[bool]
    thick: ClassVar[str]
    sorts: ClassVar[bool] = False
    source: ClassVar[str] = ""
    papers: ClassVar[tuple[str, ...]] = ()  # keys of catalog.papers, whatever the options
    remark: ClassVar[str] = ""  # what every row about it notes
    counted: ClassVar[str] = ""  # the option whose number ends the name
    usual: ClassVar[int] = 0  # that number where a name has none
    listed: ClassVar[Listed] = ({},)  # options, one each in the catalog
    family: ClassVar[str] = "others"  # the title of one of catalog.palette.FAMILIES
    # The option that says whether it stores words, and its values where it does and does not.
    words: ClassVar[tuple[str, Any, Any] | None] = None

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "kind" not in vars(cls):
            return
        row = FACTS.get(cls.kind) if cls.engine == "core" else cls.row
        if not row or set(row) != set(FACTS["sorted"]):
            raise TypeError(f"{cls.__name__}: the core's table has no row for {cls.kind!r}")
        cls.row = row
        facts = {name: row[name] for name in ROW_FACTS}
        facts["random"] = row["is_random"]
        facts["unit_range"] = row["unit_range"] if row["uses_warp"] else None
        for name, value in facts.items():
            if name not in vars(cls):  # else it says so itself
                setattr(cls, name, value)

    @property
    def base_name(self) -> str:
        """The name without options."""
        return f"{self.kind}{self._count}" if self.counted else self.kind

    @property
    def bits_per_pixel(self) -> float | None:
        return 0

    @property
    def local(self) -> bool:
        return self.block_side == 1

    @property
    def supports_transmission(self) -> bool:
        return bool(self.row["takes_transmission"])

    @property
    def exact_up_to(self) -> int:
        return int(self.row["exact_up_to"]) + (self._count if self.row["exact_counts"] else 0)

    @property
    def geometry_passes(self) -> int | None:
        each = self._count if self.row["passes_count"] else 0
        return int(self.row["geometry_passes"]) + each + self.range_per_pixel

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        """What moit's own passes over triangles draw to, with colours in numbers of such a kind;
        None: they keep lists of fragments."""
        return None

    def shipped_to(self) -> Targets | None:
        """What an engine draws to (`moit.export`), also where `drawn_to` has nothing."""
        return self.drawn_to()

    @property
    def targets(self) -> tuple[Target, ...]:
        found = self.drawn_to()
        return (*found.held, *found.shaded) if found else ()

    @property
    def needs_order(self) -> bool:
        return any(target.blend == "ordered" for target in self.targets)

    @property
    def uses_atomics(self) -> bool:
        """Whether fragments change words of a pixel by atomics on integers."""
        found = self.shipped_to()
        return bool(found and found.words)

    @property
    def access(self) -> str:
        if self.sorts or self.bits_per_pixel is None:
            return "lists"
        if self.needs_order:
            return "ordered"
        held = any(target.blend.startswith("atomic") for target in self.targets)
        return "atomics" if self.uses_atomics or held else "blend"

    @property
    def _count(self) -> int:
        return int(getattr(self, self.counted)) if self.counted else 0

    @property
    def depth_warp(self) -> str | None:
        """How depth is warped; None: it is taken as it is."""
        return None

    @property
    def range_per_pixel(self) -> bool:
        """Whether each pixel's own range of depth is warped, which a pass has to find before."""
        return False

    @property
    def excludes_self(self) -> bool:
        """Whether a fragment is taken out of what occludes it."""
        return False

    @property
    def thick_points(self) -> int:
        """How many points stand for a thick fragment, of at most 48; 0: as many as waves of
        `thick_frequency` take."""
        return 0 if self.thick == "waves" else 3

    @property
    def thick_frequency(self) -> float:
        """Radians over the whole range of depth of the shortest wave that is kept."""
        return 0.0

    @property
    def thick_cells(self) -> tuple[int, float]:
        """Of how many cells of depth each has points of a thick fragment, at least a step of so
        many nepers each; (0, 0): points are of a rule."""
        return 0, 0.0

    @property
    def costs_like(self) -> tuple[str, ...]:
        """Names of those whose shaders cost as much, the nearest first (`moit.gpu_costs`)."""
        return ()

    @property
    def block_side(self) -> int:
        """Of squares of pixels that share a state."""
        return 1

    @property
    def draws_blocks(self) -> bool:
        """Whether blocks of pixels have what the pixel at their middle has, as a smaller target
        would; else the mean of what their pixels have."""
        return False

    @property
    def network_kind(self) -> str:
        """Of which kind its network is, if it has one."""
        return self.base_name

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        """The options with which it stores words of 16 bits or half floats, or else numbers of the
        fragments' dtype; None where it has no such form."""
        if self.words is None:
            return None if words else {}
        option, with_words, without = self.words
        return {option: with_words if words else without}

    @property
    def renormalised(self) -> Technique | None:
        """The same with colours scaled to what is covered, where its paper leaves them as they come
        out; None where that changes nothing, or is not so."""
        return None

    @property
    def has_name(self) -> bool:
        """Whether `moit.technique` reads it back from its name."""
        return True

    @property
    def identity(self) -> str | None:
        """What, beside its name, results are of; None where nothing tells: two functions of one
        name may differ."""
        return None if any(callable(value) for value in vars(self).values()) else ""

    @property
    def cited(self) -> tuple[str, ...]:
        """Keys of the papers that it is from (`moit.cite`)."""
        return self.papers

    @property
    def published_bits(self) -> dict[str, float]:
        return {}

    @property
    def _in_name(self) -> tuple[str, ...]:
        """Options that `base_name` shows."""
        return (self.counted,) if self.counted else ()

    def __str__(self) -> str:
        options = []
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name not in self._in_name and value != field.default:
                shown = getattr(value, "__name__", "callable") if callable(value) else repr(value)
                options.append(f"{field.name}={shown}")
        return self.base_name + (f"({','.join(sorted(options))})" if options else "")

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        """Its options as the core takes them, for numbers of dtype: all that its kind has, and no
        other (the table is in csrc/python/technique.c)."""
        return {"kind": NUMBERS[self.kind]}

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        """The same for a question about `f`. FragmentsError where `f` is not what it needs."""
        return self.fields_for_core(f.depth.dtype)

    def fields_for_totals(self, f: Fragments) -> dict[str, Any]:
        """The same where nothing is blended: for what pixels let through, and for bounds."""
        return self.fields_for(f)
