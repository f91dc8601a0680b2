"""What certificates of a choice for each pixel prove."""

import dataclasses
from itertools import combinations

import numpy as np
import pytest
from test_per_pixel import counts_of, hard, off, tinted

import moit
from moit import PerPixel, _core
from moit.per_pixel.certificates import ColorsBetween, prover
from moit.per_pixel.plan import SORTED_BITS
from moit.per_pixel.selection import Selection


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("seed", range(4))
def test_certified_images_are_never_off_by_more(seed, dtype):
    f = hard(seed, dtype)
    for g in (f, tinted(f, seed), f.shuffled(seed)):
        for max_error in (1e-3, 0.02, 0.3):
            technique = PerPixel(max_error, certify=True)
            for behind in ((0, 0, 0), (0.5, 0.1, 4)):
                image = moit.composite(g, technique, background=behind)
                assert off(image, g, background=behind).max() <= max_error
            image = moit.composite(g, technique, cull_opaque=False)
            assert off(image, g, cull_opaque=False).max() <= max_error


@pytest.mark.parametrize("seed", range(3))
def test_the_exact_colour_lies_between_its_bounds(seed):
    f = hard(seed, "float64")
    background = np.random.default_rng(seed).uniform(-1, 2, (400, 3))
    exact = moit.composite(f, "sorted", background=background.reshape(20, 20, 3)).reshape(-1, 4)
    for name in ("power4", "power8", "sorted"):
        lower, upper = moit.bounds(f, name)
        low, high = _core.color_bounds(f, True, 1, background, lower, upper)
        assert (low <= exact).all() and (exact <= high).all()
    assert (high - low).max() < 1e-9  # what sorted proves leaves nothing open


def extremes(opacity, emitted, lower, upper):
    """The least and greatest sum of emitted T, for T in [lower, upper] with a known sum of
    opacity T: at a corner of what is possible all T but one are at their ends."""
    covered = 1 - np.prod(1 - opacity)
    found = []
    n = len(opacity)
    for free in range(n):
        others = [i for i in range(n) if i != free]
        for size in range(n):
            for above in combinations(others, size):
                T = lower.copy()
                T[list(above)] = upper[list(above)]
                T[free] = 0
                T[free] = (covered - opacity @ T) / opacity[free]
                if lower[free] - 1e-12 <= T[free] <= upper[free] + 1e-12:
                    found.append(emitted @ T)
    return min(found), max(found)


def test_colour_bounds_are_the_sharpest_that_bounds_and_the_sum_of_weights_allow():
    rng = np.random.default_rng(5)
    for n in (1, 2, 3, 5):
        depth, alpha = rng.uniform(1, 9, n), rng.uniform(0.1, 0.9, n)
        color = rng.uniform(-1, 2, (n, 3))
        f = moit.Fragments([0, n], depth, alpha, color)
        T = moit.transmittance(f, "sorted")
        lower, upper = T * rng.uniform(0.5, 1, n), np.minimum(1, T * rng.uniform(1, 1.5, n))
        low, high = _core.color_bounds(f, True, 1, np.zeros((1, 3)), lower, upper)
        for c in range(3):
            least, most = extremes(alpha, alpha * color[:, c], lower, upper)
            np.testing.assert_allclose([low[0, c], high[0, c]], [least, most], atol=1e-12)


def test_the_prover_leaves_less_open_than_fewer_moments_or_a_wider_range():
    f = moit.scenes.load("mixed", size=(48, 27), seed=1)
    proves = prover(f)

    def width(technique):
        lower, upper = moit.bounds(f, technique)
        return (upper - lower).mean()

    for less in (
        dataclasses.replace(proves, count=6),
        dataclasses.replace(proves, count=4),
        dataclasses.replace(proves, depth_range="image"),
    ):
        assert width(proves) < 0.95 * width(less)
    assert (proves.warp, prover(hard(6)).warp) == ("log", "log")
    assert prover(moit.Fragments([0, 1], [-1.0], [0.5])).warp == "linear"


@pytest.mark.parametrize("max_error", [0.02, 0.1])
def test_the_cheapest_technique_that_is_proved_is_taken(max_error):
    f = hard(11)
    choice = moit.choose(f, PerPixel(max_error, certify=True))
    pixels, counts = np.arange(400), counts_of(f)
    off_at_most = ColorsBetween(Selection(f, True, 1), pixels, f, 1.0)
    cost = np.empty((len(choice.techniques), 400))
    for one, row in zip(choice.techniques[:-1], cost, strict=False):
        sure = (counts <= one.exact_up_to) | (off_at_most(one, pixels) <= max_error)
        row[:] = np.where(sure, one.bits_per_pixel, np.inf)
    cost[-1] = SORTED_BITS * counts
    chosen, filled = choice.map.ravel(), counts > 0
    assert (cost[chosen[filled], pixels[filled]] == cost[:, filled].min(axis=0)).all()
    assert len(np.unique(chosen)) > 4


def test_without_colour_a_certificate_is_of_transmittance():
    f = hard(9)
    bare = moit.Fragments(f.offsets, f.depth, f.alpha, shape=f.shape)
    held = moit.transmittance(bare, PerPixel(0.05, certify=True))
    exact = moit.transmittance(bare, "sorted", dtype=np.float64)
    pixel = np.repeat(np.arange(400), f.counts)
    assert np.bincount(pixel, f.alpha * np.abs(held - exact), minlength=400).max() <= 0.05
    assert (held != moit.transmittance(bare, "sorted")).any()
