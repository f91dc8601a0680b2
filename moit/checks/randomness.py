"""Seeds of what is random, given as moit has them or as Scientific Python's SPEC 7 has them."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from moit.checks.arguments import whole

MOST_SEED = 2**31 - 1


def seed_of(seed: Any, rng: Any, most: int = MOST_SEED) -> Any:
    """The seed that two arguments say together: `seed` itself where `rng` is None.

    rng : an integer from 0 to `most`, which is that seed; or what `numpy.random.default_rng` takes
        else, a Generator, BitGenerator, SeedSequence or several integers, of which one is drawn:
        of a Generator another in each call.

    Raises TypeError where both are given, or `rng` is neither; ValueError for an integer out of
    range.
    """
    if rng is None:
        return seed
    if seed != 0:
        raise TypeError(f"rng: expected one of seed and rng, got both, seed={seed!r:.80}")
    try:
        number = operator.index(rng)
    except TypeError:
        return int(generator_of(rng).integers(most, endpoint=True))
    return whole("rng", number if not isinstance(rng, bool) else rng, 0, most)


def generator_of(rng: Any) -> np.random.Generator:
    """The generator that `rng` stands for, as `numpy.random.default_rng` has it; None: another in
    each call. TypeError and ValueError name the argument."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        expected = "an integer from 0 or what numpy.random.default_rng takes"
        raise type(error)(f"rng: expected {expected}, got {rng!r:.80}") from None
