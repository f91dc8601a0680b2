"""What the network of `moit.NeuralSlices` gains: `python docs/slice_network.py` prints the numbers
of docs/frontier.md, "A network that reads slices". A minute.

The network that comes with moit was trained by `python docs/neural.py --weights neural-slices`, on
rays of moit.neural.data; its recipe was chosen on the draw tune-61, and it is judged on another, of
the kind "check". Slices as they are read as a medium would be that is even between them.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import moit
from moit.judging.draws import SCENES, SETS, Draw, draw_named
from moit.metrics import flip
from moit.neural.examples import SLICES_ALONE
from moit.neural.features import features
from moit.neural.losses import LOSSES, Truth

JUDGED = ("3x5", "4x4", "4x8", "5x6", "6x5", "8x8", "12x8", "16x8", "32x8")
CHECK_SEED = 83
RAYS, SIZE = 1500, (160, 90)
OTHERS = (
    *("neural-bounded6(depth_range='pixel',storage='half')", "strong2", "strong5", "anchors4"),
    *("slices36(bits=6,cells=256,resolution=2,table='tile',tile=12,total='byte')", "avboit"),
)


def as_they_are(technique: moit.NeuralSlices) -> moit.PythonTechnique:
    """Its slices, read without a network."""

    def transmittance(f: moit.Fragments) -> NDArray[np.float64]:
        seen = features(f, technique, cull_opaque=False)
        least, room = seen[:, -2], seen[:, -1]
        return np.exp(-(least + seen[:, SLICES_ALONE] * room))

    return moit.PythonTechnique("slices", transmittance)


def on_rays(technique: Any, draw: Draw) -> list[float]:
    """RMSE of colours on each set, as is to be expected of random colours."""
    found = []
    for letter in SETS:
        f = draw.rays(letter, RAYS).at()
        T, exact = (moit.transmittance(f, one).astype(np.float32) for one in (technique, "sorted"))
        counts = f.counts.ravel()[f.counts.ravel() > 0]
        starts, weight = np.cumsum(counts) - counts, np.ones(len(counts), np.float32)
        truth = Truth(exact, f.alpha, starts, counts, weight)
        found.append(math.sqrt(LOSSES["color"](T, truth)[0]))
    return found


def on_scenes(techniques: Sequence[Any], draw: Draw) -> NDArray[np.float64]:
    """Mean FLIP of each."""
    rows = []
    for name in SCENES:
        f, background = draw.scene(name, SIZE)
        exact, *found = (
            moit.composite(f, one, background=background, threads=1)[..., :3]
            for one in ("sorted", *techniques)
        )
        rows.append([float(np.mean(flip(image, exact))) for image in found])
    return np.mean(rows, axis=0)


def main() -> None:
    parser = argparse.ArgumentParser(description="What a network makes of slices.")
    parser.add_argument("slices", nargs="*", default=JUDGED, help="COUNTxBITS")
    parser.add_argument("--seed", type=int, default=CHECK_SEED, help="of the draw")
    given = parser.parse_args()
    draw = draw_named("check", given.seed)
    learnt = [moit.NeuralSlices(*map(int, pair.split("x"))) for pair in given.slices]
    plain = [as_they_are(one) for one in learnt]
    others = [moit.technique(name) for name in OTHERS]
    flips = on_scenes([*plain, *learnt, *others], draw)
    heads = "| slices | bits | bytes | RMSE, as they are | RMSE | FLIP, as they are | FLIP |"
    print(heads)
    print("| --: | --: | --: | --: | --: | --: | --: |")
    for k, one in enumerate(learnt):
        rays = [float(np.mean(on_rays(each, draw))) for each in (plain[k], one)]
        cells = [*rays, flips[k], flips[k + len(learnt)]]
        size = f"{(one.bits_per_pixel or 0) / 8:g}"
        print(f"| {one.count} | {one.bits} | {size} |", *(f"{x:.4f} |" for x in cells), flush=True)
    for one, error in zip(others, flips[2 * len(learnt) :], strict=True):
        print(f"`{one}`: FLIP {error:.4f}, {(one.bits_per_pixel or 0) / 8:g} bytes")


if __name__ == "__main__":
    main()
