"""What people call techniques: names that papers and engines use, for those of the catalog."""

from __future__ import annotations

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
