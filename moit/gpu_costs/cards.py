"""GPUs by name: what a model of a frame has to know of them."""

from __future__ import annotations

import dataclasses

from moit.checks.arguments import nearest, whole


@dataclasses.dataclass(frozen=True)
class Card:
    """A GPU.

    name : as users give it.
    title : as it is sold.
    family : of AMD's compiler, whose cycles count; "navi21" is RDNA 2, "gfx1100" RDNA 3, "vega10"
        GCN.
    own : whether the card is of this family; else it stands for the card as the nearest.
    units : that run waves, each for its own.
    clock : GHz, that the maker names for games (boost).
    bandwidth : GB/s, of its memory.
    source : where units, clock and bandwidth are from.
    """

    name: str
    title: str
    family: str
    own: bool
    units: int
    clock: float
    bandwidth: float
    source: str

    def __post_init__(self) -> None:
        whole("units", self.units, 1)
        for name in ("clock", "bandwidth"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise TypeError(f"{name}: expected a number, got {value!r:.80}")
            if not 0 < value < float("inf"):
                raise ValueError(f"{name}: expected a finite number above 0, got {value!r:.80}")


_AMD = "AMD's product page"
_NVIDIA = "NVIDIA's white paper"

# A compute unit of RDNA has two units of 32 lanes, one of GCN four of 16. A multiprocessor of
# NVIDIA's has four of 32, which like those of RDNA 2 take two cycles for 64 fragments and have a
# quarter as many lanes (from Volta on an eighth) for exp2, log2 and roots.
CARDS = {
    card.name: card
    for card in (
        Card("rx580", "Radeon RX 580", "vega10", False, 36 * 4, 1.340, 256, _AMD),
        Card("rxvega56", "Radeon RX Vega 56", "vega10", True, 56 * 4, 1.471, 410, _AMD),
        Card("rxvega64", "Radeon RX Vega 64", "vega10", True, 64 * 4, 1.546, 484, _AMD),
        Card("steamdeck", "Steam Deck (LCD)", "navi21", False, 8 * 2, 1.600, 88, "Valve's page"),
        Card("rx6600", "Radeon RX 6600", "navi21", False, 28 * 2, 2.491, 224, _AMD),
        Card("rx6800", "Radeon RX 6800", "navi21", True, 60 * 2, 2.105, 512, _AMD),
        Card("rx6900xt", "Radeon RX 6900 XT", "navi21", True, 80 * 2, 2.250, 512, _AMD),
        Card("rx7600", "Radeon RX 7600", "gfx1100", False, 32 * 2, 2.655, 288, _AMD),
        Card("rx7900xtx", "Radeon RX 7900 XTX", "gfx1100", True, 96 * 2, 2.500, 960, _AMD),
        Card("gtx1080ti", "GeForce GTX 1080 Ti", "navi21", False, 28 * 4, 1.582, 484, _NVIDIA),
        Card("rtx3060", "GeForce RTX 3060", "navi21", False, 28 * 4, 1.777, 360, _NVIDIA),
    )
}
DEFAULT = "rx6800"


def card(name: str | Card, argument: str = "gpu") -> Card:
    """The card of this name; a Card of one's own is taken as it is.

    Raises ValueError where there is none.
    """
    if isinstance(name, Card):
        return name
    if not isinstance(name, str):
        raise TypeError(f"{argument}: expected the name of a GPU, got {type(name).__name__}")
    plain = "".join(letter for letter in name.lower() if letter.isalnum()).removeprefix("radeon")
    found = CARDS.get(plain.removeprefix("geforce"))
    if found is None:
        raise ValueError(f"{argument}: unknown {name!r:.80}{nearest(name, list(CARDS))}")
    return found
