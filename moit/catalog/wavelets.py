"""Wavelet transparency: absorbance along the ray in Haar wavelets."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit.arguments import one_of
from moit.catalog.reconstruction import Reconstruction


@dataclasses.dataclass(frozen=True)
class WaveletTransparency(Reconstruction):
    """Absorbance in front of a depth, as a series of Haar wavelets.

    coefficients : 4, 8, 16 or 32, the paper's rank 1, 2, 3 or 4: a scaling function and wavelets.
        They hold the mean absorbance in front of each of that many cells of warped depth, exactly;
        between the means of neighbouring cells the answer runs straight. A fragment adds to the
        scaling coefficient and to one wavelet of each level.
    bits : 32: one number of the fragments' dtype per coefficient. 16: half floats, blended fragment
        by fragment in arrival order as a render target would round them.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [0, 1] already.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each pixel's
        own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    exclude_self : a fragment does not occlude itself: what it added to the two means that its
        answer lies between is taken out again. False: it occludes itself by up to a quarter of its
        absorbance.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Aizenshtein, Smal and McGuire, "Wavelet Transparency", arXiv:2201.00094, 2022.
    """

    coefficients: int
    bits: int = 32

    kind: ClassVar[str] = "wavelet"
    source: ClassVar[str] = "Aizenshtein, Smal and McGuire 2022"
    unit_range: ClassVar[tuple[float, float] | None] = (0.0, 1.0)

    def __post_init__(self) -> None:
        one_of("coefficients", self.coefficients, (4, 8, 16, 32))
        one_of("bits", self.bits, (16, 32))
        super().__post_init__()

    @property
    def base_name(self) -> str:
        return f"wavelet{self.coefficients}"

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("coefficients",)

    @property
    def bits_per_pixel(self) -> float | None:
        return self.coefficients * self.bits + self._extent_bits

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.coefficients,
            "bits": self.bits,
        }
