"""What a network makes of slices: `python docs/slice_network.py` prints the numbers of
docs/frontier.md, "A network that reads slices". Some two minutes.

Slices stand at equal steps of a pixel's own range of depth, as `moit.Slices` has them with
depth_range="pixel". What is in slices before that at a fragment's front is in front of it for sure;
of what the two slices around it have besides, some may be. `moit.Slices` counts as much as a medium
would that is even between slices; here a network of two layers of eight says how much, as bounded
networks do of moments. It is trained on rays of moit.neural.data, and judged on a draw of the kind
"check", rays and scenes.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import moit
from moit.judging.draws import SCENES, SETS, Draw, draw_named
from moit.metrics import flip
from moit.neural import data
from moit.neural.backpropagation import Perceptron
from moit.neural.examples import Examples
from moit.neural.fitting import Schedule, State, fit
from moit.neural.losses import LOSSES, Truth

Array = NDArray[Any]

MOST = 5.5412635451584258  # optical depth of a slice of 8 bits
STEP = MOST / 255
FRAGMENTS, EPOCHS, BATCH, RATE, STARTS = 25_000, 40, 2048, 2e-2, 2
TRAINING_SEED, CHECK_SEED = 77, 71
RAYS, SIZE = 1500, (160, 90)


@dataclasses.dataclass(frozen=True)
class Seen:
    """Of fragments, in the order `order` of those that were given: what a network sees of them,
    what is absorbed in front of them for sure, what may be, what slices say without a network, and
    what is true. starts, counts : of pixels that have any."""

    order: Array
    features: Array
    least: Array
    room: Array
    plain: Array
    exact: Array
    alpha: Array
    starts: Array
    counts: Array

    def examples(self, weight: float = 1.0) -> Examples:
        weights = np.full(len(self.counts), weight, np.float32)
        exact, alpha = self.exact.astype(np.float32), self.alpha.astype(np.float32)
        truth = Truth(exact, alpha, self.starts, self.counts, weights)
        least, room = self.least.astype(np.float32), self.room.astype(np.float32)
        return Examples(self.features.astype(np.float32), truth, "absorbance", least, room)


def seen_by_slices(f: moit.Fragments, count: int) -> Seen:
    """Of `count` slices of 8 bits, one at each end of a pixel's range and the rest between."""
    near, far = np.log(f.depth_range)
    counts = f.counts.ravel()
    pixel = np.repeat(np.arange(len(counts)), counts)
    place = (np.log(f.depth.astype(float)) - near) / max(far - near, 1e-12)
    order = np.lexsort((place, pixel))
    place, alpha = place[order], f.alpha[order].astype(float)
    counts = counts[counts > 0]
    starts = np.cumsum(counts) - counts
    pixel = np.repeat(np.arange(len(counts)), counts)
    absorbed = -np.log1p(-np.minimum(alpha, 1 - 0.5 / 256))
    front = np.cumsum(absorbed) - absorbed

    first, last = np.minimum.reduceat(place, starts), np.maximum.reduceat(place, starts)
    x = (place - first[pixel]) / np.maximum(last - first, 1e-6)[pixel] * (count - 1)
    cell = np.minimum(x.astype(int), count - 2)
    inside = x - cell
    rounding = np.random.default_rng(0).random(len(x))  # fractions of steps count on the mean
    code = np.floor(np.minimum(absorbed, MOST) / STEP + rounding)
    at_front = np.rint(code * (1 - inside))
    slices = np.zeros((len(counts), count + 3))  # one before the first, two behind the last
    np.add.at(slices, (pixel, cell + 1), at_front * STEP)
    np.add.at(slices, (pixel, cell + 2), (code - at_front) * STEP)
    slices = np.minimum(slices, MOST)
    sums = np.cumsum(slices, axis=1)

    total = np.maximum(sums[:, -1], 1e-9)[pixel]
    before, here, next_, behind = (slices[pixel, cell + k] for k in range(4))
    own, least = code * STEP, sums[pixel, cell]
    room = np.maximum(here + next_ - own, 0)
    middle = least + here / 2 + inside * (here + next_) / 2
    middle = np.maximum(middle - (at_front * STEP + inside * own) / 2, 0)
    columns = (
        least / total,
        room / total,
        absorbed,
        inside,
        here / np.maximum(here + next_, 1e-6),
        before / total,
        behind / total,
        np.clip(np.log(total), -8, 8),
        np.clip((middle - least) / np.maximum(room, 1e-6), 0, 1),
        np.clip(np.log(np.maximum(room, 1e-4)), -8, 3),
    )
    exact = np.exp(-(front - np.repeat(front[starts], counts)))
    features, plain = np.stack(columns, axis=1), np.exp(-middle)
    return Seen(order, features, least, room, plain, exact, alpha, starts, counts)


