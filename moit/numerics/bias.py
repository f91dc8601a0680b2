"""The bias advisor: how little bias keeps the moments of a scene valid."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from moit import moments
from moit.catalog import MomentTechnique, Technique
from moit.catalog import technique as technique_named
from moit.core.questions import in_precision
from moit.inputs import as_fragments
from moit.questions import Input
from moit.reports.columns import number


@dataclass(frozen=True)
class BiasAdvice:
    """What bias the stored moments of a scene need; printed, a few lines.

    technique, precision : whose moments, and the fragments' dtype.
    rays : pixels that hold any absorbance.
    invalid : the share of them whose moments are, without bias, no longer positive definite.
    smallest_pivot : the least pivot of their matrices, without bias; 1 where there are no rays.
    least : the least bias with which all are positive definite: 0 where they are without,
        infinity where no bias makes them so.
    default, published : the technique's own for this precision, and the paper's for these bits.

    >>> advice = moit.bias_advice(moit.scenes.load("panes", (8, 6)), "power4")
    >>> advice.precision, 0 <= advice.invalid <= 1
    ('float32', True)
    """

    technique: str
    precision: str
    rays: int
    invalid: float
    smallest_pivot: float
    least: float
    default: float
    published: float

    def __str__(self) -> str:
        def beside(bias: float) -> str:
            if not np.isfinite(self.least):
                return ""
            return "enough" if bias >= self.least else "not enough"

        lines = [
            (f"{self.technique}, {self.precision}", f"{self.rays:,} rays"),
            ("invalid without bias", f"{100 * self.invalid:.3g} %"),
            ("smallest pivot", number(self.smallest_pivot)),
            ("least bias", number(self.least)),
            ("default", f"{number(self.default):8} {beside(self.default)}"),
            ("published", f"{number(self.published):8} {beside(self.published)}"),
        ]
        width = max(len(name) for name, _ in lines)
        return "\n".join(f"{name:<{width}}  {value}".rstrip() for name, value in lines)


def bias_advice(
    f: Input,
    technique: str | Technique,
    *,
    dtype: DTypeLike | None = None,
    threads: int | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> BiasAdvice:
    """The least bias that keeps a scene's moments valid, beside the default and the published one.

    f : Fragments, a path or a scene's name.
    technique : one that stores moments, or its name. Its own bias plays no part.

    Moments that are just valid are not yet safe from what comes after: published code loses digits
    where a pivot is small, moit's does not. As little as `least` does what bias is for here. Other
    arguments and errors as `moit.moments.gather`.

    >>> moit.bias_advice(moit.scenes.load("panes", (8, 6)), "power4").technique
    'power4'
    """
    found = technique_named(technique)
    if not isinstance(found, MomentTechnique):
        raise TypeError(f"technique: expected one that stores moments, got {found}")
    fragments = in_precision(as_fragments(f, part=part, layer=layer), dtype)
    b0, b = moments.gather(fragments, found, threads=threads, cull_opaque=cull_opaque)
    state = moment_state(found, b0, b, threads)
    return BiasAdvice(
        technique=str(found),
        precision=fragments.dtype.name,
        rays=state.rays,
        invalid=state.invalid,
        smallest_pivot=state.pivot,
        least=state.needed,
        default=dataclasses.replace(found, bias=None).bias_for(fragments.dtype),
        published=dataclasses.replace(found, bias="published").bias_for(fragments.dtype),
    )


@dataclass(frozen=True)
class MomentState:
    """What is wrong with moments before bias, and with the technique's own."""

    rays: int
    invalid: float
    pivot: float
    biased_pivot: float
    needed: float


def moment_state(
    technique: MomentTechnique, b0: Any, b: Any, threads: int | None = None
) -> MomentState:
    """The same of moments that `moit.moments.gather` gave."""
    bare = dataclasses.replace(technique, bias=0.0)
    pivot = moments.least_pivot(bare, b0, b, threads=threads)
    biased = moments.least_pivot(technique, b0, b, threads=threads)
    needed = moments.least_bias(technique, b0, b, threads=threads)
    total = b0[0] if isinstance(b0, tuple) else b0
    held = np.asarray(total) > 0
    return MomentState(
        rays=int(held.sum()),
        invalid=float((pivot[held] <= 0).mean()) if held.any() else 0.0,
        pivot=float(pivot.min(initial=1.0)),
        biased_pivot=float(biased.min(initial=1.0)),
        needed=float(needed.max(initial=0.0)),
    )
