"""Slices of optical depth in each pixel's own extent, which a network reads."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit.catalog.network import network_of
from moit.catalog.neural import NetworkOption, hold_network
from moit.catalog.options import whole
from moit.catalog.reconstruction import WarpedDepth, refuse_own_range
from moit.catalog.targets import ExtentWords, Targets, added, multiplied

EXTENT_BITS = 2 * 16  # of a pixel: where its fragments begin and end


@dataclasses.dataclass(frozen=True)
class NeuralSlices(WarpedDepth):
    """Optical depth in a few slices of the pixel's own extent, read by a small network: ours.

    Slices stand at equal steps of warped depth, the first at a pixel's nearest fragment and the
    last at its farthest. A fragment adds its optical depth, in steps, to the two around it, as
    `Slices` has it. What slices before these two hold is in front of it for sure, L; of what the
    two hold besides its own, W, some may be: T = exp(-(L + W sigmoid(network))). Sums are of whole
    numbers: answers are the same bits in any order of arrival.

    count : 2 to 256 slices.
    bits : 2 to 16 of a slice: of 8 steps of 0.022 of optical depth up to 5.5, of 6 steps of 0.066
        up to 4.2. A slice that would have more has its most, in any order. Fractions of steps are
        dropped or made whole by pixel and depth, so that thin layers count right in the mean.
        While fragments are added slices have 32 bits.
    network : None, the one that comes with moit; the path of a file that `moit.train` or
        `Network.write` wrote; or a `moit.Network` of kind "neural-slices". One network reads slices
        of all counts and bits; that which comes with moit has learnt of 4 to 32 slices of 4 to 8
        bits.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : "image", what maps to [-1, 1], in 65535 steps of which a pixel's extent is kept;
        "pixel" is refused, as slices are of each pixel's own extent whatever it is.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Three passes, without order: the pixel's extent by maxima, slices by additions, then shading.
    The network has two hidden layers of 8 and sees ten numbers: L and W as shares of the total,
    what the fragment absorbs, where between its slices it lies, what the slice in front holds of
    what both do, the slice before and the one behind as shares of the total, what slices say
    without a network, and the logarithms of the total and of W. `moit.bounds` are what the slices
    prove. A curve's depth is a fragment that absorbs nothing.

    bits_per_pixel : slices, and the extent in two words of 16 bits.

    >>> str(moit.NeuralSlices(5, 6)), moit.NeuralSlices(5, 6).bits_per_pixel
    ('neural-slices5(bits=6)', 62)
    """

    count: int = 8
    bits: int = 8
    network: NetworkOption = None

    kind: ClassVar[str] = "neural-slices"
    counted: ClassVar[str] = "count"
    usual: ClassVar[int] = 8
    family: ClassVar[str] = "curves, series"
    source: ClassVar[str] = "ours; storage of Drobot 2025"
    papers: ClassVar[tuple[str, ...]] = ("drobot2025",)

    def __post_init__(self) -> None:
        whole(self, "count", 2, 256)
        whole(self, "bits", 2, 16)
        refuse_own_range(self.depth_range, "slices")
        hold_network(self, self.network, self.network_kind)
        super().__post_init__()

    @property
    def bits_per_pixel(self) -> float | None:
        return self.count * self.bits + EXTENT_BITS

    @property
    def excludes_self(self) -> bool:
        return True

    @property
    def network_kind(self) -> str:
        return self.kind

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        return Targets(shaded=added(colours, multiplied()), words=ExtentWords(self.count))

    @property
    def costs_like(self) -> tuple[str, ...]:
        """Passes differ by loops of as many turns as there are slices, which count as such."""
        return (f"{self.kind}{self.usual}",)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.count,
            "bits": self.bits,
            "network": network_of(self.network, self.network_kind).packed(),
        }
