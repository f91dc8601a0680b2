"""What people call techniques: names that papers and engines use, for those of the catalog."""

from __future__ import annotations

import re

# What stands for a name, or for the part of one before its number.
ALIASES = {
    "a-buffer": "sorted",
    "abuffer": "sorted",
    "linked-list": "sorted",
    "linked-lists": "sorted",
    "per-pixel-linked-list": "sorted",
    "per-pixel-linked-lists": "sorted",
    "ppll": "sorted",
    "exact": "sorted",
    "alpha-blend": "unsorted",
    "alpha-blending": "unsorted",
    "over": "unsorted",
    "weighted-blended": "wboit",
    "mt": "moment-transparency",
    "mt-nlqm": "moment-transparency-nlqm",
    "mt-lr8": "moment-transparency-lr8",
    "tmp": "two-moments-pass",
    "tmp-lr8": "two-moments-pass-lr8",
    "nmt": "neural",
    "deep-fragments": "dfa",
    "dsm": "deep-shadow",
    "deep-shadow-map": "deep-shadow",
    "hashed": "hashed-alpha",
    "fourier-opacity": "fourier",
    "fom": "fourier",
    "tfm": "transmittance-function-map",
    "mboit": "power",
    "moment-based": "power",
    "at": "adaptive",
    "aoit": "adaptive",
    "adaptive-transparency": "adaptive",
    "ht": "hybrid",
    "hybrid-transparency": "hybrid",
    "k-buffer": "kbuffer",
    "dp": "depth-peeling",
    "peeling": "depth-peeling",
    "multi-layer-alpha-blending": "mlab",
    "trigonometric": "trig",
    "st": "stochastic",
    "stochastic-transparency": "stochastic",
}
# The number that is meant where none is said.
USUAL_NUMBERS = {
    "power": 4,
    "trig": 2,
    "fourier": 7,
    "adaptive": 4,
    "mlab": 4,
    "kbuffer": 4,
    "hybrid": 4,
    "front": 2,
    "depth-peeling": 4,
    "transmittance-function-map": 8,
    "wavelet": 8,
    "slices": 64,
    "stochastic": 8,
}


def spelled(name: str) -> str:
    """A base name as the catalog spells it, whatever the case, the hyphens and the alias.

    >>> from moit.catalog.aliases import spelled
    >>> spelled("MBOIT"), spelled("MLAB_2"), spelled("mboit6-16"), spelled("A-Buffer")
    ('power4', 'mlab2', 'power6-16', 'sorted')
    """
    name = re.sub(r"[\s_]+", "-", name.strip().lower())
    name = ALIASES.get(name, name)
    parts = re.fullmatch(r"([a-z][a-z-]*?)-?([0-9]*)(-16)?", name)
    if parts is None:
        return name
    family = ALIASES.get(parts[1], parts[1])
    if family not in USUAL_NUMBERS:
        return name
    number, words = parts[2], parts[3] or ""
    if number == "16" and name.endswith("-16") and not words and family in ("power", "trig"):
        number, words = "", "-16"
    return f"{family}{number or USUAL_NUMBERS[family]}{words}"


def separated(text: str) -> list[str]:
    """The names in a text that commas separate; those within brackets and quotes do not.

    >>> from moit.catalog.aliases import separated
    >>> separated("power4, power6(bias=0.0,warp='linear')")
    ['power4', "power6(bias=0.0,warp='linear')"]
    """
    found, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter in "([{":
            depth += 1
        elif letter in ")]}":
            depth -= 1
        if letter == "," and depth <= 0 and not quote:
            found.append("")
        else:
            found[-1] += letter
    return [one.strip() for one in found]
