"""Depths become z as the formulas say, over all ranges that a dtype has."""

import numpy as np
import pytest
from mpmath import log, mp, mpf

import moit
from moit import PowerMoments

mp.dps = 60


def exact(depth, near: float, far: float, warp: str) -> list[float]:
    function = log if warp == "log" else mpf
    near, far = function(mpf(near)), function(mpf(far))
    return [float(2 * (function(mpf(float(d))) - near) / (far - near) - 1) for d in depth]


def spread(low: float, high: float, warp: str, dtype) -> np.ndarray:
    """Depths from low to high, both included."""
    if warp == "log":
        depth = np.exp(np.linspace(np.log(np.longdouble(low)), np.log(np.longdouble(high)), 33))
    else:
        depth = low + np.linspace(0, 1, 33, dtype=np.longdouble) * (np.longdouble(high) - low)
    return np.clip(depth, low, high).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("warp", ["log", "linear"])
@pytest.mark.parametrize("ends", range(9))
def test_z_is_what_the_formula_gives_over_any_range(ends, warp, dtype):
    found = np.finfo(dtype)
    least, tiny, most = (float(x) for x in (found.smallest_subnormal, found.tiny, found.max))
    low, high = [
        (0.5, 20.0),
        (1e-3, 1e6),
        (least, most),
        (least, tiny),
        (tiny, 1.0),
        (1.0, most),
        (most / 4, most),
        (1e-30, 1e30),
        (-most, most),
    ][ends]
    if warp == "log" and low < 0:
        low = tiny
    depth = spread(low, high, warp, dtype)
    # a pixel each: b1 of a lone fragment is its z
    f = moit.Fragments(np.arange(len(depth) + 1), depth, np.full(len(depth), 0.5, dtype))
    _, b = moit.moments.gather(f, PowerMoments(4, warp=warp))
    # A few roundings of z; a log of 700 is rounded in float64 at 1e-13, and a quotient with the log
    # of 4 keeps that.
    tolerance = 4 * found.eps if dtype == np.float32 or warp == "linear" else 4e-13
    assert np.abs(b[:, 0] - exact(depth, *f.depth_range, warp)).max() <= tolerance


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("warp", ["log", "linear"])
@pytest.mark.parametrize("depth_range", ["image", "pixel"])
def test_the_greatest_range_gives_numbers(depth_range, warp, dtype):
    found = np.finfo(dtype)
    depth = spread(float(found.tiny), float(found.max), "log", dtype)
    rng = np.random.default_rng(0)
    f = moit.Fragments([0, 10, 11, 33], depth, rng.random(33, dtype), rng.random((33, 3), dtype))
    for m in (4, 6, 8):
        technique = PowerMoments(m, warp=warp, depth_range=depth_range)
        assert np.isfinite(moit.composite(f, technique)).all()
        curve = moit.transmittance(f, technique, np.append(depth, [-1.0, 0.0]))
        assert ((curve >= 0) & (curve <= 1)).all()
