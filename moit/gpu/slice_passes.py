"""Techniques of slices of optical depth as passes."""

from __future__ import annotations

from typing import Any

import numpy as np

from moit.catalog import PowerMoments
from moit.catalog.options import WARPS
from moit.catalog.slices import codes_of
from moit.checks.exceptions import GpuError
from moit.gpu.bindings import CAPTURE, DEPOSIT, FACTOR, HOLD_MOMENTS, HOLD_WITHIN, INTEGRATE
from moit.gpu.block_passes import READ
from moit.gpu.described import Constants, Passes, Stage, passes_for

# In doubles: means, rule and total of four moments, and what max_alpha has cut off.
_HELD_MOMENTS = 4 + 5 + 2
# Of slices of blocks, too: means and rule of what pixels read.
_POWERS = 4
_HELD_OF_SLICES = _POWERS + 5
_PROVEN = (Stage(HOLD_MOMENTS), Stage(FACTOR, double=True), Stage(HOLD_WITHIN))


def _moment_uniforms(c: Constants) -> dict[str, Any]:
    """Of the moments that answers are held within: csrc/core/techniques/power_bounds.c."""
    if c.warp == "extreme" or c.fields["range_per_pixel"]:
        raise GpuError(
            "technique: slices that moments bound have no passes where the core warps depth, "
            "from each pixel's own or an extreme range; use device='cpu'"
        )
    warp = WARPS[c.fields["warp"]]
    bounding = PowerMoments(4, warp=warp, bias=1e-12 if c.double else 3e-6)
    fields = bounding.fields_for_core(np.dtype(np.float64 if c.double else np.float32))
    constants = Constants.of(fields, c.double, c.span)
    bias, least, safe, _, _ = constants.moments
    names = ("near", "low", "high", "scale", "inverse")
    return {
        "bias": bias,
        "least": least,
        "safe": safe[:4],
        "unit": 2.0**-52 if c.double else 2.0**-23,
        # from a share of cells to depth as moments have it
        "place_low": 0.0 if warp == "none" else -1.0,
        "place_extent": 1.0 if warp == "none" else 2.0,
        **{f"moments_{k}": x for k, x in zip(names, constants.warp_steps, strict=True)},
    }


@passes_for("slices")
def slices(c: Constants) -> Passes:
    inside = bool(c.fields["inside"])
    slots, blocks = c.fields["count"], c.fields["resolution"] > 1
    most, depth = codes_of(c.fields["bits"])
    full = blocks and c.fields["full_total"]
    powers = _POWERS if inside and blocks else 0
    added = (Stage(DEPOSIT), Stage(INTEGRATE))
    return Passes(
        "slices.glsl",
        {
            "SLOTS": slots,
            "CELLS": c.fields["cells"],
            "SATURATES": 1,
            "OF_BLOCKS": int(blocks),
            "OF_MIDDLE": 0,
            "FULL_TOTAL": int(full),
            "HALF_TOTAL": int(full and c.fields["half_total"]),
            "BYTE_TOTAL": int(full and c.fields["byte_total"]),
            "INSIDE": int(inside),
            "POWERS": powers,
        },
        state=0 if blocks else slots + 3,
        factors=6 if blocks else 0,
        doubles=int(full) + (_HELD_MOMENTS if inside else 0) + (_HELD_OF_SLICES if powers else 0),
        stages=(
            Stage(CAPTURE),
            *((READ,) if blocks else added),
            *(_PROVEN if inside else ()),
        ),
        block_stages=added if blocks else (),
        block_words=slots + 3 + 2 * powers if blocks else 0,
        indices=2 if inside else 0,
        iterations=32,
        uniforms={
            "code_scale": most / depth,
            "code_most": most,
            "half_step": 0.5 * (depth / most),
            "quantum": depth / most,
            "last_octave": 2.0 ** (c.fields["resolution"] ** 2 - 1).bit_length(),
            **(_moment_uniforms(c) if inside else {}),
        },
        tables=True,
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


@passes_for("avboit")
def adaptive_voxels(c: Constants) -> Passes:
    slots, cubic = c.fields["count"], bool(c.fields["cubic"])
    most, depth = codes_of(c.fields["bits"])
    around = 4 if cubic and c.fields["resolution"] > 1 else 2
    return Passes(
        "avboit.glsl",
        {
            "SLOTS": slots,
            "CELLS": c.fields["cells"],
            "SATURATES": 0,
            "OF_BLOCKS": 1,  # of one pixel, too
            "OF_MIDDLE": int(not c.fields["average"]),
            "AROUND": around,
            "POWERS": 0,
            "CUBIC": int(cubic),
        },
        factors=around**2,
        stages=(Stage(CAPTURE), READ),
        block_stages=(Stage(DEPOSIT), Stage(INTEGRATE, double=True)),
        block_words=slots + 3,
        iterations=2 * around**2 + 16,
        uniforms={
            "code_scale": most / depth,
            "code_most": most,
            "quantum": depth / most,
            "slice_bias": c.fields["slice_bias"],
        },
        tables=True,
        normalize=c.fields["normalize"],
        coloured="curve",
    )
