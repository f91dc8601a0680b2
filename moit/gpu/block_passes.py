"""Passes of techniques whose states are of blocks of pixels (shaders/arrays/blocks.glsl)."""

from __future__ import annotations

import dataclasses

from moit.gpu.bindings import BLOCK_FIRST, BLOCK_READ, BLOCK_TOTAL, CAPTURE, EXPAND
from moit.gpu.described import Constants, Passes, Stage

READ = Stage(BLOCK_READ, double=True)
KEPT = Stage(BLOCK_FIRST, double=True)
TOTAL = Stage(BLOCK_TOTAL)


def in_blocks(passes: Passes, c: Constants) -> Passes:
    """The passes as they are where states are of blocks; as given, where they are of pixels or
    nothing is said of how blocks' are made."""
    weights = passes.block_weights
    if c.fields.get("resolution", 1) < 2 or not (passes.block_means or weights is not None):
        return passes
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
