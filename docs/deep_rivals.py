"""Simplified deep images against other ways to keep less, and holdouts at random depths.

    python docs/deep_rivals.py

prints a table of files of equal size: as moit.deep.simplify makes them, the nearest k samples with
all others as one, and a corridor of transmittance alone, walked greedily, as deep shadow maps have
it (Lokovic and Veach 2000), here as steps. Then it holds 100 images out at 10,000 random depths
each and compares light and transmittance in float64. All images are of surfaces.
"""

import os
import tempfile

import numpy as np

import moit
from moit.deep.opened import opened
from moit.formats.deep_output import deep_output
from moit.formats.deep_rows import DeepRows, offsets_of

ERROR = 1 / 255
SCENES = ("hair", "smoke", "mixed", "cloud")
SIZE = (160, 90)
NAMES = ("A", "B", "G", "R")


class Rays:
    """The samples of a file of surfaces in order, and what is seen in front of any depth."""

    def __init__(self, path):
        with opened(path) as seen:
            rows = seen.take(seen.origin[0], seen.origin[0] + seen.shape[0])
            self.place, self.types = seen.place(), seen.types
        self.pixel = np.repeat(np.arange(len(rows.offsets) - 1), np.diff(rows.offsets))
        order = np.lexsort((rows.channels["Z"], self.pixel))
        self.offsets, self.shape, self.origin = rows.offsets, rows.shape, rows.origin
        self.z, self.a, *light = (
            rows.channels[name][order].astype(np.float64) for name in ("Z", *NAMES)
        )
        self.light = np.stack(light)
        self.states = self._states()

    def _states(self):
        """(4, N + P): transmittance and light in front of each pixel's first sample and behind each
        of its samples."""
        counts = np.diff(self.offsets)
        begins = self.offsets[:-1] + np.arange(len(counts))
        states = np.zeros((4, len(self.z) + len(counts)))
        states[0, begins] = 1
        for layer in range(counts.max(initial=0)):
            some = counts > layer
            sample, at = self.offsets[:-1][some] + layer, begins[some] + layer
            states[0, at + 1] = states[0, at] * (1 - self.a[sample])
            states[1:, at + 1] = states[1:, at] + states[0, at] * self.light[:, sample]
        return states

    def seen(self, pixel, z):
        """(4, K) in front of depths z of pixels; nothing lies at these depths."""
        near, far = self.z.min() - 1, self.z.max() + 1
        share = (np.clip(z, near, far) - near) / (far - near) * 0.999
        keys = self.pixel + (self.z - near) / (far - near) * 0.999
        return self.states[:, np.searchsorted(keys, pixel + share) + pixel]


def errors(true, less, pixel, z):
    """The differences of transmittance, and of light by each pixel's scale."""
    last = true.states[1:, true.offsets[1:] + np.arange(len(true.offsets) - 1)]
    scale = np.maximum(1, last.max(axis=0))[pixel]
    off = np.abs(true.seen(pixel, z) - less.seen(pixel, z))
    return off[0], off[1:].max(axis=0) / scale


def between_depths(true):
    """A depth behind each sample and in front of the next, and its pixel."""
    gap = np.append(np.diff(true.z), 1)
    return true.pixel, true.z + np.where(gap > 0, 0.5 * gap, 1e-6)


def write(path, rays, parts):
    """A file of one sample for each (pixel, first, last): what lies there, where it begins."""
    pixel, first, last = (np.array(one) for one in zip(*parts, strict=True))
    begin, end = rays.states[:, first + pixel], rays.states[:, last + pixel]
    through = np.maximum(begin[0], 1e-30)
    flat = {"Z": rays.z[first], "A": 1 - end[0] / through}
    flat |= dict(zip(NAMES[1:], (end[1:] - begin[1:]) / through, strict=True))
    offsets = offsets_of(np.bincount(pixel, minlength=len(rays.offsets) - 1))
    channels = {name: flat[name].astype(kind) for name, kind in rays.types.items()}
    with deep_output(path, rays.place, rays.types, None) as out:
        out.put(DeepRows(rays.shape, rays.origin, offsets, channels))


