"""A second witness that bounds are proofs: python tests/bounds_witness.py [--cases 1000]

Hostile fragments (hostile.py) and `moit.bounds` of every technique that has some. What the
fragments let through to each depth asked is enclosed by interval arithmetic in 200 bits (Arb,
`pip install python-flint`): a ball that holds the true product of 1 - alpha whatever rounding does.
A bound is refuted where it lies beyond that ball. mpmath, the first witness (tests/test_bounds.py),
has no such enclosure. Exits with 1 where a bound is refuted.
"""

import argparse
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import hostile

import moit

BITS = 200


def enclosures(f: moit.Fragments, depths: np.ndarray) -> Iterator[tuple[int, list]]:
    """(pixel, [a ball for each depth]): what is strictly nearer lets through."""
    from flint import arb

    for pixel, (begin, end) in enumerate(zip(f.offsets[:-1], f.offsets[1:], strict=True)):
        order = np.argsort(f.depth[begin:end], kind="stable") + begin
        through, found, next_one = arb(1), [None] * len(depths), 0
        for place in np.argsort(depths, kind="stable"):
            while next_one < len(order) and f.depth[order[next_one]] < depths[place]:
                through *= 1 - arb(float(f.alpha[order[next_one]]))
                next_one += 1
            found[place] = through
        yield pixel, found


def refuted(f: moit.Fragments, technique: moit.Technique, depths: np.ndarray) -> Iterator[str]:
    """Bounds of a curve that the enclosure of the truth leaves no room for."""
    lower, upper = moit.bounds(f, technique, depth=depths)
    low, high = (side.reshape(-1, len(depths)).astype(float) for side in (lower, upper))
    for pixel, balls in enclosures(f, depths):
        for k, ball in enumerate(balls):
            below, above = ball < low[pixel, k], ball > high[pixel, k]  # surely so, or not
            if below or above:
                side = "lower" if below else "upper"
                told = low[pixel, k] if below else high[pixel, k]
                yield f"{technique}: pixel {pixel}, depth {depths[k]!r}: {side} {told!r}, {ball}"


def main() -> None:
    from flint import ctx

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    ctx.prec = BITS
    faults = tried = 0
    for number in range(options.first, options.first + options.cases):
        case = hostile.case_of(number)
        f = case.fragments
        thick = f.back is not None or f.deviation is not None or f.transmission is not None
        if thick or not len(f) or not case.technique.has_curve:
            continue
        some = f.depth[:40].astype(np.float64)
        depths = np.unique(np.concatenate([some, 1.5 * some]))
        most = float(np.finfo(f.depth.dtype).max)
        depths = depths[np.abs(depths) < min(most, hostile.FINITE)].astype(f.depth.dtype)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                for what in refuted(f, case.technique, depths):
                    faults += 1
                    print(f"case {number}: {what}", flush=True)
            tried += 1
        except (moit.MoitError, ValueError, TypeError):
            pass  # what this technique does not take
    print(f"{tried} cases of {options.cases} have bounds; {faults} bounds refuted")
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
