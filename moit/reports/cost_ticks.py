"""Where the ticks of an axis of times are: as many as there is room for."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.ticker import Locator

from moit.reports.charts import nice_ticks

LABEL = 4.3  # what "500 µs" and the space before the next label take, in the size of its letters


class TimeLocator(Locator):
    """1, 2 and 5 times powers of ten, fewer, or any round numbers: as many as have room on a
    logarithmic axis when it is drawn."""

    def __init__(self, least: float, greatest: float) -> None:
        self.least, self.greatest = least, greatest

    def __call__(self) -> Sequence[float]:
        assert self.axis is not None
        low, high = self.axis.get_view_interval()
        return self.tick_values(float(low), float(high))

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        low = math.log10(vmin if vmin > 0 else self.least)
        high = math.log10(vmax if vmax > 0 else self.greatest)
        room = self._labels() / max(high - low, 0.3)  # for labels, in a decade
        for factors in ((1, 2, 5), (1, 3), (1,)):
            # The narrowest step decides: of 1, 2, 5 it is from 1 to 2.
            steps = [b / a for a, b in zip(factors, (*factors[1:], 10), strict=True)]
            if room * math.log10(min(steps)) >= 1:
                break
        powers = range(math.floor(low) - 1, math.ceil(high) + 1)
        if len(factors) == 1:
            every = max(1, math.ceil(1 / max(room, 1e-3)))
            powers = range(powers.start // every * every, powers.stop, every)
        ticks = [k * 10.0**power for power in powers for k in factors]
        if sum(low <= math.log10(tick) <= high for tick in ticks) >= 2:
            return ticks
        return nice_ticks(10**low, 10**high, max(2, min(5, int(self._labels()))))

    def _labels(self) -> float:
        """How many labels have room side by side."""
        assert self.axis is not None
        return float(self.axis.get_tick_space() * 3 / LABEL)  # these are thrice as wide as high