def layers(rays, k):
    for p, (i, j) in enumerate(zip(rays.offsets, rays.offsets[1:], strict=False)):
        ends = [*range(i, min(i + k - 1, j)), min(i + k - 1, j)]
        yield from ((p, a, a + 1) for a in ends[:-1])
        if ends[-1] < j:
            yield p, ends[-1], j


def corridor(rays, error):
    for p, (i, j) in enumerate(zip(rays.offsets, rays.offsets[1:], strict=False)):
        first = i
        for n in range(i, j):
            through = rays.states[0, first + p + 1] - rays.states[0, n + p + 1]
            if n > first and through > 2 * error:
                yield p, first, n
                first = n
        if first < j:
            yield p, first, j


def of_equal_size(folder, rays, make, choices, size):
    """The file of the first of the choices, which get smaller, that is no larger."""
    path = os.path.join(folder, "rival.exr")
    for choice in choices:
        write(path, rays, make(rays, choice))
        if os.path.getsize(path) <= size:
            break
    return path, choice


def told(name, scene, size, off):
    worst = [f"{one.max():.4f} | {np.quantile(one, 0.99):.4f}" for one in off]
    print(f"| {scene} | {name} | {size / 1e3:,.0f} | {' | '.join(worst)} |", flush=True)


def table(folder):
    print("| scene | kept | kB | T, most | T, 99 % | C, most | C, 99 % |")
    print("|---|---|---|---|---|---|---|")
    for scene in SCENES:
        source, less = (os.path.join(folder, name) for name in ("a.exr", "b.exr"))
        moit.write_deep(source, moit.scenes.load(scene, SIZE).tidy(), half=True)
        moit.deep.simplify(source, less)
        size, rays = os.path.getsize(less), Rays(source)
        asked = between_depths(rays)
        told("simplify, 1/255", scene, size, errors(rays, Rays(less), *asked))
        ways = {
            "nearest {} and the rest": (layers, range(24, 0, -1)),
            "corridor of T, {:.4f}": (corridor, ERROR * 2.0 ** np.arange(-1, 7, 0.5)),
        }
        for name, (make, choices) in ways.items():
            path, choice = of_equal_size(folder, rays, make, choices, size)
            off = errors(rays, Rays(path), *asked)
            told(name.format(choice), scene, os.path.getsize(path), off)


def random_holdouts(folder, images=100, depths=10_000):
    worst = np.zeros(2)
    for seed in range(images):
        rng = np.random.default_rng(seed)
        counts = rng.integers(0, 40, 24 * 24)
        n = int(counts.sum())
        alpha = rng.uniform(0, 10 ** rng.uniform(-2, 0), n)
        alpha[rng.random(n) < 0.02] = 1
        f = moit.Fragments(
            np.append(0, np.cumsum(counts)),
            rng.uniform(1, 9, n).astype("f4"),
            alpha.astype("f4"),
            (10 ** rng.uniform(-1, 1) * rng.random((n, 3))).astype("f4"),
            shape=(24, 24),
        )
        source, less = (os.path.join(folder, name) for name in ("a.exr", "b.exr"))
        moit.write_deep(source, f, half=bool(seed % 2))
        moit.deep.simplify(source, less, ERROR)
        pixel, z = rng.integers(0, 24 * 24, depths), rng.uniform(0, 10, depths)
        off = errors(Rays(source), Rays(less), pixel, z)
        worst = np.maximum(worst, [one.max() for one in off])
    print(
        f"\n{images * depths:,} holdouts at random depths of {images} images: transmittance is off "
        f"by {worst[0]:.6f} at most, light by {worst[1]:.6f}; the certificate says {ERROR:.6f}"
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        table(place)
        random_holdouts(place)
