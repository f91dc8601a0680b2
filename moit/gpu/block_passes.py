"""Passes of techniques whose states are of blocks of pixels (shaders/arrays/blocks.glsl)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

from moit.gpu.bindings import BLOCK_FIRST, BLOCK_READ, BLOCK_TOTAL, CAPTURE, EXPAND
from moit.gpu.described import Constants, Passes, Stage

READ = Stage(BLOCK_READ, double=True)
KEPT = Stage(BLOCK_FIRST, double=True)
TOTAL = Stage(BLOCK_TOTAL)


def in_blocks(kind: str, passes: Passes, c: Constants) -> Passes:
    """The passes of a kind as they are where states are of blocks; as given, where they are of
    pixels or the kind has none that make them."""
    if c.fields.get("resolution", 1) < 2 or kind not in _SUMMED:
        return passes
    weights_of = _SUMMED[kind]
    weights = weights_of(c) if weights_of else None
    full = bool(c.fields["full_total"])
    numbers = [one.number for one in passes.stages]
    captured = 1 + numbers.index(CAPTURE)
    capture, rest = passes.stages[:captured], passes.stages[captured:]
    expanded = () if weights is None else (Stage(EXPAND),)
    return dataclasses.replace(
        passes,
        defines={
            **passes.defines,
            "OF_BLOCKS": 1,
            "BLOCK_SETS": "1u",
            "BLOCK_MEANS": int(weights is None),
            "FULL_TOTAL": int(full),
        },
        stages=(
            *(capture if full else ()),
            *(READ, *expanded, *rest),
            *(() if full else (TOTAL,)),
        ),
        block_stages=(*capture, KEPT),
        uniforms={**passes.uniforms, **({} if weights is None else {"total_weights": weights})},
    )


def _of_fourier(c: Constants) -> list[float]:
    return [1.0, *([0.0] * (c.fields["count"] - 1))]


def _of_function_maps(c: Constants) -> list[float]:
    return [*([0.0] * c.fields["count"]), 1.0]


def _of_wavelets(c: Constants) -> list[float]:
    """The mean over the last cell; of densities the scaling coefficient is the total."""
    weights = _of_fourier(c)
    wavelets, height = 1, 1.0
    while not c.fields["density"] and wavelets < len(weights):
        weights[2 * wavelets - 1] = height
        wavelets, height = 2 * wavelets, height * math.sqrt(2)
    return weights


# Of numbers that add up, with which weights they sum to the total absorbance, or of maps to what is
# taken of light; None: means of it.
_SUMMED: dict[str, Callable[[Constants], list[float]] | None] = {
    "power": None,
    "trig": None,
    "neural-bounded": None,
    "fourier": _of_fourier,
    "transmittance-function-map": _of_function_maps,
    "wavelet": _of_wavelets,
}
