"""Light of deep samples: files hold it whole, Fragments as alpha times colour and as emission."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.fragments.fragments import Fragments

Floats = NDArray[np.float32]


def divided(light: Sequence[Floats], alpha: Floats) -> tuple[Floats, Floats | None]:
    """(color, emission), (N, 3) each, of three channels of light (N,), finite.

    Light is colour times alpha where float32 has the quotient, and emission where not: where alpha
    is 0 or below the least normal number, of which processors may make 0, or where the quotient is
    beyond the greatest. Without any, emission is None.
    """
    color = np.empty((len(alpha), 3), np.float32)
    seen = alpha >= np.finfo(np.float32).tiny
    every = bool(seen.all())  # a mask is slow
    emits = ~seen
    with np.errstate(over="ignore", under="ignore"):
        for c, own in enumerate(light):
            np.divide(own, alpha, out=color[:, c], where=True if every else seen)
            emits |= ~np.isfinite(color[:, c])
    if not emits.any():
        return color, None
    color[emits] = 0
    whole = np.stack(light, axis=1)
    if not whole[emits].any():
        return color, None
    return color, np.where(emits[:, None], whole, np.float32(0))


def multiplied(f: Fragments, channel: int) -> NDArray[Any]:
    """(N,) the light of fragments with colour in a channel."""
    assert f.color is not None
    light: NDArray[Any] = f.color[:, channel] * f.alpha
    return light if f.emission is None else light + f.emission[:, channel]
