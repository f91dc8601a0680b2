"""What a shader costs, and the GPUs that this is known of."""

from __future__ import annotations

import dataclasses

FAMILIES = ("navi21", "gfx1100", "vega10")  # RDNA 2, RDNA 3, GCN
WAVE = 64  # fragments of a wave


@dataclasses.dataclass(frozen=True)
class Cost:
    """What a driver's compiler made of a shader.

    cycles : for which a wave of 64 keeps its unit (a SIMD) busy, as the compiler reckons.
    instructions : of the code.
    registers : vector registers; above 64 to 128 fewer waves run at once.
    spilled : of these, those that there was no room for.
    bytes : of what the pass gives; 0 where that is not known.
    """

    cycles: int
    instructions: int
    registers: int
    spilled: int = 0
    bytes: int = 0
