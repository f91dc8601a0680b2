"""Recipes by which networks are trained: what from, how long, how fast, and to what end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from moit.arguments import one_of


@dataclass(frozen=True)
class Recipe:
    """How a network is trained.

    data : names of sets of moit.neural.data, scenes or files; each counts the same.
    fragments : how many of each, at most.
    epochs : how often each is seen.
    batch : about how many fragments there are to a step of Adam.
    rate : Adam's learning rate; falling: to 0 by half a cosine, else constant.
    loss : a name of moit.neural.losses.LOSSES.
    starts : how many networks are begun, of which the best after a tenth of the epochs goes on.
    """

    data: tuple[str, ...]
    fragments: int
    epochs: int
    batch: int
    rate: float
    falling: bool
    loss: str
    starts: int = 1


FOUR = ("layers", "surfaces", "puffs", "tufts")

# NMT, section 3.2: 250,000 pairs, 1000 epochs of batches of 8192, Adam with .001, squared error.
PAPER = Recipe(("neural-training",), 250_000, 1000, 8192, 1e-3, False, "transmittance")
QUICK = Recipe(FOUR, 60_000, 40, 4096, 5e-3, True, "color")
SHIPPED = Recipe((*FOUR, "mixtures"), 400_000, 200, 8192, 5e-3, True, "color")

RECIPES = ("quick", "paper", "shipped")


def recipe(name: Any, kind: str) -> Recipe:
    """The recipe of that name for networks of a kind; ValueError where there is none."""
    one_of("recipe", name, RECIPES)
    return {"quick": QUICK, "paper": PAPER, "shipped": SHIPPED}[name]
