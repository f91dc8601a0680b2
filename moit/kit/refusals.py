"""Why techniques have no text for engines, what each would need, and which kit is nearest."""

from __future__ import annotations

from moit.catalog import Technique

_LIST = "it needs a list of each pixel's fragments, and a pass over pixels that sorts this list and"
_NEEDS = {
    "unsorted": "it is a blend function, one and one-minus-src-alpha, and no more",
    "sorted": f"{_LIST} blends it",
    "deep-shadow": f"{_LIST} compresses its curve to as many nodes as the tolerance takes",
    "transmittance-function-map": f"{_LIST} projects its exact transmittance onto cosines",
    "dfa": (
        "it needs a pass over geometry that finds the two nearest fragments of a pixel before one "
        "that adds up all others behind them, for a network"
    ),
}
_NEAREST = {
    "unsorted": "weighted-average",
    "deep-shadow": "adaptive16",
    "transmittance-function-map": "fourier7",
    "dfa": "hybrid4",
}


def why_not(technique: Technique) -> str:
    """What a kit of a technique without one would need."""
    if technique.kind in _NEEDS:
        return _NEEDS[technique.kind]
    if technique.engine != "core":
        return "it is no single technique of passes"
    if technique.needs_order:
        return "its fragments change a pixel one after the other, which blending alone cannot do"
    return "there is no text of it for engines"


def nearest_kit(technique: Technique) -> str:
    """Of what a technique without one stands near, as it is written in messages."""
    return f"'{_NEAREST.get(technique.kind, 'power4')}'"
