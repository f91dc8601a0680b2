"""Techniques in Python that several tests ask."""

import dataclasses

import numpy as np
import pytest
from small import some_fragments

import moit

PythonTechnique = moit.PythonTechnique


def exact(f):
    """`sorted`, a pixel at a time."""
    T = np.ones(len(f))
    for begin, end in zip(f.offsets[:-1], f.offsets[1:], strict=True):
        order = begin + np.argsort(f.depth[begin:end], kind="stable")
        through = np.cumprod(1 - f.alpha[order].astype(float))
        T[order[1:]] = through[:-1]
    return T


def exact_curve(f, depths):
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    curves = np.ones((len(f.counts), len(depths)))
    for k, depth in enumerate(depths):
        here = f.depth < depth
        np.multiply.at(curves[:, k], pixel[here], 1 - f.alpha[here].astype(float))
    return curves


def twice_exact(f):
    return np.minimum(2 * exact(f), 1)


def halves(f):
    return np.full(len(f), 0.5)


EXACT = PythonTechnique("exact", exact, curve=exact_curve)


@dataclasses.dataclass(frozen=True)
class Fog(PythonTechnique):
    """Absorbance spread evenly over the depth range, by two numbers a pixel."""

    density: float = 1.0
    steps: int = 2
    bits_per_pixel = 64

    def gather(self, f):
        a = -np.log1p(-np.minimum(f.alpha, 0.999))
        return moit.storage.added(f, np.stack([a, a * f.depth], axis=1))

    def read(self, state, depth, alpha):
        b0, b1 = state.T
        middle = np.divide(b1, b0, out=np.ones_like(b0), where=b0 > 0)
        return np.exp(-self.density * b0 * np.clip(depth / (2 * middle), 0, 1) ** self.steps)


def pictures():
    """Fragments of every sort that techniques meet."""
    rng = np.random.default_rng(3)
    f = some_fragments(height=7, width=9, most=6, dtype=np.float64)
    n = len(f)
    alpha = np.where(rng.random(n) < 0.1, 1.0, f.alpha)
    facts = {"shape": f.shape}
    three = rng.random((n, 3))
    grey = np.repeat(rng.random((n, 1)), 3, axis=1)
    back = f.depth + np.where(rng.random(n) < 0.5, rng.random(n), 0)
    clear = np.where(rng.random(n) < 0.2, 0.0, alpha)
    given = {
        "surfaces": moit.Fragments(f.offsets, f.depth, f.alpha, f.color, **facts),
        "single": some_fragments(height=7, width=9, most=6),
        "opaque": moit.Fragments(f.offsets, f.depth, alpha, f.color, **facts),
        "clear": moit.Fragments(f.offsets, f.depth, clear, f.color, **facts),
        "coloured": moit.Fragments(f.offsets, f.depth, alpha, f.color, transmission=three, **facts),
        "grey": moit.Fragments(f.offsets, f.depth, f.alpha, f.color, transmission=grey, **facts),
        "volumes": moit.Fragments(f.offsets, f.depth, f.alpha, f.color, back=back, **facts),
        "emission": moit.Fragments(f.offsets, f.depth, alpha, f.color, emission=three, **facts),
        "one": moit.Fragments([0, 1], [2.0], [0.5], [[1, 2, 3]]),
        "empty": moit.Fragments([0, 0, 0], [], [], np.zeros((0, 3))),
        "no pixels": moit.Fragments([0], [], [], np.zeros((0, 3)), shape=(0, 4)),
        "a window": some_fragments(height=9, width=8)[2:5, 3:7],
    }
    return given


PICTURES = pictures()
every_picture = pytest.mark.parametrize("name", PICTURES)


def close(one, other, dtype):
    assert one.dtype == other.dtype == dtype
    assert one.shape == other.shape
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 if dtype == np.float64 else 3e-7)


def check(one, **options):
    return moit.check_technique(one, progress=False, rays=4, **options)
