"""Techniques that draw lots: right on the mean over seeds."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.options import flag, whole
from moit.catalog.targets import Target, Targets, added, multiplied
from moit.catalog.technique import Listed, Technique

MOST_SAMPLES = _core.numbers()["MOST_SAMPLES"]
MOST_SEED = 2**31 - 1


@dataclasses.dataclass(frozen=True)
class Stochastic(Technique):
    """Transmittance as the share of samples that nothing nearer covers.

    samples : 1 to 64 per pixel.
    seed : 0 to 2**31 - 1; another seed draws other samples.
    stratified : a fragment covers alpha of the samples, rounded up or down by chance, and chance
        says which. False: each sample by itself with probability alpha, which is noisier.
    normalize : scale a pixel's colours so that their weights sum to what is covered. False: colours
        are right on the mean, but the noise of their sum shows.

    Enderton, Sintorn, Shirley and Luebke, "Stochastic Transparency", TVCG 17(8), 2011, with what
    they recommend: stratified masks, alpha correction (`normalize`) and the accumulation by depth,
    in which every fragment's alpha c is multiplied by the visibility that the samples' depths give.
    The background is multiplied by the exact total transmittance, as published.

    Transmittance and, without `normalize`, images of fragments at distinct depths have the exact
    ones as their mean over seeds; fragments at one depth do not occlude each other. `normalize` is
    a quotient of two estimates, whose bias falls as 1 / samples. Random numbers hang on the seed,
    the pixel's place in the display and the fragment's depth and alpha: neither the order of
    arrival nor a crop changes them, nor does a dtype in which these are the same numbers.

    The state is the depths of the samples, 32 bits each.

    >>> str(moit.Stochastic(8))
    'stochastic8'
    """

    samples: int
    seed: int = 0
    stratified: bool = True
    normalize: bool = True

    kind: ClassVar[str] = "stochastic"
    counted: ClassVar[str] = "samples"
    usual: ClassVar[int] = 8
    listed: ClassVar[Listed] = ({"samples": 8},)
    family: ClassVar[str] = "stochastic"
    source: ClassVar[str] = "Enderton et al. 2011"
    papers: ClassVar[tuple[str, ...]] = ("enderton2011",)

    def __post_init__(self) -> None:
        whole(self, "samples", 1, MOST_SAMPLES)
        whole(self, "seed", 0, MOST_SEED)
        flag(self, "stratified")
        flag(self, "normalize")

    @property
    def bits_per_pixel(self) -> float | None:
        return 32 * self.samples

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.samples,
            "seed": self.seed,
            "stratified": self.stratified,
            "normalize": self.normalize,
        }

    def shipped_to(self) -> Targets | None:
        return Targets((multiplied(),), added("16f"), samples=self.samples)


@dataclasses.dataclass(frozen=True)
class HashedAlpha(Technique):
    """An alpha test against a hash: what passes is opaque, and the nearest of it is seen.

    seed : 0 to 2**31 - 1; another seed makes other thresholds.

    Wyman and McGuire, "Hashed Alpha Testing", I3D 2017; "Improved Alpha Testing Using Hashed
    Sampling", TVCG 2019. A fragment passes where its threshold, uniform in [0, 1), is below alpha,
    so it does with probability alpha, and images have the exact one as their mean over seeds. The
    paper hashes positions in object space, at the scale of a pixel, so that noise stays with the
    surface. Fragments have no such position: here the threshold is a hash of the seed, the pixel's
    place in the display and the bits of depth and alpha. It is that of `Stochastic(1)` with
    stratified=False.

    Transmittance and totals are 0 or 1. Of fragments at one depth that pass, the first to arrive is
    seen. The state is the depth of what passed, 32 bits.

    >>> str(moit.HashedAlpha())
    'hashed-alpha'
    """

    seed: int = 0

    kind: ClassVar[str] = "hashed-alpha"
    family: ClassVar[str] = "stochastic"
    source: ClassVar[str] = "Wyman and McGuire 2017"
    papers: ClassVar[tuple[str, ...]] = ("wyman2017",)

    def __post_init__(self) -> None:
        whole(self, "seed", 0, MOST_SEED)

    @property
    def bits_per_pixel(self) -> float | None:
        return 32

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "seed": self.seed}

    def shipped_to(self) -> Targets | None:
        return Targets(shaded=(Target("rgba16f", "replace"),))
