"""Writes renormalised.md, techniques as published and renormalised, and merged by energy.

    python docs/renormalised.py [--seed 7] [--pixels 3000] [--width 320]

Rays and scenes are those of a draw of the kind "check" (moit.judging.draws): none was tuned on it.
"""

import argparse
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import moit
from moit.judging.draws import SCENES, draw_named
from moit.system.files import write_text

HERE = Path(__file__).parent
LETTERS = "ABCD"
# Each with both values of `normalize`; the name alone is as moit has it by default.
TECHNIQUES = (
    *("adaptive4", "adaptive8", "deep-shadow", "transmittance-function-map8"),
    *("fourier7", "fourier15", "wavelet8", "wavelet16", "stochastic8"),
    *("depth-peeling4", "hybrid4", "weighted-sum"),
    *("power4", "power6", "power8", "trig2", "trig3", "trig4"),
    *("power4-16", "trig2-16", "moment-transparency"),
    *("neural", "neural-bounded", "neural-bounded6"),
)
# With merge as published and "energy".
MERGED = ("adaptive4(normalize=True)", "adaptive8(normalize=True)", "mlab2", "mlab4")


@dataclasses.dataclass(frozen=True)
class Errors:
    """Of one technique: by letter root mean square errors of colours, and of each scene FLIP."""

    rays: tuple[float, ...]
    scenes: tuple[float, ...]

    @property
    def flip(self) -> float:
        return float(np.mean(self.scenes))


class Judge:
    """What techniques are asked about, and what is exact of it."""

    def __init__(self, seed: int, pixels: int, size: tuple[int, int]) -> None:
        draw = draw_named("check", seed)
        self.rays = [draw.rays(letter, pixels).at() for letter in LETTERS]
        self.scenes = [draw.scene(name, size) for name in SCENES]
        self.colours = [moit.composite(f, "sorted")[..., :3] for f in self.rays]
        self.pictures = [moit.composite(f, "sorted", background=b) for f, b in self.scenes]

    def errors(self, technique: moit.Technique) -> Errors:
        apart = (
            moit.composite(f, technique)[..., :3] - exact
            for f, exact in zip(self.rays, self.colours, strict=True)
        )
        flips = (
            moit.metrics.flip(moit.composite(f, technique, background=behind), exact)
            for (f, behind), exact in zip(self.scenes, self.pictures, strict=True)
        )
        rays = tuple(float(np.sqrt(np.mean(np.square(one, dtype=float)))) for one in apart)
        return Errors(rays, tuple(map(float, flips)))


def row(name: str, size: str, before: Errors, after: Errors) -> str:
    pairs = [*zip(before.rays, after.rays, strict=True), (before.flip, after.flip)]
    worse = sum(b > a + 5e-5 for a, b in zip(before.scenes, after.scenes, strict=True))
    cells = " | ".join(f"{a:.4f} | {b:.4f}" for a, b in pairs)
    return f"| `{name}` | {size} | {cells} | {worse} |"


def head(before: str, after: str, more: str) -> list[str]:
    pairs = " | ".join(f"{one} {before} | {after}" for one in (*LETTERS, "FLIP"))
    return [
        f"| technique | {more} | {pairs} | scenes worse |",
        "|---|---|" + "---|" * (2 * len(LETTERS) + 3),
    ]


def renormalised(judge: Judge) -> Iterator[str]:
    yield from head("raw", "renorm.", "default")
    for name in TECHNIQUES:
        one = moit.technique(name)
        raw, scaled = (
            judge.errors(dataclasses.replace(one, normalize=value)) for value in (False, True)
        )
        print(name, raw.flip, scaled.flip, flush=True)
        yield row(name, "renorm." if one.normalize else "raw", raw, scaled)


def merged(judge: Judge) -> Iterator[str]:
    yield from head("published", "energy", "bytes")
    for name in MERGED:
        one = moit.technique(name)
        published, energy = (
            judge.errors(dataclasses.replace(one, merge=merge)) for merge in one.merges
        )
        print(name, published.flip, energy.flip, flush=True)
        yield row(name, f"{one.bits_per_pixel / 8:.0f}", published, energy)


def page(seed: int, pixels: int, width: int) -> str:
    size = (width, width * 9 // 16)
    judge = Judge(seed, pixels, size)
    command = f"python docs/renormalised.py --seed {seed} --pixels {pixels} --width {width}"
    return "\n".join(
        [
            "# As published, renormalised, and merged by energy",
            "",
            f"Made by `{command}`. A to D are root mean square errors of colours on {pixels} rays "
            "each, over black: even layers, 1 to 4 surfaces, a cloud with surfaces, hair; no two "
            f"fragments of a ray are at one depth. FLIP is the mean over {len(SCENES)} scenes of "
            f"{size[0]} x {size[1]} pixels; the last column counts scenes where it grew, by more "
            'than .00005. Rays and scenes are the draw "check" of that seed: nothing was tuned on '
            "it.",
            "",
            "## Renormalised",
            "",
            "`normalize` scales a pixel's colours so that their weights sum to what the pixel "
            "covers (Muenstermann et al. 2018, equation 2). The papers of moments say so; those of "
            "adaptive transparency, depth peeling, hybrid transparency and the weighted sum do "
            "not, so there it is an option, and reports name what it changes. `depth-peeling` and "
            "`hybrid` take the exact coverage for it, one target more that multiplies up (of "
            "`hybrid` in place of its count); the weighted sum has the colours of "
            "`weighted-average` then, with exact coverage.",
            "",
            *renormalised(judge),
            "",
            "## Merged by energy",
            "",
            'With `merge="energy"` adaptive transparency merges the two nodes whose merging harms '
            "the picture least, and multi-layer alpha blending two layers likewise, not the node "
            "of the least area and not always the two farthest layers; the merged one stands "
            "where the heavier stood, or between (csrc/kernels/adaptive.h, mlab.h). Same bytes, "
            "passes and access. `mlab` keeps all that layers take: it has nothing to renormalise. "
            "Both stay exact for as many fragments as before, and `mlab` for any number that "
            "arrive front to back or back to front.",
            "",
            *merged(judge),
            "",
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--pixels", type=int, default=3000)
    parser.add_argument("--width", type=int, default=320)
    given = parser.parse_args()
    write_text(HERE / "renormalised.md", page(given.seed, given.pixels, given.width))


if __name__ == "__main__":
    main()
