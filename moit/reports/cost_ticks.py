"""Where the ticks of an axis of times are: as many as there is room for."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.ticker import Locator

LABEL = 4.3  # what "500 µs" and the space before the next label take, in the size of its letters


class TimeLocator(Locator):
    """1, 2 and 5 times powers of ten, or fewer, for a logarithmic axis as wide as it is then."""

    def __init__(self, least: float, greatest: float) -> None:
        self.least, self.greatest = least, greatest

    def __call__(self) -> Sequence[float]:
        assert self.axis is not None
        low, high = self.axis.get_view_interval()
        return self.tick_values(float(low), float(high))

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        low = math.log10(vmin if vmin > 0 else self.least)
        high = math.log10(vmax if vmax > 0 else self.greatest)
        for factors in ((1, 2, 5), (1, 3), (1,)):
            # The narrowest step decides: of 1, 2, 5 it is from 1 to 2.
            steps = [b / a for a, b in zip(factors, (*factors[1:], 10), strict=True)]
            if self._room(low, high) * math.log10(min(steps)) >= 1:
                break
        powers = range(math.floor(low) - 1, math.ceil(high) + 1)
        if len(factors) == 1:
            every = max(1, math.ceil(1 / max(self._room(low, high), 1e-3)))
            powers = range(powers.start // every * every, powers.stop, every)
        return [k * 10.0**power for power in powers for k in factors]

    def _room(self, low: float, high: float) -> float:
        """How many labels a decade has room for."""
        assert self.axis is not None
        labels = self.axis.get_tick_space()  # of three times the size of their letters
        return labels * 3 / LABEL / max(high - low, 0.3)
