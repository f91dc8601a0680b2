"""What a network makes of slices: `python docs/slice_network.py` prints the numbers of
docs/frontier.md, "A network that reads slices". Some two minutes.

Slices stand at equal steps of a pixel's own range of depth, whose ends are words of 16 bits of the
image's range, rounded outwards. What is in slices before that at a fragment's front is in front of
it for sure; of what the two slices around it have besides, some may be. `moit.Slices` counts as
much as a medium would that is even between slices; here a network of two layers of eight says how
much, as bounded networks do of moments. One network reads slices of all counts and bits. It is
trained on rays of moit.neural.data, and judged on a draw of the kind "check", rays and scenes.
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
from moit.catalog.slices import codes_of
from moit.judging.draws import SCENES, SETS, Draw, draw_named
from moit.metrics import flip
from moit.neural import data
from moit.neural.backpropagation import Perceptron
from moit.neural.examples import Examples
from moit.neural.fitting import Schedule, State, fit
from moit.neural.losses import LOSSES, Truth

Array = NDArray[Any]

WORDS = 65535  # steps of the image's range that a pixel's own begins and ends at
# How many slices, of so many bits: what a network learns of, and what is judged.
LEARNT = ((4, 8), (5, 6), (6, 5), (6, 6), (7, 4), (8, 8), (12, 8), (16, 8), (32, 8))
JUDGED = ("4x8", "5x6", "6x5", "8x8", "12x8", "16x8", "32x8")
FRAGMENTS, EPOCHS, BATCH, RATE, STARTS = 10_000, 60, 2048, 2e-2, 1
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


def seen_by_slices(f: moit.Fragments, count: int, bits: int) -> Seen:
    """Of `count` slices of so many bits, one at each end of a pixel's range, the rest between."""
    largest, most = codes_of(bits)
    step = most / largest
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
    first = np.floor(first * WORDS) / WORDS
    last = np.maximum(np.ceil(last * WORDS) / WORDS, first + 1 / WORDS)
    x = (place - first[pixel]) / (last - first)[pixel] * (count - 1)
    cell = np.minimum(x.astype(int), count - 2)
    inside = x - cell
    rounding = np.random.default_rng(0).random(len(x))  # fractions of steps count on the mean
    code = np.floor(np.minimum(absorbed, most) / step + rounding)
    at_front = np.rint(code * (1 - inside))
    slices = np.zeros((len(counts), count + 3))  # one before the first, two behind the last
    np.add.at(slices, (pixel, cell + 1), at_front * step)
    np.add.at(slices, (pixel, cell + 2), (code - at_front) * step)
    slices = np.minimum(slices, most)
    sums = np.cumsum(slices, axis=1)

    total = np.maximum(sums[:, -1], 1e-9)[pixel]
    before, here, next_, behind = (slices[pixel, cell + k] for k in range(4))
    own, least = code * step, sums[pixel, cell]
    room = np.maximum(here + next_ - own, 0)
    middle = least + here / 2 + inside * (here + next_) / 2
    middle = np.maximum(middle - (at_front * step + inside * own) / 2, 0)
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
    bits: int
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
            seen = seen_by_slices(f, self.count, self.bits)
            found[seen.order] = self.transmittance(seen)
        return found


def learnt() -> Learnt:
    """The network, of no slices yet."""
    parts = []
    for name in data.SETS:
        drawn = data.drawn(name, FRAGMENTS, TRAINING_SEED)
        for count, bits in LEARNT:
            seen = seen_by_slices(drawn, count, bits)
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
    return Learnt(0, 0, best.network, mean, scale)


def on_rays(one: Learnt, draw: Draw) -> list[float]:
    """RMSE of colours on each set, as is to be expected of random colours."""
    found = []
    for letter in SETS:
        seen = seen_by_slices(draw.rays(letter, RAYS).at(), one.count, one.bits)
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
    parser.add_argument("slices", nargs="*", default=JUDGED, help="COUNTxBITS")
    given, by_network = parser.parse_args().slices, learnt()
    draw, techniques, names = draw_named("check", CHECK_SEED), [], []
    for name in given:
        count, bits = map(int, name.split("x"))
        for network in (None, by_network.network):
            one = dataclasses.replace(by_network, count=count, bits=bits, network=network)
            word = "network" if network else "as they are"
            errors = on_rays(one, draw)
            print(f"{name} slices, {word}: rays {np.mean(errors):.4f}, sets", end=" ")
            print(*(f"{error:.4f}" for error in errors), flush=True)
            names.append(f"{name} slices, {word}")
            kept = bits * count + 32
            techniques.append(moit.PythonTechnique("slices", one, bits_per_pixel=kept))
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
