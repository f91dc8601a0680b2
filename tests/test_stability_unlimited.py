"""What the stability lab calls the truth: pivots, biases and answers of unlimited precision."""

import dataclasses

import numpy as np
import pytest
from mpmath import mp, mpc, mpf
from oracle import power, rays, trigonometric
from oracle.hard_rays import flat, hard_rays
from test_stability import ALL_MOMENTS, POWER, TRIGONOMETRIC

import moit
from moit import moments
from moit.numerics.bias import BiasAdvice
from moit.numerics.hard_cases import FAMILIES
from moit.numerics.unlimited import unlimited_transmittance


@pytest.fixture(scope="module")
def hard() -> moit.Fragments:
    """With an empty ray."""
    offsets, depth, alpha = flat(hard_rays(seed=3, of_each_kind=6))
    return moit.Fragments(np.append(offsets, offsets[-1]), depth, alpha, depth_range=(-1, 1))


def lowest_pivot(matrix) -> mpf:
    """Of L D L^H, up to the first that is not positive; written from the definition."""
    n = len(matrix)
    lower = [[mpc(0)] * n for _ in range(n)]
    d, lowest = [], mp.inf
    for i in range(n):
        for j in range(i):
            known = mp.fsum(lower[i][k] * d[k] * mp.conj(lower[j][k]) for k in range(j))
            lower[i][j] = (matrix[i][j] - known) / d[j]
        d.append(mp.re(matrix[i][i]) - mp.fsum(abs(lower[i][k]) ** 2 * d[k] for k in range(i)))
        lowest = min(lowest, d[i])
        if d[i] <= 0:
            break
    return lowest


def hankel(b) -> list:
    b = [mpf(1), *map(mpf, b)]
    n = len(b) // 2 + 1
    return [[b[i + j] for j in range(n)] for i in range(n)]


def toeplitz(b) -> list:
    b = [mpc(1), *(mpc(complex(one)) for one in b)]
    n = len(b)
    return [[b[i - j] if i >= j else mp.conj(b[j - i]) for j in range(n)] for i in range(n)]


@pytest.mark.parametrize("name", POWER)
@pytest.mark.parametrize("bias", [0.0, 1e-6])
def test_pivots_of_power_moments_are_those_of_80_digits(hard, name, bias):
    t = dataclasses.replace(moit.technique(name), warp="none", bias=bias)
    b0, b = moments.gather(hard, t)
    found = moments.least_pivot(t, b0, b)
    with mp.workdps(80):
        safe = power.BIAS_VECTOR[t.count]
        mixed = [
            [
                (1 - mpf(bias)) * mpf(float(x)) + mpf(bias) * mpf(s)
                for x, s in zip(row, safe, strict=True)
            ]
            for row in b
        ]
        truth = np.array([float(lowest_pivot(hankel(row))) for row in mixed])
    truth[-1] = 1.0  # nothing is there
    # Twice the digits of float64, of which a pivot of 1e-8 costs eight, twice.
    np.testing.assert_allclose(found, truth, rtol=1e-6, atol=1e-20)
    assert bias or (found <= 0).any()


@pytest.mark.parametrize("name", TRIGONOMETRIC)
def test_pivots_of_trigonometric_moments_are_those_of_80_digits(hard, name):
    t = dataclasses.replace(moit.technique(name), warp="none", bias=0.0)
    b0, b = moments.gather(hard, t)
    found = moments.least_pivot(t, b0, b)[:-1]
    with mp.workdps(80):
        truth = np.array([float(lowest_pivot(toeplitz(row))) for row in b[:-1]])
    # float64 beside pivots that shrink by 1e-8 and more at once
    sure = np.abs(truth) > 1e-7
    np.testing.assert_allclose(found[sure & (truth > 0)], truth[sure & (truth > 0)], rtol=1e-4)
    assert np.array_equal(found[sure] > 0, truth[sure] > 0)
    assert (truth[sure] < 0).any()


@pytest.mark.parametrize("name", [*ALL_MOMENTS, "power6-16", "trig3-16", "moment-transparency"])
def test_least_bias_is_where_the_least_pivot_becomes_positive(hard, name):
    t = moit.technique(name)
    warp = "none" if t.unit_range == (-1, 1) else "linear"
    t = dataclasses.replace(t, warp=warp)
    b0, b = moments.gather(hard, t)
    needed = moments.least_bias(t, b0, b)
    bare = moments.least_pivot(dataclasses.replace(t, bias=0.0), b0, b)
    assert np.array_equal(needed == 0, bare > 0)
    for p in np.flatnonzero((needed > 1e-18) & np.isfinite(needed))[:20]:
        for share, valid in ((1.0001, True), (0.998, False)):
            biased = dataclasses.replace(t, bias=min(float(needed[p] * share), 1.0))
            assert (moments.least_pivot(biased, b0[p : p + 1], b[p : p + 1])[0] > 0) == valid


def test_moments_bent_on_purpose_are_seen_as_invalid():
    f = moit.scenes.load("hair", size=(8, 8))
    b0, b = moments.gather(f, "power4")
    b0, b = b0[b0 > 0], b[b0 > 0]
    bent = b.copy()
    bent[::2, 1] = b[::2, 0] ** 2 - 1e-3  # a mean square below the square of the mean
    bare = moit.PowerMoments(4, bias=0.0)
    pivot = moments.least_pivot(bare, b0, bent)
    np.testing.assert_allclose(pivot[::2], -1e-3, rtol=2e-3)
    assert np.array_equal(pivot[1::2], moments.least_pivot(bare, b0, b)[1::2])
    # What the first pivot alone needs, with b1 and b2 mixed: more than is there.
    needed = moments.least_bias(bare, b0, bent)[::2]
    first = 1e-3 / (0.375 + b[::2, 0].astype(float) ** 2)
    assert (needed > 0.99 * first).all() and (needed < 1).all()


