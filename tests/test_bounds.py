"""moit.bounds holds the exact transmittance of every scene, whatever rounding does.

Comparisons are exact: the truth is a product at 80 digits of the very numbers the fragments hold,
and no tolerance is added to the bounds.
"""

import itertools
import math
from functools import cache, lru_cache
from itertools import pairwise
from types import SimpleNamespace

import hypothesis.extra.numpy as arrays_of
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from oracle import power, rays
from oracle.hard_rays import KINDS, flat, hard_rays
from oracle.power import BIAS_VECTOR
from oracle.problems import power_problems
from readings import c
from variants import EVERY, POWER, POWER_VARIANTS

import moit
from moit import PowerMoments

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
culling = pytest.mark.parametrize("cull_opaque", [True, False])


def truths(f: moit.Fragments, depth=None, cull_opaque=True) -> list[list[mpf]]:
    """Per pixel the exact transmittance in front of each fragment, or of each of `depth`."""
    found = []
    for start, end in pairwise(f.offsets):
        z, alpha = f.depth[start:end], f.alpha[start:end]
        row = rays.transmittance(z, alpha, z if depth is None else depth)
        opaque = np.flatnonzero(alpha == 1)
        if depth is None and cull_opaque and len(opaque):
            # the first of the nearest is the background, also of what lies at its depth; it hides
            # the others
            nearest = opaque[np.argmin(z[opaque])]
            for i in opaque:
                row[i] = mpf(0)
            front = (z <= z[nearest]) & (alpha < 1)
            row[nearest] = rays.transmittance(z[front], alpha[front], [np.inf])[0]
        found.append(row)
    return found


