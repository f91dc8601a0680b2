"""Wavelet transparency against the definition: a Haar series of the absorbance in front of x.

The reference projects by inner products with each wavelet, in float64, and knows nothing of trees.
"""

from itertools import pairwise

import numpy as np
import pytest

import moit
from moit import WaveletTransparency

SIZES = [4, 8, 16, 32]
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])
of_every_size = pytest.mark.parametrize("n", SIZES)

# n coefficients of size of the total, each rounded, and sums of log2(n) + 1 of them; the largest
# total here is 20 nepers.
EPSILONS = 64


def absorbance(alpha, max_alpha=1 - 0.5 / 256):
    return -np.log1p(-np.minimum(np.asarray(alpha, float), max_alpha))


def integrals_behind(n, x):
    """(n, len(x)): of the orthonormal Haar basis, each function's integral from x to 1."""
    rows = [1 - x]
    level = 1
    while level < n:
        for k in range(level):
            start, middle, end = k / level, (k + 0.5) / level, (k + 1) / level
            rising = np.clip(middle - x, 0, middle - start)
            falling = np.clip(end - x, 0, end - middle)
            rows.append(np.sqrt(level) * (rising - falling))
        level *= 2
    return np.array(rows)


def basis(n, x):
    """(n, len(x)): values of the orthonormal Haar basis."""
    rows = [np.ones_like(x)]
    level = 1
    while level < n:
        for k in range(level):
            rising = (x >= k / level) & (x < (k + 0.5) / level)
            falling = (x >= (k + 0.5) / level) & (x < (k + 1) / level)
            rows.append(np.sqrt(level) * (rising.astype(float) - falling))
        level *= 2
    return np.array(rows)


def means(n, z, alpha):
    """Of the series over each of n cells, which are its values there."""
    x = np.asarray(z, float) * (n - 1) / n
    coefficients = integrals_behind(n, x) @ absorbance(alpha)
    return coefficients @ basis(n, (np.arange(n) + 0.5) / n)


def reference(n, z, alpha, at):
    """Transmittance in front of `at` in [0, 1], and in all."""
    mean = np.append(means(n, z, alpha), 0)  # so that the mean before the first is 0
    place = np.asarray(at, float) * (n - 1)
    cell = np.floor(place).astype(int)
    inside = place - cell
    return np.exp(-(mean[cell - 1] * (1 - inside) + mean[cell] * inside)), np.exp(-mean[n - 1])


def ray(seed, k=12, dtype=np.float64, **options):
    rng = np.random.default_rng(seed)
    z = rng.random(k).astype(dtype)
    alpha = rng.uniform(0, 0.95, k).astype(dtype)
    return fragments(z, alpha, **options)


def fragments(z, alpha, **options):
    return moit.Fragments([0, len(z)], z, alpha, depth_range=(0, 1), **options)


def of(n, **options):
    return WaveletTransparency(n, warp="none", **options)


@precisions
@of_every_size
def test_transmittance_is_that_of_the_series(n, dtype):
    for seed in range(20):
        f = ray(seed, k=1 + seed, dtype=dtype)
        at = np.linspace(0, 1, 53)
        expected, total = reference(n, f.depth, f.alpha, at.astype(dtype))
        allowed = EPSILONS * np.finfo(dtype).eps
        np.testing.assert_allclose(
            moit.transmittance(f, of(n), depth=at)[0, 0], expected, rtol=0, atol=allowed
        )
        expected, _ = reference(n, f.depth, f.alpha, f.depth)
        np.testing.assert_allclose(moit.transmittance(f, of(n)), expected, rtol=0, atol=allowed)
        assert abs(moit.total_transmittance(f, of(n))[0, 0] - total) <= allowed


@of_every_size
def test_at_cell_boundaries_the_curve_is_the_exact_mean_over_the_cell_before(n):
    """Haar series of whole levels keep the means of all cells: the integral is a Riemann sum's."""
    for seed in range(10):
        f = ray(seed)
        z = np.sort(f.depth)
        s = absorbance(f.alpha)[np.argsort(f.depth)]
        boundaries = np.arange(n) / (n - 1)
        got = -np.log(moit.transmittance(f, of(n), depth=boundaries)[0, 0])
        for k in range(1, n):
            steps = np.clip(z, boundaries[k - 1], boundaries[k])
            share = (boundaries[k] - steps) * (n - 1)  # of the cell that lies behind the surface
            assert abs(got[k] - share @ s) <= 1e-12
        assert got[0] == 0


