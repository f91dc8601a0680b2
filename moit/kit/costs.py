"""What `moit bench --gpu-cost` has stored of a technique's text, for its page."""

from __future__ import annotations

from moit.catalog import Technique
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.predicting import RESOLUTION, on_gpu
from moit.gpu_costs.stored import ENGINE, stored

SHOWN = ("family", "pass", "cycles", "instructions", "registers")


def cost_rows(technique: Technique) -> list[dict[str, str]]:
    """By GPU family and pass; none where nothing is stored of this technique."""
    return [
        {name: str(row[name]) for name in SHOWN}
        for row in stored().rows
        if row["text"] == ENGINE and row["technique"] in (str(technique), technique.base_name)
    ]


DENSITY = 4.5  # fragments a pixel, as MBOIT's teapots have


def frame_rows(technique: Technique) -> list[tuple[str, str, str]]:
    """By card: milliseconds that a whole frame is predicted to take, and how many of these are
    beyond what unsorted alpha blending takes; cards that costs are stored of, no others near."""
    width, height = RESOLUTION
    found = []
    for card in CARDS.values():
        if not card.own or card.family not in stored().families:
            continue
        frame = on_gpu(card).frame(technique, int(DENSITY * width * height), width * height)
        if frame:
            found.append((card.title, f"{frame.total:.2f}", f"{frame.beyond:.2f}"))
    return found
