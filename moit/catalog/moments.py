"""Techniques that reconstruct transmittance from moments of depth."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from moit.arguments import one_of
from moit.catalog.reconstruction import MomentTechnique


@dataclasses.dataclass(frozen=True)
class PowerMoments(MomentTechnique):
    """Absorbance along the ray from its power moments of depth.

    count : 4, 6 or 8 moments beside the total absorbance b0.
    bits : 32: one number of the fragments' dtype per moment.
    b0 : None; reserved for storage in fewer bits.
    overestimation : beta in [0, 1]: 0 counts what must lie in front of a depth, 1 what can.
    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm. "published": the paper's for float32 (5e-7, 5e-6, 5e-5 for 4, 6, 8 moments). None:
        5e-8, 5e-8, 1.5e-7 where the fragments are float32, and 1e-15, 1e-15, 1e-14 where they are
        float64. The default is that much less because matrices are factorised in double: nothing
        is worse for it, and what bias costs falls in proportion (README, "The bias").
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : what maps to [-1, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (eq. 2).
    exclude_self : a fragment does not occlude itself: its own absorbance is taken from what may
        lie at its depth. False: as published.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D
    2018, algorithm 1, equations 1 and 2, sections 3 and 4.
    """

    count: int
    bits: int = 32
    b0: str | None = None

    kind: ClassVar[str] = "power"
    source: ClassVar[str] = "Muenstermann et al. 2018 (MBOIT), algorithm 1"

    def __post_init__(self) -> None:
        one_of("count", self.count, (4, 6, 8))
        one_of("bits", self.bits, (32,))
        one_of("b0", self.b0, (None,))
        super().__post_init__()

    @property
    def base_name(self) -> str:
        return f"power{self.count}"

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("count",)

    @property
    def bits_per_pixel(self) -> float | None:
        return (self.count + 1) * self.bits + self._extent_bits

    @property
    def published_bits(self) -> dict[str, float]:
        bits: dict[str, float] = {"MBOIT": (self.count + 1) * self.bits}
        return bits | ({"NMT": 320} if self.count == 4 else {})

    @property
    def moments(self) -> int:
        return self.count

    def _state_fields(self) -> dict[str, Any]:
        return {"count": self.count}