def joined(parts: Sequence[Examples]) -> Examples:
    def all_of(name: str, of: Sequence[Any]) -> Array:
        return np.concatenate([getattr(one, name) for one in of])

    truths = [one.truth for one in parts]
    begins = np.cumsum([0, *(len(one.features) for one in parts)])
    starts = np.concatenate([t.starts + at for t, at in zip(truths, begins, strict=False)])
    weight = all_of("weight", truths)
    exact, alpha, counts = (all_of(name, truths) for name in ("exact", "alpha", "counts"))
    return Examples(
        all_of("features", parts),
        Truth(exact, alpha, starts, counts, weight / weight.mean()),
        "absorbance",
        all_of("from_", parts),
        all_of("width", parts),
    )


@dataclasses.dataclass(frozen=True)
class Learnt:
    """Slices, so many, and the network that reads them; network None: as they are."""

    count: int
    network: Perceptron | None
    mean: Array
    scale: Array

    def transmittance(self, seen: Seen) -> Array:
        if self.network is None:
            return seen.plain
        examples = seen.examples().standardised(self.mean, self.scale)
        return examples.transmittance(self.network.forward(examples.features)[-1][0])[0]

    def __call__(self, f: moit.Fragments) -> Array:
        found = np.empty(len(f))
        if len(f):
            seen = seen_by_slices(f, self.count)
            found[seen.order] = self.transmittance(seen)
        return found


def learnt(count: int) -> Learnt:
    parts = []
    for name in data.SETS:
        seen = seen_by_slices(data.drawn(name, FRAGMENTS, TRAINING_SEED), count)
        plain = seen.plain.astype(np.float32)
        # each set counts by how much slices err on it as they are
        error = LOSSES["picture"](plain, seen.examples().truth)[0]
        parts.append(seen.examples(1 / max(error, 1e-9)))
    examples = joined(parts)
    mean, scale = examples.features.mean(axis=0), examples.features.std(axis=0) + 1e-6
    examples = examples.standardised(mean, scale)
    best: State | None = None
    for seed in range(STARTS):
        state = State.start((examples.features.shape[1], 8, 8, 1), seed)
        fit(state, examples, None, Schedule(EPOCHS, BATCH, RATE, True, "picture", seed))
        if best is None or state.losses[-1][0] < best.losses[-1][0]:
            best = state
    assert best is not None
    return Learnt(count, best.network, mean, scale)


def on_rays(one: Learnt, draw: Draw) -> list[float]:
    """RMSE of colours on each set, as is to be expected of random colours."""
    found = []
    for letter in SETS:
        seen = seen_by_slices(draw.rays(letter, RAYS).at(), one.count)
        T = one.transmittance(seen).astype(np.float32)
        found.append(math.sqrt(LOSSES["color"](T, seen.examples().truth)[0]))
    return found


def on_scenes(techniques: Sequence[Any], draw: Draw) -> Array:
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
    parser.add_argument("counts", nargs="*", type=int, default=[8, 12, 16, 32])
    draw, techniques, names = draw_named("check", CHECK_SEED), [], []
    for count in parser.parse_args().counts:
        by_network = learnt(count)
        for one in (dataclasses.replace(by_network, network=None), by_network):
            word = "network" if one.network else "as they are"
            errors = on_rays(one, draw)
            print(f"{count} slices, {word}: rays {np.mean(errors):.4f}, sets", end=" ")
            print(*(f"{error:.4f}" for error in errors), flush=True)
            names.append(f"{count} slices, {word}")
            techniques.append(moit.PythonTechnique("slices", one, bits_per_pixel=8 * count + 32))
    others = [
        "neural-bounded6(depth_range='pixel',storage='half')",
        "strong2",
        "strong5",
        "anchors4",
    ]
    for name, error in zip([*names, *others], on_scenes([*techniques, *others], draw), strict=True):
        print(f"{name}: FLIP {error:.4f}")


if __name__ == "__main__":
    main()
