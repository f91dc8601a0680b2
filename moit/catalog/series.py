"""Techniques that hold a function of depth as a short series."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np

from moit.catalog.blocks import InBlocks
from moit.catalog.options import whole
from moit.catalog.reconstruction import Reconstruction
from moit.catalog.targets import Targets, added, formats_for, held_in
from moit.catalog.technique import Listed
from moit.checks.arguments import one_of


@dataclasses.dataclass(frozen=True)
class FourierOpacity(InBlocks, Reconstruction):
    """Absorbance along the ray as the integral of a Fourier series.

    coefficients : odd, from 3 to 31: the total absorbance, and a cosine and a sine of each of
        (coefficients - 1) / 2 harmonics.
    bits : 16: half floats, rounded at every fragment in the order of arrival, as blending into a
        render target does; from a sum of 4 on they are 1/256 apart, so that thin layers behind much
        absorbance get lost. 32: one number of the fragments' dtype per coefficient, summed in
        double: no order shows, and the total is exact.
    warp : "log" (depth must be positive), "linear", as published, or "none": depth lies in [0, 1]
        already. The default is what gave the lower error on most of `moit.scenes`: on `mixed` by an
        eighth with 15 coefficients, elsewhere the two are close. The series is periodic: a surface
        at one end of the range shows at the other.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    exclude_self : a fragment does not occlude itself: what the series shows of its own absorbance
        in front of its depth, about a half, is taken out again. False: as published.
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

    Jansen and Bavoil, "Fourier Opacity Mapping", I3D 2010. Made for shadows in smoke; a series cut
    off blurs surfaces and rings beside them, so that transmittance may rise with depth. Results
    are kept within [exp(-total absorbance), 1].

    >>> str(moit.FourierOpacity(7))
    'fourier7'
    """

    coefficients: int
    bits: int = 16

    kind: ClassVar[str] = "fourier"
    counted: ClassVar[str] = "coefficients"
    usual: ClassVar[int] = 7
    listed: ClassVar[Listed] = ({"coefficients": 7}, {"coefficients": 15})
    family: ClassVar[str] = "curves, series"
    words: ClassVar[tuple[str, Any, Any] | None] = ("bits", 16, 32)
    source: ClassVar[str] = "Jansen and Bavoil 2010 (FOM)"
    papers: ClassVar[tuple[str, ...]] = ("jansen2010",)

    def __post_init__(self) -> None:
        whole(self, "coefficients", 3, 31)
        if self.coefficients % 2 == 0:
            raise ValueError(f"coefficients: expected an odd number, got {self.coefficients}")
        one_of("bits", self.bits, (16, 32))
        super().__post_init__()

    @property
    def bits_per_pixel(self) -> float | None:
        state = self.coefficients * self.bits + self._extent_bits
        return self._bits_in_blocks(state, self.bits)

    @property
    def published_bits(self) -> dict[str, float]:
        return {"MBOIT": self.coefficients * 16} if self.resolution == 1 else {}

    @property
    def thick_frequency(self) -> float:
        return math.pi * (self.coefficients - 1)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.coefficients,
            "bits": self.bits,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        formats = formats_for(self.coefficients, "16f" if self.bits == 16 else "32f")
        return Targets(held_in(formats), added(colours))


@dataclasses.dataclass(frozen=True)
class TransmittanceFunctionMap(InBlocks, Reconstruction):
    """The transmittance itself as a series of cosines of depth.

    coefficients : from 1 to 32.
    bits : 16: coefficients and total transmittance are half floats. 32: numbers of the fragments'
        dtype.
    warp : "log" (depth must be positive), "linear", as published, or "none": depth lies in [0, 1]
        already. The default gave two thirds of the error on `mixed`, elsewhere no more.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    exclude_self : a fragment does not occlude itself: what the series shows of the step at its own
        depth, about a half, is undone. False: as published.
    max_alpha : in (0, 1): larger alpha is taken for this when a fragment excludes itself.
    resolution : a side in pixels, from 1, of the blocks that have maps of their own: the mean of
        what their pixels' take of light, and between the middles of blocks what lies between. Not
        with depth_range "pixel".
    total : with a resolution above 1 "block": maps have the total transmittance, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        beside, and what it reads takes is scaled to what that does.
    upsampling : with a resolution above 1 "bilinear" or "depth-aware".

    Delalandre, Gautron, Marvie and Francois, "Transmittance Function Mapping", I3D 2011, who
    gather transmittance by marching along rays. Here it is the exact one of the sorted fragments,
    projected in closed form, so nothing depends on the order of arrival: what is left is the error
    of the storage. Of all sums of these cosines it is the nearest in the mean square. The total is
    stored beside the coefficients, and results are kept within [total, 1].

    >>> str(moit.TransmittanceFunctionMap(8))
    'transmittance-function-map8'
    """

    coefficients: int
    bits: int = 16

    kind: ClassVar[str] = "transmittance-function-map"
    sorts: ClassVar[bool] = True
    counted: ClassVar[str] = "coefficients"
    usual: ClassVar[int] = 8
    listed: ClassVar[Listed] = ({"coefficients": 8},)
    family: ClassVar[str] = "curves, series"
    words: ClassVar[tuple[str, Any, Any] | None] = ("bits", 16, 32)
    source: ClassVar[str] = "Delalandre et al. 2011 (TFM)"
    papers: ClassVar[tuple[str, ...]] = ("delalandre2011",)

    def __post_init__(self) -> None:
        whole(self, "coefficients", 1, 32)
        one_of("bits", self.bits, (16, 32))
        super().__post_init__()

    @property
    def bits_per_pixel(self) -> float | None:
        state = (self.coefficients + 1) * self.bits + self._extent_bits
        return self._bits_in_blocks(state, self.bits)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.coefficients,
            "bits": self.bits,
        }
