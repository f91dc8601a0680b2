"""The published passes, written plainly (shaders/published): yardsticks of what ours cost."""

from __future__ import annotations

from collections.abc import Iterator

from moit.gpu.texts import source
from moit.gpu_costs.frames import ACCUMULATE, TRANSMITTANCE

# Bias, and even moments of what is mixed in: the supplement of Moment-Based Order-Independent
# Transparency (Muenstermann, Krumpen, Klein, Peters 2018), 32 bits.
POWER = {
    4: ("5e-7", ".375, .375"),
    6: ("5e-6", ".48, .451, .45"),
    8: ("5e-5", ".75, .67666667, .63, .6003003"),
}
TRIGONOMETRIC = {2: "4e-7", 3: "8e-7", 4: "1.5e-6"}
BETA = 0.25


def published_texts() -> dict[tuple[str, str], str]:
    """GLSL of compute shaders by technique and pass."""
    return dict(_texts())


def _texts() -> Iterator[tuple[tuple[str, str], str]]:
    for number, name in enumerate((ACCUMULATE, TRANSMITTANCE), 1):
        for count, (bias, even) in POWER.items():
            fixed: dict[str, str | float] = {"MOMENTS": count, "BIAS": bias, "PASS": number}
            text = source("published/power_moments.glsl", EVEN=even, OVERESTIMATION=BETA, **fixed)
            yield (f"power{count}", name), text
        for count, bias in TRIGONOMETRIC.items():
            fixed = {"MOMENTS": count, "BIAS": bias, "PASS": number}
            file = "published/trigonometric_moments.glsl"
            yield (f"trig{count}", name), source(file, OVERESTIMATION=BETA, **fixed)
        for count in (7, 15):
            harmonics = (count - 1) // 2
            text = source("published/fourier.glsl", HARMONICS=harmonics, PASS=number)
            yield (f"fourier{count}", name), text
        yield ("adaptive4", name), source("published/adaptive.glsl", NODES=4, PASS=number)
        text = source("published/moment_transparency.glsl", BIAS="3e-7", PASS=number)
        yield ("moment-transparency", name), text
        yield ("neural", name), source("published/neural.glsl", PASS=number)
    for count in (2, 4, 6):
        yield (f"mlab{count}", ACCUMULATE), source("published/mlab.glsl", LAYERS=count)
    yield ("wboit", ACCUMULATE), source("published/weighted.glsl")