@precisions
@of_every_size
def test_the_total_is_exact(n, dtype):
    for seed in range(20):
        f = ray(seed, k=30, dtype=dtype)
        exact = np.exp(-absorbance(f.alpha).sum())
        found = moit.total_transmittance(f, of(n))[0, 0]
        assert abs(found / exact - 1) <= EPSILONS * np.finfo(dtype).eps


@precisions
@of_every_size
@pytest.mark.parametrize("options", [{"bits": 16}, {}, {"projected": "density"}])
def test_light_never_grows_along_a_ray(n, dtype, options):
    for seed in range(20):
        f = ray(seed, k=3 + 5 * seed, dtype=dtype)
        T = moit.transmittance(f, of(n, **options), depth=np.linspace(0, 1, 1001))[0, 0]
        total = moit.total_transmittance(f, of(n, **options))[0, 0]
        assert T[0] == 1
        # two roundings of the exponential's argument, which 20 nepers make 20 epsilons each
        assert (np.diff(T) <= 40 * np.finfo(dtype).eps * T[1:]).all()
        assert (T >= total * (1 - 40 * np.finfo(dtype).eps)).all()


def density(n, **options):
    return of(n, projected="density", **options)


@precisions
@of_every_size
def test_the_integral_of_a_series_of_density_is_exact_at_the_ends_of_cells(n, dtype):
    for seed in range(10):
        f = ray(seed, k=30, dtype=dtype)
        ends = np.arange(n + 1) / n
        at = np.concatenate([ends, np.linspace(0, 1, 41)])
        s, z = absorbance(f.alpha), f.depth.astype(float)
        exact = np.array([s[z < end].sum() for end in ends])
        expected = np.interp(at, ends, exact)
        got = moit.transmittance(f, density(n), depth=at)[0, 0]
        allowed = EPSILONS * np.finfo(dtype).eps
        np.testing.assert_allclose(got, np.exp(-expected), rtol=0, atol=allowed)
        alone = np.interp(z, ends, exact) - s * (z * n - np.floor(z * n))
        got = moit.transmittance(f, density(n, exclude_self=True))
        np.testing.assert_allclose(got, np.exp(-alone), rtol=0, atol=allowed)
        total = moit.total_transmittance(f, density(n))[0, 0]
        assert abs(total - np.exp(-s.sum())) <= allowed


def test_surfaces_in_cells_of_their_own_come_back_exactly_from_density():
    for n in SIZES:
        z = (np.arange(n) + 0.3) / n
        alpha = np.linspace(0.1, 0.5, n)
        T = moit.transmittance(fragments(z, alpha), density(n, exclude_self=True))
        np.testing.assert_allclose(T, np.append(1, np.cumprod(1 - alpha)[:-1]), rtol=1e-13)


def errors(technique, surfaces=40, rays=200):
    rng = np.random.default_rng(8)
    z = rng.random(rays * surfaces)
    alpha = rng.uniform(0, 0.1, rays * surfaces)
    f = moit.Fragments(np.arange(rays + 1) * surfaces, z, alpha, depth_range=(0, 1))
    exact = moit.transmittance(f, "sorted")
    return np.abs(moit.transmittance(f, technique) - exact).mean()


def test_twice_the_coefficients_halve_the_error_where_surfaces_are_many():
    """A cell of width h delays what lies in it by h on average, half of it in the cell's mean and
    half on the way to the next."""
    found = [errors(of(n)) for n in SIZES]
    for coarse, fine in pairwise(found):
        assert 0.35 <= fine / coarse <= 0.65


@of_every_size
def test_density_halves_the_error_where_fragments_exclude_themselves(n):
    # nothing is late on average; what remains is that cells are spread out
    assert errors(density(n, exclude_self=True)) <= 0.5 * errors(of(n, exclude_self=True))


def test_two_surfaces_more_than_two_cells_apart_are_exact():
    for n in SIZES:
        cell = 1 / (n - 1)
        for front in np.linspace(0, 1 - 2 * cell - 2e-9, 7):
            f = fragments(np.array([front + 2 * cell + 1e-9, front]), np.array([0.5, 0.7]))
            T = moit.transmittance(f, of(n, exclude_self=True))
            np.testing.assert_allclose(T, [0.3, 1], rtol=0, atol=1e-12)


