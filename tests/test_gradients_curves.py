"""Derivatives of curves, the transmittance at given depths, against differences in 60 digits."""

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from tests.oracle import foremost, front, states
from tests.oracle.states import product
from tests.test_gradients import FAR, NEAR, Ray, difference, exactly, fragments, numbers_of, seen

CURVES = (
    "sorted",
    "power6(bias=1e-6, depth_range='pixel')",
    "trig3(bias=1e-6)",
    "fourier7(bits=32)",
    "moment-transparency(passes=2, bias=1e-6)",
    "wavelet8",
    "slices64(bits=16, cells=64)",
    "neural-slices4(bits=16)",
    "transmittance-function-map(bits=32)",
    "depth-peeling3",
    "neural",
    "front2(tail='power4(bias=1e-6)')",
    "neural-bounded(bias=1e-6)",
    "neural-bounded(bias=1e-5, depth_range='pixel')",
)


@pytest.mark.parametrize("name", CURVES)
def test_pullbacks_of_curves_are_differences(name):
    technique = moit.technique(name)
    numbers = numbers_of(6)
    # in front of all, in front of a pixel's own, at a fragment, among them, behind all
    nearest, third, farthest = map(int, numbers[0].argsort()[[0, 2, -1]])
    asked = [0.5, 1.1, float(numbers[0][third]), 2.2, 2.9, 4.3, 5.9, 9.0]
    f = fragments(numbers)
    T, pullback = gradients.transmittance(f, technique, asked)
    np.testing.assert_array_equal(T, moit.transmittance(f, technique, asked))
    seed = np.random.default_rng(3).normal(size=T.shape)
    found = pullback(seed)
    with mp.workdps(60):
        ray = Ray(*(one if one is None else [*map(exactly, one)] for one in numbers))

        def loss(other):
            depth, alpha = tuple(other.depth), tuple(other.alpha)
            last = max(depth) if getattr(technique, "range_per_pixel", False) else FAR
            first = min(depth) if getattr(technique, "range_per_pixel", False) else NEAR
            inside = [one for one in asked if first <= one <= last]
            if technique.kind == "front":
                given = front.curve(technique, depth, alpha, inside, NEAR, FAR)
            elif technique.kind not in states.STATES:
                counted = [*range(6)]
                if technique.kind == "depth-peeling":
                    counted = foremost.foremost(technique, depth, alpha)
                given = [product([alpha[i] for i in counted if depth[i] < one]) for one in inside]
            else:
                given = states.curve(technique, depth, alpha, inside, NEAR, FAR)
            total = seen(technique, depth, alpha, None)[1]
            given = [mpf(1)] * sum(one < first for one in asked) + given
            given += [total] * (len(asked) - len(given))
            return mp.fsum(mpf(s) * x for s, x in zip(seed.ravel(), given, strict=True))

        assert float((T * seed).sum()) == pytest.approx(float(loss(ray)), abs=1e-6)
        for place in (
            ("depth", nearest),
            ("depth", farthest),
            ("alpha", nearest),
            ("alpha", third),
        ):
            got, wanted = getattr(found, place[0])[place[1:]], difference(loss, ray, *place)
            assert got == pytest.approx(wanted, rel=1e-9, abs=1e-10), place


@pytest.mark.parametrize(
    ("depth", "asked"),
    (
        ([1.5, 1.506, 3.0, 4.4], None),
        ([1.7, 1.708, 3.1, 3.13, 4.0, 4.9], None),
        ([1.5, 1.515, 3.0], [1.2, 1.48, 1.52, 1.6, 2.2, 3.05]),
    ),
)
def test_slices_at_a_bound_of_moments_move_as_that(depth, asked):
    """Slices tell no order within a cell; where moments prove more, these give the derivatives."""
    technique, loose = (
        moit.technique(f"slices64(bits=16, cells=64{more})") for more in (", inside='power4'", "")
    )
    rng = np.random.default_rng(5)
    alpha = rng.uniform(0.1, 0.7, len(depth))
    f = fragments((np.array(depth), alpha, np.ones((len(depth), 3)), None))
    T, pullback = gradients.transmittance(f, technique, asked)
    bounded = gradients.transmittance(f, loose, asked)[0] != T
    assert bounded.any() and not bounded.all()
    seed = rng.normal(size=T.shape)
    found = pullback(seed)
    with mp.workdps(60):
        ray = Ray([*map(exactly, f.depth)], [*map(exactly, alpha)], None)

        def loss(other):
            of = tuple(other.depth), tuple(other.alpha)
            given = states.curve(technique, *of, asked, NEAR, FAR) if asked else None
            given = given or states.seen(technique, *of, NEAR, FAR)[0]
            return mp.fsum(mpf(s) * x for s, x in zip(seed.ravel(), given, strict=True))

        assert float((T * seed).sum()) == pytest.approx(float(loss(ray)), abs=1e-8)
        for part in ("depth", "alpha"):
            for i in range(len(depth)):
                got, wanted = getattr(found, part)[i], difference(loss, ray, part, i)
                # of moments, whose last digits move them that far
                assert got == pytest.approx(wanted, rel=1e-7, abs=1e-8), (part, i)


@pytest.mark.parametrize(
    "name",
    (
        "power4(warp='none')",
        "fourier7(warp='none')",
        "moment-transparency(warp='none')",
        "front2(tail=\"power4(warp='none')\", key_bits=64)",
        "slices8(warp='none', inside='power4')",
    ),
)
def test_a_curve_without_a_warp_may_be_asked_anywhere(name):
    depth = [0.25, 0.5, 0.75]
    f = moit.Fragments([0, 3], depth, [0.5] * 3, depth_range=(0, 1), dtype="float64")
    near = moit.transmittance(f, name, [0.1, 0.6, 2.0])
    T, pullback = gradients.transmittance(f, name, [-1e300, 0.1, 0.6, 2.0, 1e300])
    np.testing.assert_array_equal(T[0, 0, 1:4], near[0, 0])
    assert T[0, 0, 0] == 1
    assert T[0, 0, 4] == near[0, 0, 2]
    all_of = pullback(np.array([[[1.0, 2.0, 3.0, 4.0, 5.0]]]))
    _, pullback = gradients.transmittance(f, name, [0.1, 0.6, 2.0])
    inside = pullback(np.array([[[2.0, 3.0, 9.0]]]))
    np.testing.assert_allclose(all_of.alpha, inside.alpha, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(all_of.depth, inside.depth, rtol=1e-14, atol=1e-15)
