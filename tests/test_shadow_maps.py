"""Deep shadow maps: piecewise linear, never farther from the exact transmittance than they say.

The reference looks at all vertices that follow an origin at once, where the core narrows slopes
surface by surface.
"""

import numpy as np
import pytest

import moit
from moit import DeepShadowMap

precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])
TOLERANCES = [0.0, 1e-3, 0.02, 0.1, 0.4]


def ray(seed, k=40, most=0.3, dtype=np.float64):
    rng = np.random.default_rng(seed)
    z = rng.uniform(1, 9, k).astype(dtype)
    z[rng.random(k) < 0.2] = z[0]  # some at one depth
    alpha = rng.uniform(0, most, k).astype(dtype)
    return moit.Fragments([0, k], z, alpha, depth_range=(1, 9), dtype=dtype)


def exact(f, at):
    """What lies strictly nearer counts."""
    z, alpha = f.depth.astype(float), f.alpha.astype(float)
    return np.array([np.prod(1 - alpha[z < one]) for one in np.asarray(at, float)])


def around(f):
    """Depths in front of, at, just behind and far from surfaces."""
    z = f.depth.astype(float)
    just_behind = np.nextafter(z, 99)
    return np.clip(np.concatenate([z, just_behind, np.linspace(1, 9, 400)]), 1, 9)


def curve(f, technique, at):
    return moit.transmittance(f, technique, depth=at)[0, 0].astype(float)


@precisions
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_no_point_of_the_curve_is_farther_from_the_exact_one_than_the_tolerance(tolerance, dtype):
    for seed in range(20):
        f = ray(seed, k=1 + 6 * seed, most=(0.02, 0.3, 1.0)[seed % 3], dtype=dtype)
        at = around(f)
        error = np.abs(curve(f, DeepShadowMap(tolerance), at) - exact(f, at))
        assert error.max() <= tolerance + 4 * np.finfo(dtype).eps
        T = moit.transmittance(f, DeepShadowMap(tolerance))
        assert np.abs(T - exact(f, f.depth)).max() <= tolerance + 4 * np.finfo(dtype).eps


@precisions
def test_curves_end_above_what_the_whole_ray_lets_through(dtype):
    for seed in range(20):
        f = ray(seed, k=2 + 3 * seed, most=0.5, dtype=dtype)
        total = float(np.prod(1 - f.alpha.astype(float)))
        for tolerance in (0.02, 0.2, 0.6):
            T = curve(f, DeepShadowMap(tolerance), around(f))
            assert T.min() >= total * (1 - 4 * np.finfo(dtype).eps)


def nodes_of(f, tolerance):
    """The paper's greedy compression, whole arrays at a time: nodes' depths and transmittances."""
    z = np.unique(f.depth)
    steps = np.array([np.prod(1 - f.alpha[f.depth == one]) for one in z])
    behind = np.cumprod(steps)
    before = np.append(1, behind[:-1])
    total = behind[-1]
    # vertices: 2 i in front of surface i, 2 i + 1 behind it
    at = np.repeat(z, 2)
    T = np.stack([before, behind], axis=1).ravel()
    low, high = np.maximum(T - tolerance, total), T + tolerance
    found = [(z[0], 1.0)]
    here, first = (z[0], 1.0), 1  # the origin, and the first vertex that it does not settle
    while first < len(at):
        away = at[first:] - here[0]
        near = away <= 0
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = np.where(near, -np.inf, (low[first:] - here[1]) / away)
            rise = np.where(near, 0, (high[first:] - here[1]) / away)
        fall, rise = np.maximum.accumulate(fall), np.minimum.accumulate(np.minimum(rise, 0))
        # at the origin's own depth the curve has to be right already
        bad = (fall > rise) | (near & (here[1] > high[first:]))
        passed = int(np.argmax(bad)) if bad.any() else len(bad)
        last = first + passed - 1  # the last vertex that the segment passes
        if passed and at[last] > here[0]:
            slope = (fall[passed - 1] + rise[passed - 1]) / 2
            here = (at[last], here[1] + slope * (at[last] - here[0]))
            found.append(here)
        if last + 1 < len(at) and at[last + 1] == at[last]:  # a step too high: exact behind it
            here = (at[last], T[last + 1])
            found.append(here)
            last += 1
        first = last + 1
    return [*found, (z[-1], total)]


