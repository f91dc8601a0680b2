"""Techniques in which a small network reads transmittance back."""

from __future__ import annotations

import dataclasses
import os
from typing import Any, ClassVar

from moit.catalog.blocks import InBlocks
from moit.catalog.network import Network, network_of
from moit.catalog.options import hold
from moit.catalog.reconstruction import HalfMoments
from moit.catalog.targets import Targets, added, formats_for, held_in
from moit.catalog.technique import Listed, Technique
from moit.checks.arguments import one_of, path_name

NetworkOption = Network | str | os.PathLike[str] | None


def hold_network(technique: Technique, given: Any, kind: str) -> None:
    """Checks the option `network`; a path is kept as text, and the file has been read once."""
    if given is not None and not isinstance(given, Network):
        hold(technique, "network", path_name(given, "network"))
    if given is not None:
        network_of(given, kind)


@dataclasses.dataclass(frozen=True)
class BoundedNeural(InBlocks, HalfMoments):
    """Absorbance along the ray from power moments, between whose bounds a network decides.

    moments : "power4" or "power6": what a pixel keeps beside its total absorbance b0.
    network : None, the one that comes with moit; the path of a file that `moit.train` or
        `Network.write` wrote; or a `moit.Network`, of the kind that is this technique's name
        (`base_name`).
    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm. "published": MBOIT's. None: 2.5e-7 where the fragments are float32, more than
        PowerMoments has, as rounding of few close surfaces would else lead out of the bounds of
        their moments, and 1e-15 where they are float64.
        In half floats as PowerMoments has it.
    storage : None: numbers of the fragments' dtype. "half": half floats, to which blending adds
        what each fragment brings, as PowerMoments has it.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : what maps to [-1, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.
    resolution : a side in pixels, from 1, of the blocks that have moments of their own: the mean of
        their pixels', and between the middles of blocks what lies between. Not with
        depth_range "pixel".
    total : with a resolution above 1 "block": blocks have the total absorbance, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        absorbance beside, and what it reads is scaled to that.
        That is the better by far (docs/blocks.md).
    upsampling : with a resolution above 1 "bilinear" or "depth-aware"; the latter gains nothing on
        most scenes.

    Moments prove that in front of a fragment at z of absorbance a there is at least L and at most
    L + W, W being what may lie at z less a (Chebyshev, Markov, Stieltjes). MBOIT counts the same
    share of that everywhere; here T = exp(-(L + W sigmoid(network))). So few surfaces, which leave
    no W (3 with four moments, 4 with six), are exact whatever the network says, and T does not
    leave what moments prove: with float64 not at all, with float32 and six moments, for one in
    some thousand fragments of a few surfaces that all but coincide, by a hundredth at most;
    `moit.bounds` then reaches to it. It has two hidden layers
    of 8 and sees L/b0, W/b0, a, (z - mean)/deviation, and of its pixel ln b0, ln deviation,
    skewness and ln kurtosis, with six moments logarithms of the fifth and sixth standardised
    moment, too; all of absorbance along z, from the moments alone (csrc/kernels/bounded_neural.h):
    no count, no extent, no other pass. A curve's depth is a fragment of a = 0. Ours.

    >>> str(moit.BoundedNeural("power4"))
    'neural-bounded'
    """

    moments: str = "power4"
    network: NetworkOption = None

    kind: ClassVar[str] = "neural-bounded"
    listed: ClassVar[Listed] = ({"moments": "power4"}, {"moments": "power6"})
    family: ClassVar[str] = "power, neural"
    source: ClassVar[str] = "ours, on the moments of Muenstermann et al. 2018 (MBOIT)"
    papers: ClassVar[tuple[str, ...]] = ("muenstermann2018",)

    def __post_init__(self) -> None:
        one_of("moments", self.moments, ("power4", "power6"))
        hold_network(self, self.network, self.base_name)
        super().__post_init__()

    @property
    def base_name(self) -> str:
        return self.kind if self.moments == "power4" else f"{self.kind}6"

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("moments",)

    @property
    def bits_per_pixel(self) -> float | None:
        bits = 16 if self.in_halves else 32
        return self._bits_in_blocks(bits * (self.moment_count + 1) + self._extent_bits)

    @property
    def _not_in_blocks(self) -> dict[str, bool]:
        return {**super()._not_in_blocks, "storage='half'": self.in_halves}

    @property
    def moment_count(self) -> int:
        return 4 if self.moments == "power4" else 6

    def _state_fields(self) -> dict[str, Any]:
        network = network_of(self.network, self.base_name).packed()
        return {
            **super()._state_fields(),
            "count": self.moment_count,
            "bits": 32,
            "network": network,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        if self.in_halves:
            return super().drawn_to(colours)
        formats = (*formats_for(self.moment_count, "32f"), "r32f")
        return Targets(held_in(formats), added(colours))
