"""Promises asked of twenty thousand hostile pixels at once: python -m tests.fuzz --target pixels

Each case is one image of small pixels and one technique: all techniques of the suite in turn, then
as many with random options, and so on. Every question is asked: answers are finite and in range,
bounds hold the truth (products of 64 bits, in vectors), order of arrival moves nothing where it is
promised not to, and answers of floats are near those of doubles. Two threads, and some of the
pixels alone where a pixel's answer hangs on nothing else, give the same bits.
`python tests/hostile_pixels.py CASE [COUNT]` tries again.
"""

import sys
import warnings
from collections.abc import Callable, Iterator

import hostile
import numpy as np
from hostile import Array, Case, Rng
from variants import EVERY

import moit

PIXELS = 20_000  # a fiftieth where some are volumes or Gaussians
MOST = 17  # fragments of a pixel


# ---- What is tried -------------------------------------------------------------------------------


def _counts(rng: Rng, pixels: int) -> Array:
    kind = rng.integers(3)
    if kind == 0:
        return rng.integers(0, 5, pixels)
    if kind == 1:  # groups of lanes have equal counts
        return np.full(pixels, rng.choice([1, 2, 3, 4, 8, 9]))
    return np.minimum(rng.geometric(0.3, pixels) - 1, MOST)


def case_of(number: int, pixels: int = PIXELS) -> Case:
    rng = np.random.default_rng([22, number])
    turn, place = divmod(number, len(EVERY))
    own = hostile.MAKERS[rng.integers(len(hostile.MAKERS))](rng)
    dtype = rng.choice([np.float32, np.float64])
    counts = _counts(rng, pixels)
    # pixels of several kinds stand beside one another
    parts = [hostile.fragments_of(rng, dtype, counts) for _ in range(rng.choice([1, 1, 4]))]
    pick = rng.integers(0, len(parts), pixels)[np.repeat(np.arange(pixels), counts)]
    depth, alpha, color = (
        np.choose(pick if name != "color" else pick[:, None], [getattr(p, name) for p in parts])
        for name in ("depth", "alpha", "color")
    )
    first = parts[0]
    f = moit.Fragments(
        first.offsets,
        depth,
        alpha,
        color,
        transmission=first.transmission,
        depth_range=first.depth_range if len(parts) == 1 else None,
    )
    depths = hostile.depths_of_interest(rng, f)
    technique = EVERY[place] if turn % 2 == 0 else own
    f = hostile.with_more(f, rng)
    if f.back is not None or f.deviation is not None:  # a thousand times as long
        f = f[:, : pixels // 50]
    return Case(f, technique, depths, True)


# ---- The truth -----------------------------------------------------------------------------------


class _Rows:
    """Pixels as rows of equal length, sorted by depth; what is not there is far and clear."""

    def __init__(self, f: moit.Fragments) -> None:
        counts = f.counts
        pixel = np.repeat(np.arange(len(counts)), counts)
        order = np.lexsort((f.depth, pixel))  # stable: the earlier of one depth comes first
        shape = (len(counts), max(1, int(counts.max(initial=0))))
        inside = np.arange(shape[1]) < counts[:, None]
        self.depth = np.full(shape, np.inf)
        self.depth[inside] = f.depth[order]
        self.alpha = np.zeros(shape, np.longdouble)
        self.alpha[inside] = f.alpha[order]
        self.inside, self.order = inside, order
        through = np.cumprod(1 - self.alpha, axis=1)
        self.through = np.concatenate([np.ones((shape[0], 1), np.longdouble), through], axis=1)

    def at(self, depths: Array) -> Array:
        """What is strictly nearer lets through."""
        nearer = np.stack([(self.depth < depth).sum(1) for depth in depths], axis=1)
        return np.take_along_axis(self.through, nearer, axis=1)

    def at_fragments(self) -> Array:
        """The same at each fragment; the nearest opaque one is the background, behind what is at
        its depth, and hides the other opaque ones."""
        place = np.arange(self.depth.shape[1])
        begins = np.ones(self.depth.shape, bool)
        begins[:, 1:] = self.depth[:, 1:] != self.depth[:, :-1]
        tie = np.maximum.accumulate(np.where(begins, place, 0), axis=1)
        T = np.take_along_axis(self.through[:, :-1], tie, axis=1)
        opaque = self.alpha == 1
        some = np.flatnonzero(opaque.any(1))
        nearest = opaque[some].argmax(1)
        T[opaque] = 0
        depth = self.depth[some, nearest]
        seen = (self.depth[some] <= depth[:, None]) & (self.alpha[some] < 1)
        T[some, nearest] = np.where(seen, 1 - self.alpha[some], 1).prod(1)
        found = np.empty(len(self.order), np.longdouble)
        found[self.order] = T[self.inside]
        return found


def _outside(case: Case, name: str, lower: Array, upper: Array) -> Iterator[str]:
    """Where bounds leave the truth out by more than its own last digits."""
    f, t = case.fragments, case.technique
    if any(part is not None for part in (f.back, f.deviation, f.transmission)):
        return
    if isinstance(t, moit.Sorted | moit.PerPixel):  # of equal depths the earlier is in front
        return
    rows = _Rows(f)
    T = rows.at(case.depths) if name == "curve bounds" else rows.at_fragments()
    low, high = (side.reshape(T.shape).astype(np.longdouble) for side in (lower, upper))
    doubt = T * (2 * MOST + 2) * np.finfo(np.longdouble).eps
    wrong = np.argwhere(~((low <= T + doubt) & (T - doubt <= high)))
    if len(wrong):
        at = tuple(wrong[0])
        told = f"{float(T[at])!r} not in [{float(low[at])!r}, {float(high[at])!r}]"
        yield f"{name}{[int(i) for i in at]}: {told}, and {len(wrong) - 1} more"


# ---- What must hold ------------------------------------------------------------------------------


Ask = Callable[[moit.Fragments, int], Array]


def _asked(case: Case) -> dict[str, Ask]:
    t = case.technique
    return {
        "composite": lambda f, threads: moit.composite(
            f, t, background=(0.5, 0, 1), cull_opaque=True, threads=threads
        ),
        "transmittance": lambda f, threads: moit.transmittance(f, t, threads=threads),
        "total": lambda f, threads: moit.total_transmittance(f, t, threads=threads),
        "lower bounds": lambda f, threads: moit.bounds(f, t, threads=threads)[0],
        "upper bounds": lambda f, threads: moit.bounds(f, t, threads=threads)[1],
    }


def _same(one: Array, other: Array) -> bool:
    return one.shape == other.shape and one.tobytes() == other.tobytes()


def _moved(case: Case, answered: dict[str, Array]) -> Iterator[str]:
    """Where threads or neighbours show."""
    f = case.fragments
    ask = _asked(case)
    for name, found in answered.items():
        if not _same(found, ask[name](f, 2)):
            yield f"{name}: two threads differ from one"
    if not case.technique.local:
        return
    count = len(f.counts)
    few = count // 3, min(count // 3 + 7, count)
    for first, last in (few, (count - 1, count), (1, max(1, count // 2))):
        alone = f[:, first:last]
        for name, found in answered.items():
            begin, end = f.offsets[first], f.offsets[last]
            those = found[:, first:last] if name in ("composite", "total") else found[begin:end]
            if not _same(np.ascontiguousarray(those), ask[name](alone, 1)):
                yield f"{name}: pixels {first} to {last - 1} differ alone"


def _far_from_doubles(case: Case, found: Array) -> Iterator[str]:
    """Where a picture in single precision is another one in more than a hundredth of the pixels, as
    codes may be the next ones. Not where moments or networks lose digits, bytes are rounded after
    every fragment, or random numbers hang on bits of pieces."""
    f, t = case.fragments, case.technique
    holds = getattr(t, "inside", None) or getattr(t, "tail", None)
    loses = t.stores_moments or t.has_network or holds
    if f.depth.dtype != np.float32 or len(f.counts) < 1_000 or loses or hostile.rounds_each(t):
        return
    if t.random and (f.back is not None or f.deviation is not None):
        return
    names = ("depth", "alpha", "color", "transmission", "back", "emission", "deviation")
    arrays = {name: getattr(f, name) for name in names}
    wide = {name: None if a is None else a.astype(float) for name, a in arrays.items()}
    g = moit.Fragments(f.offsets, **wide, shape=f.shape, depth_range=f.depth_range)
    double = _asked(case)["composite"](g, 1).reshape(-1, 4)
    light = max(1.0, float(np.abs(double).max()))
    apart = np.abs(found.reshape(-1, 4) - double).max(1) / light
    if (far := float(np.quantile(apart, 0.99))) > 1e-3:
        yield f"composite: a hundredth of the pixels is {far:.2g} or more from those in double"


def broken(case: Case) -> Iterator[str]:
    """The promises that this case breaks, in words."""
    answered: dict[str, Array] = {}
    for name, results in hostile.answers(case):
        if name in ("composite", "transmittance", "total"):
            answered[name] = results[0]
        if name == "bounds":
            answered["lower bounds"], answered["upper bounds"] = results
        low, high = hostile.range_of(name, case.technique)
        for result in results:
            if not np.isfinite(result).all():
                yield f"{name}: not finite"
            if name in ("composite", "moments") or not result.size:
                continue
            if not (low <= result.min() and result.max() <= high):
                yield f"{name}: {result.min()!r} to {result.max()!r} is not in [{low}, {high}]"
        if name.endswith("bounds"):
            yield from _outside(case, name, *results)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        yield from _moved(case, answered)
        if "composite" in answered:
            yield from _far_from_doubles(case, answered["composite"])
            yield from hostile.moved_by_order(case, seed=1)


def tried(number: int, pixels: int = PIXELS) -> list[str]:
    """What one case breaks."""
    case = case_of(number, pixels)
    return [f"{case.technique}: {what}" for what in broken(case)]


if __name__ == "__main__":
    first, count = (*map(int, sys.argv[1:]), 1)[:2]
    for number in range(first, first + count):
        print(number, *tried(number), sep="\n  ", flush=True)
