"""Recipes by which networks are trained: what from, how long, how fast, and to what end."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from moit.catalog import Technique
from moit.checks.arguments import one_of


@dataclass(frozen=True)
class Recipe:
    """How a network is trained.

    data : names of sets of moit.neural.data, scenes or files.
    fragments : how many of each, at most.
    epochs : how often each is seen.
    batch : about how many fragments there are to a step of Adam.
    rate : Adam's learning rate; falling: to 0 by half a cosine, else constant.
    loss : a name of moit.neural.losses.LOSSES.
    weights : how much more than by its loss each set counts, where data are the recipe's own;
        empty: all the same.
    starts : how many networks are begun, of which the best after a tenth of the epochs goes on.
    slices : of "neural-slices", as "5x6" how many slices of how many bits it learns to read, each
        from as many fragments; empty: those of the technique that is trained.
    """

    data: tuple[str, ...]
    fragments: int
    epochs: int
    batch: int
    rate: float
    falling: bool
    loss: str
    weights: tuple[float, ...] = ()
    starts: int = 1
    slices: tuple[str, ...] = ()

    def told(self) -> dict[str, Any]:
        """As networks and checkpoints have it: without slices where none are named."""
        return {k: value for k, value in asdict(self).items() if k != "slices" or value}

    def read_by(self, technique: Technique) -> list[Technique]:
        """The techniques of which a network for this one learns what it sees."""
        if not self.slices:
            return [technique]
        own: Any = technique
        pairs = [one.split("x") for one in self.slices]
        return [replace(own, count=int(n), bits=int(bits)) for n, bits in pairs]


FOUR = ("layers", "surfaces", "puffs", "tufts")

# NMT, section 3.2: 250,000 pairs, 1000 epochs of batches of 8192, Adam with .001, squared error.
PAPER = Recipe(("neural-training",), 250_000, 1000, 8192, 1e-3, False, "transmittance")
QUICK = Recipe(FOUR, 60_000, 20, 2048, 2e-2, True, "color")
BOUNDED = Recipe(
    (*FOUR, "sheets", "haze", "veils"),
    150_000,
    150,
    2048,
    3e-2,
    True,
    "picture",
    weights=(1, 1, 1, 1.5, 2.5, 1, 3),
    starts=4,
)
MOMENTS = Recipe(
    (*FOUR, "sheets", "haze", "veils", "neural-training"),
    100_000,
    60,
    2048,
    5e-3,
    True,
    "transmittance",
)
SLICES = replace(
    BOUNDED,
    fragments=20_000,
    epochs=120,
    rate=2e-2,
    starts=1,
    slices=("4x4", "4x8", "5x6", "6x5", "6x6", "8x8", "12x8", "16x8", "32x8"),
)
SHIPPED = {
    "neural": MOMENTS,
    "neural-image": MOMENTS,
    "dfa": Recipe((*FOUR, "sheets", "haze", "veils"), 100_000, 40, 2048, 1e-2, True, "picture"),
    "neural-bounded": BOUNDED,
    # With six moments four surfaces are exact: weight on sheets takes less from the others.
    "neural-bounded6": replace(BOUNDED, weights=(1, 1, 1, 1.5, 5, 1, 3)),
    "strong": BOUNDED,
    "neural-slices": SLICES,
}

RECIPES = ("quick", "paper", "shipped")


def recipe(name: Any, kind: str) -> Recipe:
    """The recipe of that name for networks of a kind; ValueError where there is none."""
    one_of("recipe", name, RECIPES)
    return {"quick": QUICK, "paper": PAPER, "shipped": SHIPPED[kind]}[name]
