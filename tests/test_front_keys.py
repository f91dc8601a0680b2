"""The nearest fragments in keys of 32 bits: all is as of fragments rounded to these."""

import dataclasses
import warnings

import gpu
import numpy as np
import pytest
from test_front import ranks, rays
from test_gpu_moment_transparency import walled

import moit
from moit import FrontLayers


def rounded(f: moit.Fragments) -> moit.Fragments:
    """20 bits of warped depth, in [-1, 1], and 12 of the root of 1 - alpha."""
    near, far = np.asarray(f.depth_range, float)
    u = np.log(f.depth.astype(float) / near) / np.log(far / near)
    z = 2 * np.rint(u * (2**20 - 1)) / (2**20 - 1) - 1
    root = np.rint(4095 * np.sqrt(1 - f.alpha.astype(float))) / 4095
    return moit.Fragments(f.offsets, z, 1 - root**2, f.color, depth_range=(-1, 1), dtype=float)


@pytest.mark.parametrize("tail", ["power4", "trig3", "neural-bounded6"])
def test_transmittance_is_that_of_rounded_fragments(tail):
    f = rays("veils")
    T = moit.transmittance(f, FrontLayers(2, tail=tail, key_bits=32))
    as_it_is = moit.technique(tail)
    warped = FrontLayers(2, tail=dataclasses.replace(as_it_is, warp="none"))
    other = moit.transmittance(rounded(f), warped)
    # a depth on the border of two words may be in either; then others have it in either, too
    assert np.quantile(np.abs(T - other), 0.999) < 1e-9
    assert np.abs(T - moit.transmittance(f, FrontLayers(2, tail=tail))).max() > 1e-5


def test_rounding_costs_next_to_nothing_and_what_it_frees_is_worth_more():
    f = rays("haze", np.float32)
    exact = moit.composite(f, "sorted", dtype="f8")
    error = {
        t: float(np.sqrt(np.mean((moit.composite(f, t) - exact) ** 2)))
        for t in ("front2", "front2(key_bits=32)", "front4(key_bits=32)")
    }
    assert error["front2(key_bits=32)"] < 1.02 * error["front2"]
    assert error["front4(key_bits=32)"] < 0.8 * error["front2"]
    assert moit.technique("front4(key_bits=32)").bits_per_pixel == 8 * 44


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bounds_hold_and_are_close_of_the_nearest(dtype):
    f = rays("veils", dtype)
    technique = FrontLayers(3, key_bits=32)
    exact = moit.transmittance(f, "sorted")
    lower, upper = moit.bounds(f, technique)
    assert (lower <= exact).all() and (exact <= upper).all()
    assert np.median((upper - lower)[ranks(f) < 2]) < 1e-3
    depths = np.linspace(*f.depth_range, 9)
    lower, upper = moit.bounds(f, technique, depth=depths)
    curve = moit.transmittance(f, "sorted", depth=depths)
    assert (lower <= curve).all() and (curve <= upper).all()
    assert (lower > 0).any() and (upper < 1).any()


def test_bounds_hold_where_depths_are_within_one_word():
    """Which of them is in front nobody knows any more."""
    rng = np.random.default_rng(0)
    n = 2000
    depth = 1.5 + rng.choice([0, 1e-7, 2e-7, 0.1], (n, 4))
    f = moit.Fragments(4 * np.arange(n + 1), depth.ravel(), rng.uniform(0, 1, 4 * n))
    exact = moit.transmittance(f, "sorted")
    lower, upper = moit.bounds(f, FrontLayers(2, tail="power4(warp='linear')", key_bits=32))
    assert (lower <= exact).all() and (exact <= upper).all()


def test_the_curve_is_what_fragments_see():
    f = rays("layers")
    technique = FrontLayers(2, tail="power4", key_bits=32)
    T = moit.transmittance(f, technique)
    for p in range(20):
        own = slice(f.offsets[p], f.offsets[p + 1])
        curve = moit.transmittance(f[0, p], technique, depth=f.depth[own])
        np.testing.assert_allclose(np.ravel(curve), T[own], atol=1e-9)


@pytest.mark.parametrize("tail", ["neural-bounded", "power6(warp='linear')"])
@pytest.mark.parametrize("transmission", [True, False])
def test_passes_have_the_cores_bits(tail, transmission):
    f, technique = walled(transmission=transmission), FrontLayers(2, tail=tail, key_bits=32)
    on = {"device": gpu.software_device(), "exact": True}
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # that the core has answered
        for ask, *where in (
            (moit.composite,),
            (moit.transmittance,),
            (moit.transmittance, np.linspace(0.5, 21, 9)),
        ):
            found = ask(f, technique, *where, **on)
            np.testing.assert_array_equal(found, ask(f, technique, *where))


def test_a_pixels_own_range_is_refused():
    with pytest.raises(ValueError, match=r"key_bits: keys of 32 bits .* expected 64"):
        FrontLayers(2, tail=moit.PowerMoments(4, depth_range="pixel"), key_bits=32)
    with pytest.raises(ValueError, match="key_bits: expected 32, 64, got 16"):
        FrontLayers(2, key_bits=16)