@lru_cache(maxsize=64)
def doubles_around(
    offsets: bytes, depth: bytes, alpha: bytes, dtype: str, asked: bytes | None, cull_opaque: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The last double that is no larger than each of the truths, and the first no smaller.

    A double is at most the truth if and only if it is at most the former, so these two judge bounds
    as exactly as the truth does. Kept, since every technique is asked about the same fragments.
    """
    given = SimpleNamespace(
        offsets=np.frombuffer(offsets, np.int64),
        depth=np.frombuffer(depth, dtype),
        alpha=np.frombuffer(alpha, dtype),
    )
    rows = truths(given, None if asked is None else np.frombuffer(asked), cull_opaque)
    below, above = [], []
    for T in itertools.chain.from_iterable(rows):
        near = float(T)
        below.append(near if mpf(near) <= T else math.nextafter(near, -math.inf))
        above.append(near if mpf(near) >= T else math.nextafter(near, math.inf))
        assert mpf(below[-1]) <= T <= mpf(above[-1])
    return np.array(below), np.array(above)


def violations(f, lower, upper, depth=None, cull_opaque=True) -> list[str]:
    """Where the truth lies outside, in words."""
    shape = (len(f),) if depth is None else (*f.shape, len(depth))
    assert lower.shape == shape and upper.shape == shape
    assert lower.dtype == f.depth.dtype and upper.dtype == f.depth.dtype
    assert (0 <= lower).all() and (lower <= upper).all() and (upper <= 1).all()
    below, above = doubles_around(
        np.asarray(f.offsets, np.int64).tobytes(),
        f.depth.tobytes(),
        f.alpha.tobytes(),
        f.depth.dtype.name,
        None if depth is None else np.asarray(depth, np.float64).tobytes(),
        cull_opaque,
    )
    outside = ~((lower.ravel() <= below) & (above <= upper.ravel()))
    each = len(f) if depth is None else len(depth)
    return [
        f"pixel {np.searchsorted(f.offsets, i, 'right') - 1 if depth is None else i // each}, "
        f"{i % each}: {below[i]!r} to {above[i]!r} not in "
        f"[{lower.flat[i]!r}, {upper.flat[i]!r}]"
        for i in np.flatnonzero(outside)
    ]


def assert_bounded(f: moit.Fragments, technique, depth=(), **options) -> None:
    f = coloured(f)
    fragments = moit.bounds(f, technique, **options)
    if isinstance(technique, moit.Sorted):
        # its fragments at one depth occlude one another, in the order of their arrival
        apart = without_ties(f)
        assert violations(apart, *moit.bounds(apart, technique, **options), **options) == []
    else:
        assert violations(f, *fragments, **options) == []
    if len(depth):
        at = np.asarray(depth, float)
        curve = moit.bounds(f, technique, depth=at, **options)
        assert violations(f, *curve, depth=at.astype(f.depth.dtype)) == []


def coloured(f: moit.Fragments) -> moit.Fragments:
    """The same fragments in grey, which some weights look at."""
    color = np.full((len(f), 3), 0.5, f.depth.dtype)
    return moit.Fragments(
        f.offsets, f.depth, f.alpha, color, shape=f.shape, depth_range=f.depth_range
    )


def without_ties(f: moit.Fragments) -> moit.Fragments:
    """The first to arrive of every depth of every pixel."""
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    _, first = np.unique(np.stack([pixel, f.depth]), axis=1, return_index=True)
    first = np.sort(first)
    return moit.Fragments.from_pixels(
        pixel[first], f.depth[first], f.alpha[first], shape=f.shape, depth_range=f.depth_range
    )


def scene(hard, dtype) -> moit.Fragments:
    """Hard rays with positive depths."""
    offsets, depth, alpha = flat(hard)
    depth = np.exp(3 * depth.astype(dtype)).astype(dtype)
    return moit.Fragments(offsets, depth, alpha, dtype=dtype)


@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_bounds_hold_on_hard_rays(technique, dtype):
    f = scene(hard_rays(seed=1, of_each_kind=3), dtype)
    assert_bounded(f, technique, depth=np.geomspace(0.05, 20, 23))


@pytest.mark.parametrize("kind", KINDS)
@precisions
@pytest.mark.parametrize("technique", POWER, ids=str)
def test_bounds_hold_on_many_rays_of_a_kind(technique, dtype, kind):
    f = scene(hard_rays(seed=2, of_each_kind=12, kinds=[kind]), dtype)
    assert_bounded(f, technique, depth=f.depth[:: max(1, len(f) // 20)])


@precisions
@pytest.mark.parametrize("technique", POWER, ids=str)
def test_bounds_hold_just_in_front_of_at_and_just_behind_every_fragment(technique, dtype):
    f = scene(hard_rays(seed=3, of_each_kind=1), dtype)
    for pixel in range(len(f.counts)):
        one = f[0, pixel]
        at = one.depth[:8]
        beside = [np.nextafter(at, 0), at, np.nextafter(at, np.asarray(np.inf, dtype))]
        assert_bounded(one, technique, depth=np.concatenate(beside))


@culling
@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_bounds_hold_for_opaque_and_nearly_opaque_fragments(technique, dtype, cull_opaque):
    rng = np.random.default_rng(4)
    n = 2000
    alphas = [0.0, 1e-30, 1e-7, 0.3, 0.9, 0.9981, 0.999, 1 - 1e-6, 1 - 6e-8, 1.0]
    alpha = rng.choice(np.array(alphas, dtype), n)
    depth = rng.choice(np.geomspace(1, 9, 17).astype(dtype), n)
    pixel = rng.integers(0, 400, n)
    f = moit.Fragments.from_pixels(pixel, depth, alpha, shape=(20, 20))
    depths = np.unique(depth)
    at = np.concatenate([depths, depths * 1.01, [0.5, 20]])
    assert_bounded(f, technique, depth=at, cull_opaque=cull_opaque)


@precisions
@pytest.mark.parametrize("max_alpha", [1e-60, 0.5, 0.9999, 1 - 1e-9, 1 - 2**-53])
@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_hold_for_any_max_alpha(m, max_alpha, dtype):
    """float32 rounds 0.9999 by a hundredth of a percent of its absorbance, and 1 - 1e-9 to 1."""
    rng = np.random.default_rng(20)
    n = 400
    alphas = [0.3, 0.49, 0.9, 0.9998, 0.9999, 1 - 1e-6, 1 - 6e-8, 1.0]
    alpha = rng.choice(np.array(alphas, dtype), n)
    depth = rng.choice(np.geomspace(1, 9, 17).astype(dtype), n)
    pixel = rng.integers(0, 100, n)
    f = moit.Fragments.from_pixels(pixel, depth, alpha, shape=(10, 10))
    technique = PowerMoments(m, max_alpha=max_alpha)
    assert_bounded(f, technique, depth=np.unique(depth) * 1.01, cull_opaque=False)
    held = moit.transmittance(f, technique, cull_opaque=False)
    assert ((held >= 0) & (held <= 1)).all()
    b0, b = moit.moments.gather(f, technique, cull_opaque=False)
    assert np.isfinite(b0).all() and (np.abs(b) <= 1).all()


@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_bounds_hold_where_depths_differ_by_the_last_bit(technique, dtype):
    rng = np.random.default_rng(5)
    for start in (1e-3, 1.0, 4097.0, 1e30):
        steps = [np.asarray(start, dtype)]
        for _ in range(11):
            steps.append(np.nextafter(steps[-1], np.asarray(np.inf, dtype)))
        depth = rng.permuted(np.tile(steps, (6, 1)), axis=1)
        alpha = rng.uniform(0.05, 0.99, depth.shape)
        offsets = np.arange(len(depth) + 1) * depth.shape[1]
        for depth_range in (None, (start / 10, start * 10)):
            f = moit.Fragments(
                offsets, depth.ravel(), alpha.ravel(), depth_range=depth_range, dtype=dtype
            )
            assert_bounded(f, technique, depth=steps)


@precisions
@pytest.mark.parametrize("technique", POWER, ids=str)
def test_bounds_hold_for_thousands_of_layers(technique, dtype):
    rng = np.random.default_rng(6)
    n = 4000
    for alpha in (1e-6, 1e-3, 0.5):
        f = moit.Fragments([0, n], rng.uniform(1, 10, n), rng.uniform(0, 2 * alpha, n), dtype=dtype)
        assert_bounded(f, technique, depth=np.linspace(1, 10, 20))


@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_bounds_hold_where_a_hundred_thousand_roundings_agree(technique):
    # 1 - alpha of equal alphas is rounded to the same side every time
    n = 100_000
    for alpha in (1.3e-13, 1.4e-13, 1.6e-6):
        depth = np.linspace(1, 2, n)
        f = coloured(moit.Fragments([0, n], depth, np.full(n, alpha), dtype="float64"))
        with mp.workdps(50):
            last = (1 - mpf(alpha)) ** (n - 1)
        lower, upper = moit.bounds(f, technique)
        assert mpf(float(lower[-1])) <= last <= mpf(float(upper[-1]))
        lower, upper = moit.bounds(f, technique, depth=[2.0])
        assert mpf(float(lower[0, 0, 0])) <= last <= mpf(float(upper[0, 0, 0]))


depths = st.one_of(
    st.floats(0.125, 1000, width=32), st.sampled_from([1.0, 2.0, 2.0000002384185791, 3.0, 100.0])
)
alphas = st.one_of(
    st.floats(0, 1, width=32), st.sampled_from([0.0, 1.0, 0.5, 0.998046875, 0.9999999403953552])
)


@st.composite
def one_pixel(draw) -> moit.Fragments:
    n = draw(st.integers(1, 12))
    dtype = draw(st.sampled_from(["float32", "float64"]))
    depth = draw(arrays_of.arrays(np.float32, n, elements=depths))
    alpha = draw(arrays_of.arrays(np.float32, n, elements=alphas))
    depth_range = draw(st.sampled_from([None, (0.125, 1000)]))
    return moit.Fragments([0, n], depth, alpha, depth_range=depth_range, dtype=dtype)


@given(one_pixel(), st.sampled_from([*POWER, *POWER_VARIANTS]), st.booleans())
@example(moit.Fragments([0, 2], [1, 1], [0.5, 0.5]), PowerMoments(4), True)
@settings(max_examples=300)
def test_bounds_hold_for_any_few_fragments(f, technique, cull_opaque):
    at = np.concatenate([f.depth[:6], [0.125, 1.0, 2.0, 1000.0]])
    assert_bounded(f, technique, depth=at, cull_opaque=cull_opaque)


@precisions
@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_hold_what_unbiased_moments_reconstruct(m, dtype):
    f = scene(hard_rays(seed=7, of_each_kind=3), dtype)
    lower, upper = moit.bounds(f, PowerMoments(m))
    for beta in (0.0, 0.3, 1.0):
        technique = PowerMoments(m, bias=0.0, exclude_self=True, overestimation=beta)
        T = moit.transmittance(f, technique, dtype=np.float64)
        # the reconstruction itself is good to about 1e-6 without bias, bounds to their rounding
        slack = 1e-4 if dtype == "float32" else 1e-6
        outside = np.maximum(lower - T, T - upper)
        assert np.quantile(outside, 0.999) <= slack


@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_do_not_depend_on_options_of_the_reconstruction(m):
    f = scene(hard_rays(seed=8, of_each_kind=1), "float32")
    lower, upper = moit.bounds(f, PowerMoments(m))
    other = PowerMoments(m, bias=1e-3, overestimation=0.7, exclude_self=True, normalize=False)
    for known, found in zip((lower, upper), moit.bounds(f, other), strict=True):
        assert (known == found).all()


@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_are_not_much_wider_than_the_moments_prove(m):
    # in double the sharp bounds of the unbiased moments are met to a hundredth at nearly all depths
    hard = hard_rays(seed=9 + m, of_each_kind=1)
    f = moit.Fragments(*flat(hard), depth_range=(-1, 1), dtype="float64")
    at = np.linspace(-0.95, 0.95, 5)
    lower, upper = moit.bounds(f, PowerMoments(m, warp="none"), depth=at)
    wider = []
    for pixel, ray in enumerate(hard):
        b0, b = rays.moments(ray.depth, ray.alpha, m)
        moments = power.biased(b, 0)
        for k, z in enumerate(at):
            found = moments.at(z)
            sharp = math.exp(-b0 * found.lower), math.exp(-b0 * (found.lower + found.weight))
            wider.append(max(upper[0, pixel, k] - sharp[0], sharp[1] - lower[0, pixel, k]))
    assert np.mean(np.array(wider) > 0.01) <= 0.1


@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_hold_by_what_rounding_may_have_done_to_their_own_numbers(m):
    """Of moments that are exact, so that nothing else is between a bound and the truth."""
    n, rng = m // 2, np.random.default_rng(m)
    depths = np.stack([np.sort(rng.permutation(33)[:n]) / 16 - 1 for _ in range(300)])
    shares = np.diff(np.sort(rng.integers(1, 64, (300, n - 1)), axis=1), prepend=0, append=64) / 64
    b = np.stack([(shares * depths**k).sum(axis=1) for k in range(1, m + 1)], axis=1)
    rules = c.power_rules(b, 1e-13, BIAS_VECTOR[m], 1e-15)
    z = np.stack([depths + shift for shift in (-1e-3, 0, 1e-3, 0.04)], axis=1).reshape(300, -1)
    ray_of = np.repeat(np.arange(300), z.shape[1])
    found = c.power_bounds(rules, b, ray_of, z.ravel(), 0.0, 0.0).reshape(300, -1, 2)
    front = (shares[:, None] * (depths[:, None] < z[..., None])).sum(axis=2)
    with_z = (shares[:, None] * (depths[:, None] <= z[..., None])).sum(axis=2)
    assert (found[..., 0] <= front).all() and (with_z <= found[..., 1]).all()
    assert np.median(found[..., 1] - found[..., 0]) < 1e-3


def test_few_surfaces_are_proven_in_double():
    rng = np.random.default_rng(10)
    for technique in POWER:
        n = technique.count // 2
        share = (np.arange(n) + rng.uniform(0.2, 0.6, (200, n))) / n
        alpha = rng.uniform(0.1, 0.9, share.shape)
        offsets = np.arange(len(share) + 1) * n
        f = moit.Fragments(
            offsets, 100 ** share.ravel(), alpha.ravel(), depth_range=(1, 100), dtype="float64"
        )
        lower, upper = moit.bounds(f, technique)
        assert np.quantile(upper - lower, 0.9) <= 0.01


@cache
def proven(m: int) -> list[tuple[int, int, mpf, mpf]]:
    """(pixel, k, lower, upper) that float32 moments of power_problems prove, without bias."""
    problems = power_problems(m, seed=m, of_each_kind=4, depths=5)
    found = []
    for pixel in range(len(problems.b0)):
        ray = power.biased(problems.b[pixel].tolist(), 0)
        try:
            at = [ray.at(float(z)) for z in problems.z[pixel, :2]]
        except ValueError:
            continue  # rounded moments that are no measure's: nothing to compare with
        with mp.workdps(power.DIGITS):
            total = mpf(float(problems.b0[pixel]))
            for k, one in enumerate(at):
                share = one.lower, one.lower + one.weight
                found.append((pixel, k, mp.exp(-total * share[1]), mp.exp(-total * share[0])))
    return found


@precisions
@pytest.mark.parametrize("m", [4, 6, 8])
def test_bounds_of_moments_hold_what_the_oracle_finds_for_them(m, dtype):
    problems = power_problems(m, seed=m, of_each_kind=4, depths=5)
    arrays = (a.astype(dtype) for a in (problems.b0, problems.b, problems.z))
    lower, upper = moit.moments.bounds(PowerMoments(m), *arrays)
    assert lower.shape == upper.shape == problems.z.shape
    assert lower.dtype == upper.dtype == dtype
    # the weight may make the sum exceed 1 by the oracle's own last digits
    slack = mpf(10) ** -40
    for pixel, k, low, high in proven(m):
        with mp.workdps(power.DIGITS):
            assert mpf(float(lower[pixel, k])) <= low * (1 + slack)
            assert mpf(float(upper[pixel, k])) >= high * (1 - slack)


@precisions
@pytest.mark.parametrize("m", [4, 6, 8])
def test_knowing_a_surface_at_a_depth_narrows_bounds(m, dtype):
    f = scene(hard_rays(seed=12, of_each_kind=2), dtype)
    technique = PowerMoments(m, warp="linear")
    b0, b = moit.moments.gather(f, technique)
    first = f.offsets[:-1]
    near, far = f.depth_range
    z = (2 * (f.depth[first, None] - near) / (far - near) - 1).clip(-1, 1).astype(dtype)
    lower, upper = moit.moments.bounds(technique, b0, b, z)
    alpha = f.alpha[first, None]
    known = moit.moments.bounds(technique, b0, b, z, alpha=alpha)
    # a surface's absorbance, up to 7, has a rounding error of its own
    slack = 7 * (8 * np.finfo(dtype).eps + 1e-12)
    assert (known[0] >= lower * (1 - slack)).all() and (known[1] <= upper * (1 + slack)).all()
    assert np.mean(known[0] > lower) > 0.5
    # alpha 0 says nothing
    same = moit.moments.bounds(technique, b0, b, z, alpha=np.zeros_like(z))
    assert (same[0] == lower).all() and (same[1] == upper).all()


@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_techniques_that_prove_nothing_say_so(technique, dtype):
    # of blocks Moment Transparency proves nothing
    if technique.row["proves_bounds"] and not getattr(technique, "passes", 0) * (
        technique.block_side > 1
    ):
        pytest.skip("proves something, by tests of its own")
    f = coloured(scene(hard_rays(seed=13, of_each_kind=2), dtype))
    lower, upper = moit.bounds(f, technique)
    assert (upper == 1).all()
    total = np.array([float(row[0]) for row in truths(f, [np.inf])])
    # a product of n factors is rounded n times in double, and the bound outward from there
    slack = total * (8 * np.finfo(dtype).eps + 1e-11)
    slack = np.repeat(slack + np.finfo(dtype).tiny, f.counts)
    assert (np.abs(lower - np.repeat(total, f.counts)) <= slack).all()


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_an_empty_pixel_is_proven_clear(technique, dtype):
    f = moit.Fragments([0, 0, 1, 1], [2], [0.5], depth_range=(1, 3), dtype=dtype)
    lower, upper = moit.bounds(f, technique, depth=[1, 2, 3])
    # b0 = 0 too is widened for rounding
    least = 1 - 8 * np.finfo(dtype).eps - 1e-11
    assert (lower[0, [0, 2]] >= least).all() and (upper[0, [0, 2]] == 1).all()
    lower, upper = moit.moments.bounds(
        technique,
        np.zeros(2, dtype),
        np.zeros((2, technique.count), dtype),
        np.zeros((2, 3), dtype),
    )
    assert (lower >= least).all() and (upper == 1).all()


def test_bounds_hang_on_nothing_that_stands_beside_a_pixel():
    """Of every technique whose pixels are their own, to the last bit: tiles may hold any others."""
    rng = np.random.default_rng(5)
    counts = np.array([3, 40, 0, 2, 5, 1, 17, 4])
    n = counts.sum()
    ends = np.concatenate([[0], np.cumsum(counts)])
    depth, alpha = rng.uniform(1, 9, n), rng.uniform(0.1, 0.6, n)
    f = moit.Fragments(ends, depth, alpha, depth_range=(1, 9), dtype="float64")
    for technique in EVERY:
        if not technique.local or technique.engine != "core":
            continue
        bounds = moit.bounds(f, technique, threads=1)
        for first, last in ((0, 1), (3, 6)):
            alone = moit.bounds(f[:, first:last], technique, threads=1)
            for side, own in zip(bounds, alone, strict=True):
                np.testing.assert_array_equal(side[ends[first] : ends[last]], own, str(technique))
