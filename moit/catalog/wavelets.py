"""Wavelet transparency: absorbance along the ray in Haar wavelets."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit.catalog.blocks import InBlocks
from moit.catalog.reconstruction import Reconstruction
from moit.catalog.targets import Targets, added, formats_for, held_in
from moit.catalog.technique import Listed
from moit.checks.arguments import one_of

PROJECTED = ("absorbance", "density")


@dataclasses.dataclass(frozen=True)
class WaveletTransparency(InBlocks, Reconstruction):
    """Absorbance in front of a depth, as a series of Haar wavelets.

    coefficients : 4, 8, 16 or 32, the paper's rank 1, 2, 3 or 4: a scaling function and wavelets.
        They know as much of that many cells of warped depth; between, the answer runs straight. A
        fragment adds to the scaling coefficient and to one wavelet of each level.
    bits : 32: one number of the fragments' dtype per coefficient. 16: half floats, blended fragment
        by fragment in arrival order as a render target would round them.
    projected : "absorbance", as published: what lies in front of a depth. Means over cells come
        back exactly, at the far end of each cell: late by a cell. "density", ours: what lies at a
        depth, and its integral, exact at the ends of all cells, is what lies in front. With
        exclude_self a fragment's transmittance is then off by 0.3 to 0.7 times as much (8 and 16
        coefficients, five scenes); without it a fragment occludes itself by up to all of its
        absorbance, and few surfaces are better off as published.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [0, 1] already.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each pixel's
        own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    exclude_self : a fragment does not occlude itself: what it added to its own answer is taken out
        again. False: it occludes itself by up to a quarter of its absorbance.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.
    resolution : a side in pixels, from 1, of the blocks that have coefficients of their own: the
        mean of their pixels', and between the middles of blocks what lies between. Not with
        depth_range "pixel".
    total : with a resolution above 1 "block": blocks have the total absorbance, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        absorbance beside, and what it reads is scaled to that. With exclude_self that is the better
        by far (docs/blocks.md).
    upsampling : with a resolution above 1 "bilinear" or "depth-aware"; the latter gains nothing on
        most scenes.

    Aizenshtein, Smal and McGuire, "Wavelet Transparency", arXiv:2201.00094, 2022.

    >>> str(moit.WaveletTransparency(8))
    'wavelet8'
    """

    coefficients: int
    bits: int = 32
    projected: str = "absorbance"

    kind: ClassVar[str] = "wavelet"
    counted: ClassVar[str] = "coefficients"
    usual: ClassVar[int] = 8
    listed: ClassVar[Listed] = ({"coefficients": 8}, {"coefficients": 16})
    family: ClassVar[str] = "curves, series"
    words: ClassVar[tuple[str, Any, Any] | None] = ("bits", 16, 32)
    source: ClassVar[str] = "Aizenshtein, Smal and McGuire 2022"
    papers: ClassVar[tuple[str, ...]] = ("aizenshtein2022",)

    def __post_init__(self) -> None:
        one_of("coefficients", self.coefficients, (4, 8, 16, 32))
        one_of("bits", self.bits, (16, 32))
        one_of("projected", self.projected, PROJECTED)
        super().__post_init__()

    @property
    def bits_per_pixel(self) -> float | None:
        state = self.coefficients * self.bits + self._extent_bits
        return self._bits_in_blocks(state, self.bits)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.coefficients,
            "bits": self.bits,
            "density": self.projected == "density",
        }

    def shipped_to(self) -> Targets | None:
        formats = formats_for(self.coefficients, "16f" if self.bits == 16 else "32f")
        return Targets(held_in(formats), added("16f"))
