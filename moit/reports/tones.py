"""What a screen shows of linear radiance: the curves that take it into [0, 1]."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

TONES = ("none", "reinhard", "aces")
# Of red, green and blue in what the eye takes for brightness (ITU-R BT.709).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Curves are 1 there to every digit that a screen has, and squares of it are finite in float32.
BRIGHTEST = 1e9


def toned(radiance: Array, tone: str) -> Array:
    """(H, W, 3) in [0, 1] of linear radiance, still linear; what is negative is 0.

    tone : "none": as it is, cut off at 1.
        "reinhard": L / (1 + L) of the luminance L, colours scaled with it. Reinhard, Stark, Shirley
        and Ferwerda, "Photographic Tone Reproduction for Digital Images", 2002, equation (3).
        "aces": Narkowicz's fit of the curve of the Academy Color Encoding System, of each channel,
        with the factor 0.6 that brings it back to the original's brightness: "ACES Filmic Tone
        Mapping Curve", 2016. HDR-FLIP sees images so.
    """
    held: Array = np.clip(radiance, 0.0, BRIGHTEST)
    if tone == "reinhard":
        luminance = held @ LUMINANCE.astype(held.dtype)
        held = held / (1.0 + luminance[..., None])
    elif tone == "aces":
        x = 0.6 * held
        held = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return np.asarray(np.minimum(held, 1.0))
