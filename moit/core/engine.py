"""The one protocol between who asks and who computes.

Arguments are checked before they come here: fragments are Fragments in the precision that is
computed in, a technique is a Technique, backgrounds and depths are arrays that fit.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from moit.catalog.technique import Technique
from moit.fragments.fragments import Fragments

Array = NDArray[Any]
Depths = NDArray[np.float64] | None


class Question(Protocol):
    """Fragments and a technique, ready to be asked. Results have the fragments' precision.

    overflows : of how many pixels the last composite kept more than half floats hold.
    """

    @property
    def overflows(self) -> int: ...

    def composite(self, background: NDArray[np.float64]) -> Array:
        """(height, width, 4); background (3,) or (height, width, 3)."""

    def transmittance(self, depths: Depths) -> Array:
        """(N,) in front of each fragment, or at depths (K,) the curve (height, width, K)."""

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        """(lower, upper), shapes as `transmittance`."""

    def total_transmittance(self) -> Array:
        """(height, width), with transmission (height, width, 3)."""


class Engine(Protocol):
    """Who computes: the core, a GPU, the core and a GPU for a technique of every pixel's own.

    proves : whether its questions have bounds.
    """

    @property
    def proves(self) -> bool: ...

    def question(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> Question:
        """blends : whether colours will be asked for or weights looked at; without, what they need
        is not asked of the fragments.

        Raises FragmentsError where the fragments are not what the technique needs.
        """
