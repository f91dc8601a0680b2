"""MB3DGS: its rule for moments, and colours in intervals along thick fragments."""

import dataclasses
import math
from statistics import NormalDist

import numpy as np
import pytest

import moit
from moit.core.pieces import thinned

RANGE = (0.5, 8.0)


def pixel(depth, alpha, deviation=None, seed=0, **arrays):
    return moit.Fragments(
        [0, len(depth)],
        np.array(depth, float),
        np.array(alpha, float),
        np.random.default_rng(seed).random((len(depth), 3)),
        deviation=None if deviation is None else np.array(deviation, float),
        **({"depth_range": RANGE} | arrays),
    )


def warped(t, near):
    """The paper's g, from 0 at the near end to 1 at infinity."""
    power = -1.5

    def f(x):
        a = abs(power - 1)
        return a / power * ((2 * x / a + 1) ** power - 1)

    return (f(t) - f(near)) / (5 / 3 - f(near))


@pytest.mark.parametrize(("mean", "deviation"), [(1.3, 0.5), (0.4, 0.3)])
def test_the_rules_moments_are_those_of_the_cut_gaussian(mean, deviation):
    """Where the paper's, with its warp taken to be linear in a Gaussian, are off by up to 930 %."""
    near = 0.2
    f = pixel([mean], [0.5], [deviation], depth_range=(near, 20.0))
    t = np.linspace(near, mean + 9 * deviation, 200_001)
    density = np.exp(-0.5 * ((t - mean) / deviation) ** 2)
    density /= density.sum()
    for name, kept in (("power4", 4), ("power8", 8), ("trig4", 4)):
        points, _ = thinned(f, moit.technique(name), 1)
        share = np.log1p(-points.alpha) / math.log(0.5)
        for k in range(1, kept + 1):
            exact, rule = (
                weight @ (np.exp(1j * k * 5.97 * g) if name == "trig4" else g**k)
                for g, weight in ((warped(t, near), density), (warped(points.depth, near), share))
            )
            assert abs(rule - exact) < 0.005 * abs(exact)


def plain_weights(f, technique, count):
    """What fragments count with, number by number."""
    found = []
    for i in range(len(f)):
        absorbed, mean = -math.log1p(-f.alpha[i]), f.depth[i]
        deviation = f.deviation[i]
        if deviation == 0:
            found.append(f.alpha[i] * at(f, technique, mean))
            continue
        quantiles = [NormalDist().inv_cdf(j / (count + 2)) for j in range(1, count + 2)]
        ends = [min(max(mean + 3 * deviation * x, RANGE[0]), RANGE[1]) for x in quantiles]
        through = [at(f, technique, t) for t in ends]
        density = [math.exp(-0.5 * ((t - mean) / deviation) ** 2) for t in ends[:-1]]
        whole = sum(d * (b - a) for d, a, b in zip(density, ends, ends[1:], strict=False))
        sum_ = 0.0
        for j in range(count):
            length = ends[j + 1] - ends[j]
            tau = math.log(through[j]) - math.log(through[j + 1])
            if length and tau:
                own = absorbed * density[j] / whole
                sum_ += (through[j] - through[j + 1]) * own / (tau / length)
            else:
                sum_ += through[j] * absorbed * density[j] * length / whole
        found.append(sum_)
    return np.array(found)


def at(f, technique, depth):
    return float(moit.transmittance(f, technique, [depth])[0, 0, 0])


@pytest.mark.parametrize("technique", ["power4", "trig4", "power6(normalize=False)"])
def test_colours_are_what_the_paper_says(technique):
    technique = moit.technique(technique)
    f = pixel([2, 2.2, 0.6, 3.0], [0.6, 0.9, 0.5, 0.3], [0.3, 0.5, 0.4, 0])
    weight = plain_weights(f, technique, 5)
    expected = weight @ f.color
    covered = 1 - np.prod(1 - f.alpha)
    if technique.normalize:
        expected *= covered / weight.sum()
    image = moit.composite(f, dataclasses.replace(technique, intervals=5))[0, 0]
    np.testing.assert_allclose(image, [*expected, covered], atol=1e-9)


@pytest.mark.parametrize("technique", ["power4", "trig4-16"])
def test_one_alone_has_its_alpha(technique):
    technique = dataclasses.replace(moit.technique(technique), intervals=5)
    for f in (
        pixel([2], [0.6], [0.4]),
        pixel([2], [0.6], back=[4.0]),
        pixel([0.5], [0.6], [3.0]),  # of which half is cut
    ):
        image = moit.composite(f, technique, background=(0, 0, 1))[0, 0]
        exact = moit.composite(f, "sorted", background=(0, 0, 1))[0, 0]
        np.testing.assert_allclose(image, exact, atol=1e-9)


def test_channels_emission_and_opaque_surfaces_count_as_in_any_picture():
    """Of Gaussians so thin that all of each is at one depth: they count by absorbance there."""
    rng = np.random.default_rng(2)
    counts = rng.integers(0, 6, 60)
    n = counts.sum()
    alpha = rng.uniform(0, 0.9, n)
    alpha[rng.random(n) < 0.1] = 1
    arrays = {
        "transmission": rng.random((n, 3)) * (alpha < 1)[:, None],
        "emission": rng.random((n, 3)) * (alpha == 1)[:, None],
    }
    given = (np.append(0, counts.cumsum()), rng.uniform(1, 7, n), alpha, rng.random((n, 3)))
    how = {"depth_range": RANGE, "shape": (6, 10)}
    thin = moit.Fragments(*given, **arrays, **how)
    thick = moit.Fragments(*given, **arrays, **how, deviation=np.full(n, 1e-13))
    through = moit.transmittance(thick, "power4(bias=0.01)")
    background = rng.random((60, 3))
    image = moit.composite(
        thick, "power4(bias=0.01,intervals=4)", background=background.reshape(6, 10, 3)
    ).reshape(60, 4)
    for p, (begin, end) in enumerate(zip(thin.offsets, thin.offsets[1:], strict=False)):
        own = np.arange(begin, end)
        own = own[np.argsort(thin.depth[own])]
        behind, passed = background[p], 1.0
        solid = np.flatnonzero(alpha[own] == 1)
        if len(solid):
            last = own[solid[0]]
            behind, passed = thin.color[last] + thin.emission[last], 0.0
            own = own[: solid[0]]
        opacity = alpha[own, None] * (1 - thin.transmission[own])
        net = opacity.mean(axis=1)
        weight = -np.log1p(-net) * through[own]
        light = thin.color[own] * np.divide(alpha[own], net, out=0 * net, where=net > 0)[:, None]
        covered = 1 - np.prod(1 - net)
        scale = covered / weight.sum() if weight.sum() > 0 else 0
        seen = np.prod(1 - opacity, axis=0)
        color = weight @ light * scale + seen * behind
        # a curve that rises steeply at a fragment's depth is asked a little beside it
        np.testing.assert_allclose(image[p], [*color, 1 - passed * seen.mean()], atol=1e-3)


def test_surfaces_are_what_they_are_without_intervals():
    f = pixel([2, 2.2], [0.6, 0.9], [0, 0])
    image = moit.composite(f, "power4(intervals=5)")
    assert np.array_equal(image, moit.composite(pixel([2, 2.2], [0.6, 0.9]), "power4"))


def test_intervals_are_whole_numbers():
    with pytest.raises(ValueError, match="intervals: expected an integer from 0 to 64, got 65"):
        moit.PowerMoments(4, intervals=65)