def test_the_advisor_gives_the_bias_that_the_scene_needs():
    f = moit.scenes.load("mixed", size=(64, 36))
    advice = moit.bias_advice(f, "power6")
    assert 0 < advice.least < advice.published and 0 < advice.invalid < 1
    assert advice.smallest_pivot < 0 and 0 < advice.rays <= (f.counts > 0).sum()
    assert advice.precision == "float32" and advice.technique == "power6"
    t = moit.PowerMoments(6, bias=1.001 * advice.least)
    assert moments.least_pivot(t, *moments.gather(f, t)).min() > 0
    t = moit.PowerMoments(6, bias=0.99 * advice.least)
    assert moments.least_pivot(t, *moments.gather(f, t)).min() <= 0
    double = moit.bias_advice(f, "power6", dtype=np.float64)
    assert double.least < 1e-6 * advice.least
    assert "least bias" in str(advice) and "enough" in str(advice)
    half = moit.Fragments(  # with as many pixels again of which nothing is known
        np.concatenate([f.offsets, np.full(len(f.counts), len(f))]), f.depth, f.alpha, f.color
    )
    assert moit.bias_advice(half, "power6").invalid == advice.invalid
    two = moit.bias_advice(f, "two-moments-pass")
    assert two.least > 0 and two.rays == advice.rays


def test_the_advisor_says_what_is_enough():
    def advice(least, default=5e-8, published=5e-6):
        return BiasAdvice("t", "float32", 1234, 0.125, -0.5, least, default, published)

    lines = str(advice(1e-7)).splitlines()
    assert lines[0].split() == ["t,", "float32", "1,234", "rays"]
    assert lines[1].split()[-2:] == ["12.5", "%"] and lines[2].split()[-1] == "-0.5000"
    assert lines[4].endswith("5.00e-8  not enough") and lines[5].endswith("5.00e-6  enough")
    assert str(advice(5e-8)).splitlines()[4].endswith("5.00e-8  enough")
    assert "enough" not in str(advice(np.inf))
    found = moit.bias_advice("panes", "power8(bias=0.5)")
    assert (found.default, found.published) == (1.5e-7, 5e-5)
    double = moit.bias_advice("panes", "power8", dtype="f8")
    assert (double.default, double.published) == (1e-14, 5e-5)


def in_unit_range(f: moit.Fragments) -> moit.Fragments:
    near, far = f.depth_range
    z = np.clip(2 * np.log(f.depth / near) / np.log(far / near) - 1, -1, 1)
    return moit.Fragments(f.offsets, z, f.alpha, depth_range=(-1, 1))


@pytest.mark.parametrize("name", ALL_MOMENTS)
@pytest.mark.parametrize(
    "family, value",
    [
        ("distance", 1e-7),
        ("layers", 5),
        ("layers", 16),
        ("one-depth", 4),
        ("symmetric", 1e-6),
        ("ends", 1e-7),
        ("moving", 1e-6),
    ],
)
def test_unlimited_precision_is_that_of_mpmath(name, family, value):
    f = in_unit_range(FAMILIES[family].case(value, 4, seed=1).f)[0, :2]
    t = dataclasses.replace(moit.technique(name), warp="linear")
    found = unlimited_transmittance(f, t)
    for p in range(2):
        own = slice(f.offsets[p], f.offsets[p + 1])
        depth, alpha = f.depth[own], f.alpha[own]
        with mp.workdps(60):
            if name in POWER:
                b0, b = rays.moments(depth, alpha, t.count)
                ray = power.biased(b, 0)
                asked = [power.transmittance(ray, b0, z, 0.25) for z in depth]
            else:
                # bias 0 where rays are determined leaves nothing to invert
                b0, b = trigonometric.moments(depth, alpha, t.count, t.wrapping_zone)
                tiny = mpf(10) ** -28
                ray = trigonometric.Ray([(1 - tiny) * x for x in b], mpf(t.wrapping_zone))
                shares = [ray.in_front(z) for z in depth]
                asked = [mp.exp(-b0 * (front + at / 4)) for front, at in shares]
        truth = np.array([float(one) for one in asked])
        sure = ~np.isnan(found[own])
        # what SURE in moit/numerics/unlimited.py allows
        np.testing.assert_allclose(found[own][sure], truth[sure], rtol=0, atol=1e-6)
        if family in ("distance", "one-depth", "ends") or (name, family) == ("power4", "moving"):
            assert sure.all()


@pytest.mark.parametrize("name", POWER)
@pytest.mark.parametrize("family, value", [("distance", 1e-7), ("layers", 5), ("ends", 1e-7)])
def test_unlimited_precision_leaves_a_fragment_itself_out(name, family, value):
    f = in_unit_range(FAMILIES[family].case(value, 4, seed=2).f)[0, :2]
    t = dataclasses.replace(moit.technique(name), warp="linear", exclude_self=True)
    found = unlimited_transmittance(f, t)
    for p in range(2):
        own = slice(f.offsets[p], f.offsets[p + 1])
        depth, alpha = f.depth[own], f.alpha[own]
        with mp.workdps(80):
            b0, b = rays.moments(depth, alpha, t.count)
            ray = power.biased(b, 0)
            absorbance = [-mp.log1p(-mpf(float(a))) for a in alpha]
            asked = [
                power.transmittance_but_self(ray, b0, z, a, 0.25)
                for z, a in zip(depth, absorbance, strict=True)
            ]
        truth = np.array([float(one) for one in asked])
        np.testing.assert_allclose(found[own], truth, rtol=0, atol=1e-6)  # as above