def reference(f, tolerance, at):
    nodes = nodes_of(f, tolerance)
    found = np.empty(len(at))
    for i, one in enumerate(at):
        behind = next((k for k, (z, _) in enumerate(nodes) if z >= one), None)
        if behind is None:
            found[i] = nodes[-1][1]
        elif behind == 0 or nodes[behind][0] == one:
            found[i] = nodes[behind][1]
        else:
            (z0, T0), (z1, T1) = nodes[behind - 1], nodes[behind]
            found[i] = T0 + (T1 - T0) * (one - z0) / (z1 - z0)
    return found


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_the_curve_is_that_of_the_papers_greedy_compression(tolerance):
    for seed in range(12):
        f = ray(seed, k=1 + 8 * seed, most=(0.02, 0.3, 1.0)[seed % 3])
        at = around(f)
        got, expected = curve(f, DeepShadowMap(tolerance), at), reference(f, tolerance, at)
        # slopes are quotients of differences; steep ones over a last bit of depth are not the same
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-11)


def nodes_seen(f, technique):
    """How many nodes a curve has, from what it does in and between surfaces."""
    z = np.unique(f.depth)
    third = (z[1:] - z[:-1]) / 3
    left, right = curve(f, technique, z[:-1] + third), curve(f, technique, z[1:] - third)
    slopes = np.concatenate([[0], (right - left) / third, [0]])
    behind = np.append(left - (right - left), curve(f, technique, [9.0]))
    jumps = np.abs(behind - curve(f, technique, z)) > 1e-9
    bends = np.abs(np.diff(slopes)) > 1e-9
    return int((2 * jumps + (bends & ~jumps)).sum())


def test_maps_of_a_larger_tolerance_have_fewer_nodes():
    for seed in range(5):
        f = ray(seed, k=300, most=0.05)
        found = [nodes_seen(f, DeepShadowMap(tolerance)) for tolerance in TOLERANCES]
        assert sorted(found, reverse=True) == found
        assert found[0] >= 2 * len(np.unique(f.depth[f.alpha > 0])) - 2  # every step is there
        assert found[2] <= 60 and found[4] <= 6


@precisions
def test_a_tolerance_of_0_keeps_the_exact_function(dtype):
    for seed in range(10):
        f = ray(seed, most=1.0, dtype=dtype)
        at = around(f)
        np.testing.assert_array_equal(
            moit.transmittance(f, DeepShadowMap(0.0), depth=at)[0, 0], exact_stored(f, at)
        )


def exact_stored(f, at):
    """Products from front to back, as `sorted` takes them."""
    order = np.argsort(f.depth, kind="stable")
    z = f.depth[order].astype(float)
    T = np.append(1, np.cumprod(1 - f.alpha[order].astype(float)))
    return T[np.searchsorted(z, at)].astype(f.depth.dtype)


@precisions
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_light_never_grows_and_its_total_is_exact(tolerance, dtype):
    for seed in range(20):
        f = ray(seed, k=1 + 10 * seed, most=(0.02, 0.3, 1.0)[seed % 3], dtype=dtype)
        at = np.sort(around(f))
        T = moit.transmittance(f, DeepShadowMap(tolerance), depth=at)[0, 0]
        # a slope times a distance rounds to the last bit of a transmittance, which is at most 1
        assert (np.diff(T) <= np.finfo(dtype).eps).all()
        total = moit.total_transmittance(f, "deep-shadow")[0, 0]
        assert total == moit.total_transmittance(f, "sorted")[0, 0]
        assert (T >= total).all() and (T <= 1).all()


def test_one_straight_segment_takes_the_place_of_many_thin_layers():
    n = 1000
    f = moit.Fragments([0, n], np.linspace(1, 9, n), np.full(n, 1e-4))
    at = np.linspace(1, 9, 101)
    T = curve(f, DeepShadowMap(0.02), at)
    assert np.abs(np.diff(T, 2)).max() <= 1e-12
    assert np.abs(T - exact(f, at)).max() <= 0.02


@precisions
def test_depths_as_far_apart_as_numbers_go_are_fine(dtype):
    most, least = float(np.finfo(dtype).max), float(np.finfo(dtype).tiny)
    z = np.array([-most, -least, 0, least, most], dtype)
    f = moit.Fragments([0, 5], z, np.full(5, 0.1), dtype=dtype)
    for tolerance in TOLERANCES:
        T = moit.transmittance(f, DeepShadowMap(tolerance))
        assert np.abs(T - 0.9 ** np.arange(5)).max() <= tolerance + 1e-6


@pytest.mark.parametrize("tolerance", [-0.1, 1.5, float("nan")])
def test_a_tolerance_is_a_share_of_light(tolerance):
    with pytest.raises(ValueError, match="tolerance"):
        DeepShadowMap(tolerance)
