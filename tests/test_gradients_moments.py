"""Derivatives of moments by themselves against differences in 60 digits."""

import numpy as np
import pytest
from mpmath import mp, mpc, mpf

import moit
from moit import gradients
from moit.gradients.moment_bounds import compute_moment_bounds, compute_moment_bounds_backward
from tests.oracle import power, trigonometric

STEP = mpf(10) ** -25
Z = np.array([[-0.93, -0.2, 0.3], [0.1, 0.55, 0.95]])
SEED = np.random.default_rng(3).normal(size=Z.shape)


def gathered(technique):
    rng = np.random.default_rng(8)
    depth, alpha = rng.uniform(1.1, 5.8, 12), rng.uniform(0.05, 0.8, 12)
    f = moit.Fragments([0, 5, 12], depth, alpha, depth_range=(1, 6), dtype="float64")
    return moit.moments.gather(f, technique)


def absorbance(technique, b0, b, z, own=0, bias=None, beta=None):
    """In front of z, in mpmath; b: powers, or real and imaginary parts."""
    bias = technique.bias_for(np.float64) if bias is None else bias
    beta = technique.overestimation if beta is None else beta
    if technique.kind == "power":
        found = power.biased(b, bias).at(z)
        lower, at = found.lower, found.weight
    else:
        theta, keeps = mpf(technique.wrapping_zone), 1 - mpf(bias)
        x = [mpc(re, im) * keeps for re, im in zip(b[::2], b[1::2], strict=True)]
        nodes = trigonometric.Ray(x, theta).representation(z)
        pairs = [*zip(nodes.points, nodes.weights, strict=True)]
        at = pairs[0][1]
        lower = mp.fsum(w * trigonometric.share(p, pairs[0][0], theta) for p, w in pairs[1:])
    return min(b0 * lower + beta * max(b0 * at - own, 0), b0 - own)


def real(b):
    return b.view(float) if np.iscomplexobj(b) else b


def differences(loss, row, places):
    """Of the loss by some of a list of numbers."""
    found = []
    for i in places:
        ends = [loss([*row[:i], row[i] + s, *row[i + 1 :]]) for s in (STEP, -STEP)]
        found.append(float((ends[0] - ends[1]) / (2 * STEP)))
    return found


@pytest.mark.parametrize("name", ["power4(bias=1e-6)", "power8(bias=1e-4)", "trig3(bias=1e-4)"])
def test_transmittance_of_moments(name):
    technique = moit.technique(name)
    b0, b = gathered(technique)
    T, pullback = gradients.moments_transmittance(technique, b0, b, Z)
    np.testing.assert_array_equal(T, moit.moments.transmittance(technique, b0, b, Z))
    found = pullback(SEED)
    assert found.b.shape == b.shape
    assert found.b.dtype == b.dtype
    with mp.workdps(60):

        def loss(numbers):
            b0, z, b = numbers[0], numbers[1:4], numbers[4:]
            T = [mp.exp(-absorbance(technique, b0, b, at)) for at in z]
            return mp.fsum(mpf(s) * t for s, t in zip(SEED[1], T, strict=True))

        row = [mpf(float(x)) for x in (b0[1], *Z[1], *real(b[1]))]
        got = np.array([found.b0[1], *found.z[1], *real(found.b[1])])
        places = [0, 2, 4, 5, len(row) - 1]
        wanted = differences(loss, row, places)
        np.testing.assert_allclose(got[places], wanted, rtol=1e-8, atol=1e-10)


def test_bounds_of_moments():
    technique = moit.technique("power6")
    b0, b = gathered(technique)
    alpha = np.array([[0.1, 0.0, 0.3], [0.02, 0.4, 0.2]])
    (lower, upper), pullback = gradients.moments_bounds(technique, b0, b, Z, alpha)
    np.testing.assert_array_equal(upper, moit.moments.bounds(technique, b0, b, Z, alpha)[1])
    found = pullback(SEED, SEED**2)
    with mp.workdps(60):

        def loss(numbers):
            b0, z, alpha, b = numbers[0], numbers[1:4], numbers[4:7], numbers[7:]
            sums = []
            for i, (at, one) in enumerate(zip(z, alpha, strict=True)):
                # what lies at z may be less than what is said to: the bound is less then, too
                proved = power.biased(b, 1e-11).at(at)
                most = b0 * (proved.lower + proved.weight) + mp.log1p(-one)
                sums.append(mpf(SEED[0, i]) * mp.exp(-max(most, 0)))
                sums.append(mpf(SEED[0, i] ** 2) * mp.exp(-b0 * proved.lower))
            return mp.fsum(sums)

        row = [mpf(float(x)) for x in (b0[0], *Z[0], *alpha[0], *b[0])]
        answer = float((SEED[0] * lower[0] + SEED[0] ** 2 * upper[0]).sum())
        assert answer == pytest.approx(float(loss(row)), rel=1e-7)
        got = np.array([found.b0[0], *found.z[0], *found.alpha[0], *found.b[0]])
        places = [0, 1, 3, 4, 6, 8, 12]
        wanted = differences(loss, row, places)
        np.testing.assert_allclose(got[places], wanted, rtol=1e-7, atol=1e-8)


