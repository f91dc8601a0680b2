"""What techniques are predicted to take on a named GPU, by the costs that come with moit."""

from __future__ import annotations

import dataclasses
from typing import Any

from moit.catalog import Technique
from moit.gpu_costs.cards import DEFAULT, Card, card
from moit.gpu_costs.frames import Frame, Prediction, predicted
from moit.gpu_costs.stored import Costs, stored

RESOLUTION = (1920, 1080)
MOST_SIDE = 1 << 20  # beyond any screen


@dataclasses.dataclass(frozen=True)
class OnGpu:
    """A GPU and a resolution, for which frames are predicted.

    gpu : the GPU.
    resolution : (width, height) of the frame, in pixels.
    """

    gpu: Card
    resolution: tuple[int, int]

    def __str__(self) -> str:
        width, height = self.resolution
        return f"{self.gpu.title} at {width}x{height}"

    def frame(
        self, technique: Technique, fragments: int, pixels: int, covered: int | None = None
    ) -> Prediction | None:
        """Of a picture with so many fragments and pixels, drawn at this resolution: a pixel then
        has as many fragments as before. None where no costs are stored of the technique.

        covered : pixels that have fragments; None: as many as there are fragments for.
        """
        width, height = self.resolution
        scale = width * height / max(1, pixels)
        found = stored().nearest(technique, self.gpu.family)
        costs = found[2] if found else {}
        if not found and technique.kind != "unsorted":
            return None
        touched = None if covered is None else scale * covered
        frame = Frame(scale * fragments, width * height, touched)
        return predicted(technique, costs, self.gpu, frame)

    def milliseconds(
        self, technique: Technique, fragments: int, pixels: int, covered: int | None = None
    ) -> float | None:
        """All of that frame."""
        found = self.frame(technique, fragments, pixels, covered)
        return None if found is None else found.total


def on_gpu(gpu: str | Card | None = None, resolution: Any = None) -> OnGpu:
    """A GPU by its name (None: DEFAULT), and (width, height) (None: RESOLUTION).

    Raises ValueError where the GPU is not known, or costs of its family are not stored; TypeError
    and ValueError where the resolution is no two whole numbers from 1 to MOST_SIDE.
    """
    found = card(DEFAULT if gpu is None else gpu)
    _check_family(found, stored())
    size = RESOLUTION if resolution is None else resolution
    try:
        width, height = size
    except (TypeError, ValueError):
        raise TypeError(f"resolution: expected (width, height), got {size!r:.80}") from None
    for one in (width, height):
        if isinstance(one, bool) or not hasattr(one, "__index__"):
            raise TypeError(f"resolution: expected whole numbers, got {size!r:.80}")
        if one < 1:
            raise ValueError(f"resolution: expected at least 1 pixel a side, got {size!r:.80}")
        if one > MOST_SIDE:
            raise ValueError(
                f"resolution: expected at most {MOST_SIDE} pixels a side, got {size!r:.80}"
            )
    return OnGpu(found, (int(width), int(height)))


def _check_family(found: Card, costs: Costs) -> None:
    if found.family not in costs.families:
        raise ValueError(
            f"gpu: {found.name} is of the family {found.family!r}; costs are stored of "
            f"{', '.join(costs.families)}"
        )
