"""Fragments that matter most occlude exactly, wherever they lie; cells or moments hold the rest."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.network import network_of
from moit.catalog.neural import NetworkOption, hold_network
from moit.catalog.options import whole, within
from moit.catalog.reconstruction import WarpedDepth, refuse_own_range
from moit.catalog.targets import KeyWords, Targets, added, formats_for, held_in, multiplied
from moit.catalog.technique import Listed
from moit.checks.arguments import one_of

MOST_KEPT = _core.numbers()["MOST_KEPT"]
MOST_CELLS = _core.numbers()["MOST_CELLS"]
CELLS_OF_A_WORD = 5  # of 7131 values each, in 64 bits
KEY_BITS = (32, 64)
MOST_GAMMA = 32.0  # beyond, all but the nearest are of no importance


def words_of_keys(kept: int, key_bits: int) -> int:
    """And of where the pixel begins and ends."""
    return kept * key_bits // 32 + 2


@dataclasses.dataclass(frozen=True)
class Anchors(WarpedDepth):
    """The fragments that matter most occlude exactly, and absorbance in cells between them.

    kept : 1 to 16 fragments of a pixel, anywhere on the ray: those with the greatest
        alpha exp(-gamma u), u being warped depth in [0, 1].
    cells : 1 to 16 equal parts of the pixel's extent, which with the depths that are kept cut it
        into `kept` + `cells` cells for the absorbance of all others.
    gamma : 0 to 32: how much nearness counts beside alpha. From 3 to 5 it makes little difference;
        a looser depth_range asks for more.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [0, 1] already.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each pixel's
        own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Three passes, without order: the greatest keys (6 bits of importance, 16 of depth, 10 of the
    root of 1 - alpha) by atomic maxima, and the pixel's extent; sums of absorbance by atomic
    additions; then shading. Keys and sums are whole numbers, so an answer has the same bits in
    whatever order fragments arrive. A fragment that is not kept sees what is kept in front of it,
    the cells in front of its own, and of its own cell, without itself, as much as it lies inside,
    as if the rest were fragments like itself. A cell tells up to 13.9 nepers, in steps of 1/512
    that are rounded up or down by depth, so that of many thinner layers a share counts. Fragments
    that let all but a thousandth through are never kept. Of several with the least key that is
    kept, those without a place are counted in cells, as are all others. Transmittance is as the
    state says, before colours are scaled. Bounds are what the state proves: kept ones to the
    rounding of their alpha, and a cell's absorbance anywhere in it. Ours.

    key_bits : 32 of each that is kept, or 64, whose depth has 24 bits for 16: where many depths lie
        within a word of 16 bits, these are told apart.

    bits_per_pixel : keys, 64 for each five cells, and two words of 16 for the extent.

    >>> str(moit.Anchors(4, cells=6)), moit.Anchors(4).bits_per_pixel
    ('anchors4(cells=6)', 352)
    """

    kept: int
    cells: int = 11
    gamma: float = 3.5
    key_bits: int = dataclasses.field(default=32, kw_only=True)

    kind: ClassVar[str] = "anchors"
    counted: ClassVar[str] = "kept"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = ({"kept": 4},)
    family: ClassVar[str] = "strongest"
    source: ClassVar[str] = "ours"

    def __post_init__(self) -> None:
        whole(self, "kept", 1, MOST_KEPT)
        whole(self, "cells", 1, MOST_CELLS)
        within(self, "gamma", 0, MOST_GAMMA)
        one_of("key_bits", self.key_bits, KEY_BITS)
        super().__post_init__()

    @property
    def excludes_self(self) -> bool:
        return True

    @property
    def bits_per_pixel(self) -> float | None:
        words = -(-(self.kept + self.cells) // CELLS_OF_A_WORD)
        return self.key_bits * self.kept + 64 * words + 32 + self._extent_bits

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.kept,
            "cells": self.cells,
            "gamma": self.gamma,
            "large_keys": self.key_bits > 32,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        if self.key_bits > 32:  # whose atomics OpenGL has not
            return None
        return Targets(shaded=added(colours), words=self._words)

    def shipped_to(self) -> Targets | None:
        return Targets(shaded=added("16f", multiplied()), words=self._words)

    @property
    def _words(self) -> KeyWords:
        return KeyWords(words_of_keys(self.kept, self.key_bits), self.kept + self.cells)

    @property
    def costs_like(self) -> tuple[str, ...]:
        """Those by name have as many of each, whatever else is said."""
        usual = Anchors(4)
        own = (self.kept, self.cells, self.key_bits)
        return ("anchors4",) if own == (usual.kept, usual.cells, usual.key_bits) else ()


@dataclasses.dataclass(frozen=True)
class Strong(WarpedDepth):
    """The fragments that matter most occlude exactly, and a network reads moments of the rest.

    kept : 1 to 16 fragments of a pixel, anywhere on the ray: those with the greatest
        alpha exp(-gamma u), u being warped depth in [0, 1].
    gamma : 0 to 32: how much nearness counts beside alpha. From 3 to 6 it makes little difference.
    network : None, the one that comes with moit; the path of a file that `moit.train` or
        `Network.write` wrote; or a `moit.Network` of kind "strong".
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : "image", what maps to [-1, 1]. Moments are of each pixel's own extent whatever it
        is; "pixel" is refused.
    normalize : scale a pixel's colours so that their weights sum to what is covered (MBOIT eq. 2).
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Three passes, without order: keys as `Anchors` has them, and the pixel's extent; absorbance of
    all others, alone and by six Chebyshev polynomials of their place in that extent, added up in
    half floats; then shading. What is kept occludes what is behind it as it is. Of the others as
    much is in front as moments prove, and of what they leave open as much as the network says, as
    `BoundedNeural` has it. Half floats round as fragments arrive, by which answers differ with
    their order in the last digits of a half; where all of a pixel lie within a 65536th of the range
    of depth, nothing but these digits tells them apart, and order says which is in front. Fragments
    with the same key as the last that is kept count as kept, too, and occlude nothing: of random
    rays hardly any, of coincident ones all but `kept`. Ours.

    key_bits : 32 of each that is kept, or 64, whose depth has 24 bits for 16: fewer coincide.

    bits_per_pixel : keys, seven half floats, and an extent of two words of 16.

    >>> str(moit.Strong(5)), moit.Strong(5).bits_per_pixel
    ('strong5', 304)
    """

    kept: int
    gamma: float = 4.0
    network: NetworkOption = None
    key_bits: int = dataclasses.field(default=32, kw_only=True)

    kind: ClassVar[str] = "strong"
    counted: ClassVar[str] = "kept"
    usual: ClassVar[int] = 5
    listed: ClassVar[Listed] = ({"kept": 5},)
    family: ClassVar[str] = "strongest"
    source: ClassVar[str] = "ours, on the moments of Muenstermann et al. 2018 (MBOIT)"
    papers: ClassVar[tuple[str, ...]] = ("muenstermann2018",)

    def __post_init__(self) -> None:
        whole(self, "kept", 1, MOST_KEPT)
        within(self, "gamma", 0, MOST_GAMMA)
        one_of("key_bits", self.key_bits, KEY_BITS)
        refuse_own_range(self.depth_range, "moments")
        hold_network(self, self.network, self.network_kind)
        super().__post_init__()

    @property
    def excludes_self(self) -> bool:
        return True

    @property
    def network_kind(self) -> str:
        return self.kind

    @property
    def in_halves(self) -> bool:
        return True

    @property
    def bits_per_pixel(self) -> float | None:
        return self.key_bits * self.kept + 16 * 7 + 32

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.kept,
            "gamma": self.gamma,
            "large_keys": self.key_bits > 32,
            "network": network_of(self.network, self.network_kind).packed(),
        }

    def shipped_to(self) -> Targets | None:
        return Targets(
            held_in((*formats_for(6, "16f"), "r16f")),
            added("16f", multiplied()),
            words=KeyWords(words_of_keys(self.kept, self.key_bits)),
        )