def test_the_layout_of_diffmoments():
    technique = moit.technique("power4(bias=1e-5, overestimation=0.4)")
    b0, b = gathered(technique)
    moments = np.vstack([b0, b0 * b.T])
    at = np.array([0.3, -0.4])
    bounds, ctx = compute_moment_bounds(moments, at, 1e-5, 0.4, return_backward_context=True)
    np.testing.assert_array_equal(bounds, compute_moment_bounds(moments, at, 1e-5, 0.4, True))
    seed = np.array([0.7, -1.3])
    by_moments, by_at = compute_moment_bounds_backward(ctx, seed)
    with mp.workdps(60):

        def loss(numbers):
            mass, *sums, z = numbers
            return mpf(seed[1]) * absorbance(technique, mass, [one / mass for one in sums], z)

        row = [mpf(float(x)) for x in (*moments[:, 1], at[1])]
        assert seed[1] * bounds[1] == pytest.approx(float(loss(row)), rel=1e-9)
        got = [*by_moments[:, 1], by_at[1]]
        wanted = differences(loss, row, range(len(row)))
        np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-10)
    none = np.zeros((5, 2))
    bounds, ctx = compute_moment_bounds(none, at, 1e-5, 0.4, return_backward_context=True)
    assert not bounds.any()
    assert np.isfinite(np.vstack(compute_moment_bounds_backward(ctx, seed))).all()
    with pytest.raises(ValueError, match=r"moments: expected shape \(2n \+ 1, N\)"):
        compute_moment_bounds(np.zeros((4, 2)), at, 1e-5, 0.4)
    far, negative = np.ones((5, 2)), np.ones((5, 2))
    far[2, 1], negative[0, 1] = -1.5, -1
    with pytest.raises(ValueError, match=r"moments\[2, 1\]: found -1.5; needed at most the mass 1"):
        compute_moment_bounds(far, at, 1e-5, 0.4)
    with pytest.raises(ValueError, match=r"moments\[0\]"):
        compute_moment_bounds(negative, at, 1e-5, 0.4)
    with pytest.raises(ValueError, match="η"):
        compute_moment_bounds(np.ones((5, 2)), at + 2, 1e-5, 0.4)
    for double in (np.float32, np.float64):  # a block of rays and a part of one
        many = np.tile(moments, 200)[:, :301].astype(double)
        places = np.linspace(-1, 1, 301, dtype=double)
        for k, i, wrong in ((0, 300, np.inf), (4, 299, np.nan), (3, 0, -np.inf)):
            odd = many.copy()
            odd[k, i] = wrong
            with pytest.raises(ValueError, match=rf"moments\[{k}, {i}\]: found {wrong}"):
                compute_moment_bounds(odd, places, 1e-5, 0.4)
        odd = places.copy()
        odd[300] = np.nan
        with pytest.raises(ValueError, match=r"η\[300\]: found nan"):
            compute_moment_bounds(many, odd, 1e-5, 0.4)
        bounds, context = compute_moment_bounds(
            many, places, 1e-5, 0.4, return_backward_context=True
        )
        by_all = compute_moment_bounds_backward(context, np.ones(301))
        _, context = compute_moment_bounds(
            many[:, 290:], places[290:], 1e-5, 0.4, return_backward_context=True
        )
        by_some = compute_moment_bounds_backward(context, np.ones(11))
        for whole, part in zip(by_all, by_some, strict=True):
            np.testing.assert_array_equal(whole[..., 290:], part)
            assert part.dtype == double


@pytest.mark.parametrize("count", (2, 4))
def test_rows_of_floats_say_what_the_same_rows_of_doubles_say(count):
    """Floats have a loop of their own where the bias is far above what it rounds off."""
    rng = np.random.default_rng(2)
    place, mass = rng.uniform(-1, 1, (3, 203)), rng.uniform(0.1, 2, (3, 203))
    place[1, 100:] = place[0, 100:] + 1e-4  # all but one surface
    mass[2, 50:] = 0
    mass[:, 7] = 0
    at = rng.uniform(-1, 1, 203).astype(np.float32)
    at[:90:3] = place[0, :90:3]
    rows = np.stack([(mass * place**k).sum(axis=0) for k in range(count + 1)]).astype(np.float32)
    rows[1:] = np.clip(rows[1:], -rows[0], rows[0])
    for bias in (1e-6, 1e-3):
        found = [
            compute_moment_bounds(
                one, at.astype(one.dtype), bias, 0.3, return_backward_context=True
            )
            for one in (rows, rows.astype(float))
        ]
        np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-6, atol=1e-6)
        (by_rows, by_at), wanted = (
            compute_moment_bounds_backward(context, np.ones(203)) for _, context in found
        )
        size = np.abs(wanted[0]).sum(axis=0)
        assert (np.abs(by_rows - wanted[0]) <= 1e-5 * size).all()
        # what rounds off pivots is 1e-9 of them, and slopes hang on them all the more
        np.testing.assert_allclose(by_at, wanted[1], rtol=1e-5, atol=1e-5)
        assert by_rows.dtype == np.float32 and not by_rows[:, 7].any()


def test_what_moments_have_no_derivatives_is_refused():
    b0, b = gathered("power4")
    for name, why in (
        ("power4(bits=16)", "words of 16 bits"),
        ("moment-transparency(passes=2)", "two passes"),
        ("neural-bounded", "have none yet"),
    ):
        with pytest.raises(ValueError, match=why):
            gradients.moments_transmittance(name, b0, b, Z)
    with pytest.raises(TypeError, match="stores moments"):
        gradients.moments_transmittance("sorted", b0, b, Z)
    with pytest.raises(ValueError, match="trigonometric moments prove"):
        gradients.moments_bounds("trig3", b0, b, Z)
    _, pullback = gradients.moments_transmittance("power4", b0, b, Z)
    with pytest.raises(ValueError, match=r"d_transmittance: expected shape \(2, 3\)"):
        pullback(np.ones(3))