@precisions
@of_every_size
def test_a_fragment_that_excludes_itself_does_not_occlude_itself(n, dtype):
    rng = np.random.default_rng(3)
    z, alpha = rng.random(500).astype(dtype), rng.random(500).astype(dtype)
    f = moit.Fragments(np.arange(501), z, alpha, depth_range=(0, 1))
    T = moit.transmittance(f, of(n, exclude_self=True), cull_opaque=False)
    np.testing.assert_allclose(T, 1, rtol=0, atol=EPSILONS * np.finfo(dtype).eps)
    place = z.astype(float) * (n - 1)
    inside = place - np.floor(place)
    expected = np.exp(-absorbance(alpha) * inside * (1 - inside))
    published = moit.transmittance(f, of(n), cull_opaque=False)
    np.testing.assert_allclose(published, expected, rtol=0, atol=EPSILONS * np.finfo(dtype).eps)


@precisions
@pytest.mark.parametrize("bits", [16, 32])
def test_alpha_near_0_and_1_keeps_its_size(dtype, bits):
    z = np.array([0.1, 0.9], dtype)
    thin = moit.total_transmittance(fragments(z, np.full(2, 1e-3, dtype)), of(16, bits=bits))
    # half floats of size 1e-3 and below lie at most 2^-21 apart; some five meet in a total
    allowed = 2.5e-6 if bits == 16 else 1e-6
    assert abs(thin[0, 0] - (1 - 1e-3) ** 2) <= allowed
    opaque = fragments(z, np.ones(2, dtype))
    technique = of(16, bits=bits, exclude_self=True)
    T = moit.transmittance(opaque, technique, cull_opaque=False)
    assert abs(T[0] - 1) <= 1e-2 and abs(T[1] - 0.5 / 256) <= 1e-5
    none = moit.transmittance(fragments(z, np.zeros(2, dtype)), of(16, bits=bits))
    assert (none == 1).all()


def half_means(n, z, s):
    """As a half-float target holds them: one fragment after the other, each sum rounded."""
    x = z.astype(np.float64) * (n - 1) / n
    addends = integrals_behind(n, x) * s
    held = np.zeros(n, np.float16)
    for addend in addends.T:
        held = (held.astype(np.float64) + addend).astype(np.float16)
    return held.astype(np.float64) @ basis(n, (np.arange(n) + 0.5) / n)


@of_every_size
def test_half_floats_round_at_every_blend(n):
    exact = 0
    for seed in range(40):
        f = ray(seed, k=40)
        half = half_means(n, f.depth, absorbance(f.alpha))
        expected = np.maximum.accumulate(np.clip(half, 0, half[-1]))
        at = np.arange(1, n) / (n - 1)  # where the curve is a mean
        got = -np.log(moit.transmittance(f, of(n, bits=16), depth=at)[0, 0])
        exact += np.allclose(got, expected[:-1], rtol=0, atol=1e-9)
    # float64's last digit may turn a rounding to half over
    assert exact >= 38


def test_half_floats_depend_on_order_by_their_rounding_only():
    f = ray(5, k=200)
    T = [
        moit.transmittance(f.shuffled(seed), of(16, bits=16), depth=[0.05])[0, 0, 0]
        for seed in range(8)
    ]
    assert 0 < np.ptp(T) <= 200 * 2.0**-11


def test_more_light_than_half_floats_hold_is_none():
    n = 20_000
    f = fragments(np.linspace(0, 1, n), np.full(n, 1 - 1e-9))
    T = moit.transmittance(f, of(8, bits=16, max_alpha=1 - 1e-9))
    assert np.isfinite(T).all() and T[-1] == 0


def test_bits_per_pixel_are_those_of_the_coefficients():
    assert WaveletTransparency(8).bits_per_pixel == 256
    assert WaveletTransparency(16, bits=16).bits_per_pixel == 256
    assert WaveletTransparency(8, depth_range="pixel").bits_per_pixel == 320


@pytest.mark.parametrize(
    "options",
    [{"coefficients": 12}, {"coefficients": 8, "bits": 8}, {"coefficients": 8, "projected": "T"}],
)
def test_what_there_is_not_is_refused(options):
    with pytest.raises(ValueError, match="expected"):
        WaveletTransparency(**options)
