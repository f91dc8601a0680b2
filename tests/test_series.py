"""Fourier opacity maps and transmittance function maps against their definitions."""

import dataclasses

import numpy as np
import pytest
from gpu import software_device
from oracle import series

import moit
from moit import FourierOpacity, TransmittanceFunctionMap

precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
of_fourier = pytest.mark.parametrize("coefficients", [3, 7, 15, 31])
of_functions = pytest.mark.parametrize("coefficients", [1, 2, 8, 32])
excluding = pytest.mark.parametrize("exclude_self", [False, True], ids=["published", "excluding"])

Z = np.linspace(0, 1, 33)

# What sums of n = 31 coefficients, each of a few ulps, may miss beside float64.
EPSILONS = 64


def rays(dtype, seed=1, least=0.05, most=0.95) -> moit.Fragments:
    """Pixels of 0 to 60 surfaces, depths in [0, 1]; some at its ends, some together."""
    rng = np.random.default_rng(seed)
    counts = np.concatenate([[0, 1, 2, 3, 4, 5, 15, 16, 17, 60], rng.integers(0, 40, 20)])
    n = int(counts.sum())
    depth = rng.choice(np.concatenate([[0, 1], rng.random(50)]), n)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        depth,
        rng.uniform(least, most, n),
        rng.random((n, 3)),
        depth_range=(0, 1),
        dtype=dtype,
    )


def pixels(f: moit.Fragments):
    """Depth and alpha of each pixel in float64, and where its fragments are."""
    for start, end in zip(f.offsets, f.offsets[1:], strict=False):
        own = slice(start, end)
        yield own, f.depth[own].astype(np.float64), f.alpha[own].astype(np.float64)


def fourier(*options, **more) -> FourierOpacity:
    return FourierOpacity(*options, warp="none", **more)


def function_map(*options, **more) -> TransmittanceFunctionMap:
    return TransmittanceFunctionMap(*options, warp="none", **more)


def half(x):
    return np.asarray(x).astype(np.float16).astype(np.float64)


# ---- Fourier opacity maps ------------------------------------------------------------------------


@excluding
@of_fourier
@precisions
def test_fourier_transmittance_is_the_published_integral(coefficients, dtype, exclude_self):
    f = rays(dtype)
    technique = fourier(coefficients, bits=32, exclude_self=exclude_self)
    T = moit.transmittance(f, technique)
    curve = moit.transmittance(f, technique, depth=Z)[0]
    total = moit.total_transmittance(f, technique)[0]
    for p, (own, d, alpha) in enumerate(pixels(f)):
        a = -np.log1p(-alpha)
        map = series.fourier(a, d, coefficients)
        expected = series.fourier_transmittance(map, d, a if exclude_self else 0)
        slack = EPSILONS * np.finfo(dtype).eps * max(1, a.sum())
        np.testing.assert_allclose(T[own], expected, rtol=0, atol=slack)
        np.testing.assert_allclose(
            curve[p], series.fourier_transmittance(map, Z), rtol=0, atol=slack
        )
        np.testing.assert_allclose(total[p], np.exp(-a.sum()), rtol=slack)


@of_fourier
@precisions
def test_half_floats_round_after_every_surface(coefficients, dtype):
    f = rays(dtype)
    technique = fourier(coefficients)
    curve = moit.transmittance(f, technique, depth=Z)[0]
    total = moit.total_transmittance(f, technique)[0]
    differs = 0
    for p, (_, d, alpha) in enumerate(pixels(f)):
        map, at_once = np.zeros(coefficients), np.zeros(coefficients)
        for a, x in zip(-np.log1p(-alpha), d, strict=True):
            one = series.fourier(np.array([a]), np.array([x]), coefficients)
            map = half(map + one)
            at_once += one
        differs += (half(at_once) != map).any()
        # a sum that falls between two half floats in one precision may not in the other
        expected = series.fourier_transmittance(map, Z)
        near = np.abs(curve[p] - expected) <= EPSILONS * np.finfo(np.float32).eps
        assert near.mean() > 0.9 or np.abs(curve[p] - expected).max() < 2.0**-9
        assert abs(total[p] - np.exp(-map[0] / 2)) <= 2.0**-9 * total[p] * max(1, map[0])
    assert differs > 10


@precisions
def test_half_floats_lose_thin_layers_behind_much_absorbance(dtype):
    # from a sum of 4 on half floats are 1/256 apart, and less than half of that is nothing
    layers = np.concatenate([np.full(5, 0.6), np.full(1000, 1e-3)])
    f = moit.Fragments([0, 1005], np.linspace(0, 1, 1005), layers, dtype=dtype)
    exact = moit.total_transmittance(f, "sorted")[0, 0]
    wide = moit.total_transmittance(f, fourier(15, bits=32))[0, 0]
    narrow = moit.total_transmittance(f, fourier(15))[0, 0]
    front_last = moit.total_transmittance(
        moit.Fragments([0, 1005], f.depth[::-1], layers[::-1], dtype=dtype), fourier(15)
    )[0, 0]
    np.testing.assert_allclose(wide, exact, rtol=1e-5)
    assert narrow > 2 * exact
    assert front_last != narrow


@precisions
def test_without_rounding_to_half_floats_the_order_hardly_shows(dtype):
    f = rays(dtype)
    for technique in (fourier(15, bits=32), function_map(8, bits=32)):
        found = moit.transmittance(f, technique, depth=Z)
        other = moit.transmittance(f.shuffled(3), technique, depth=Z)
        np.testing.assert_allclose(found, other, rtol=0, atol=EPSILONS * np.finfo(dtype).eps)


@precisions
def test_half_floats_stay_finite(dtype):
    n = 20_000
    f = moit.Fragments([0, n], np.linspace(0, 1, n), np.full(n, 1 - 2.0**-24), dtype=dtype)
    technique = fourier(7, max_alpha=1 - 2.0**-24)
    for T in (
        moit.transmittance(f, technique),
        moit.transmittance(f, technique, depth=Z),
        moit.total_transmittance(f, technique),
    ):
        assert ((T >= 0) & (T <= 1)).all()


def smooth_medium(layers: int) -> moit.Fragments:
    """A puff whose density and its slope vanish at the ends of the range."""
    d = (np.arange(layers) + 0.5) / layers
    density = 30 * d**2 * (1 - d) ** 2
    return moit.Fragments(
        [0, layers], d, -np.expm1(-2 * density / layers), depth_range=(0, 1), dtype=np.float64
    )


def test_harmonics_make_a_smooth_medium_right():
    f = smooth_medium(2000)
    z = np.linspace(0, 1, 101)
    truth = moit.transmittance(f, "sorted", depth=z)
    errors = [
        np.abs(moit.transmittance(f, fourier(n, bits=32), depth=z) - truth).max()
        for n in (3, 7, 15, 31)
    ]
    # the second derivative of the density jumps where the period ends: its series falls as 1 / k^3
    # and the integral's rest as 1 / k^3, until the layers' own steps, 2 / 2000, are what is left
    assert errors[0] < 0.03
    assert errors[1] < errors[0] / 4
    assert max(errors[2:]) < 2 * 2 / 2000


def test_the_error_at_steps_falls_as_one_over_the_harmonics():
    rng = np.random.default_rng(5)
    n = 400
    d = rng.uniform(0.1, 0.9, n)
    f = moit.Fragments(np.arange(n + 1), d, np.full(n, 0.9), depth_range=(0, 1), dtype=np.float64)
    at = np.linspace(0, 1, 201)
    truth = -np.log(np.where(d[:, None] < at, 0.1, 1))
    squared = []
    for coefficients in (3, 7, 15, 31):
        T = moit.transmittance(f, fourier(coefficients, bits=32), depth=at)[0]
        squared.append(((-np.log(T) - truth) ** 2).mean() * (coefficients // 2))
    # Parseval: the rest of the series of a step has energy sum over k > n of 1 / (2 pi^2 k^2) =
    # 1 / (2 pi^2 n); clamping takes some of it away
    assert max(squared) < 1.3 * min(squared)


@precisions
@pytest.mark.parametrize("coefficients", [3, 7, 15, 31])
def test_a_homogeneous_medium_comes_back_whatever_the_coefficients(dtype, coefficients):
    # its extinction is the mean alone: N layers at (i + 1/2) / N cancel in all harmonics k < N
    n = 64
    f = moit.Fragments([0, n], (np.arange(n) + 0.5) / n, np.full(n, 0.03), depth_range=(0, 1),
                       dtype=dtype)  # fmt: skip
    found = moit.transmittance(f, fourier(coefficients, bits=32), depth=Z)[0, 0]
    np.testing.assert_allclose(found, 0.97 ** (n * Z), atol=EPSILONS * np.finfo(dtype).eps)


def test_fourier_rings_beside_a_surface_but_stays_between_total_and_1():
    f = moit.Fragments([0, 1], [0.5], [0.9], depth_range=(0, 1), dtype=np.float64)
    at = np.linspace(0, 1, 401)
    for coefficients in (7, 15):
        T = moit.transmittance(f, fourier(coefficients, bits=32), depth=at)[0, 0]
        assert np.diff(T).max() > 1e-3  # light grows with depth, which is no transmittance
        assert T.max() == 1 and abs(T.min() - 0.1) < 1e-12
        # the surface itself is in the middle of its step
        assert abs(T[200] - 0.1**0.5) < 1e-12
        # unclamped, absorbance overshoots by Gibbs' 9 % of the step
        map = series.fourier(np.array([-np.log(0.1)]), np.array([0.5]), coefficients)
        beyond = series.fourier_absorbance(map, at).max() / -np.log(0.1) - 1
        assert 0.05 < beyond < 0.095


def test_a_surface_at_one_end_of_the_period_shows_at_the_other():
    f = moit.Fragments([0, 1], [1], [0.9], depth_range=(0, 1), dtype=np.float64)
    T = moit.transmittance(f, fourier(15, bits=32), depth=[0, 0.25, 0.5, 0.75, 1])[0, 0]
    # half the step at 0, half at 1
    np.testing.assert_allclose(T, [1, 0.1**0.5, 0.1**0.5, 0.1**0.5, 0.1], rtol=0.07)


# ---- Transmittance function maps -----------------------------------------------------------------


@of_functions
@precisions
def test_functions_are_the_projection_of_the_exact_steps(coefficients, dtype):
    f = rays(dtype)
    technique = function_map(coefficients, bits=32)
    T = moit.transmittance(f, technique)
    curve = moit.transmittance(f, technique, depth=Z)[0]
    total = moit.total_transmittance(f, technique)[0]
    for p, (own, d, alpha) in enumerate(pixels(f)):
        c = series.projection(alpha, d, coefficients)
        least = series.steps(alpha, d)[1]
        slack = EPSILONS * np.finfo(dtype).eps
        expected = np.clip(series.function(c, d), least, 1)
        np.testing.assert_allclose(T[own], expected, rtol=0, atol=slack)
        expected = np.clip(series.function(c, Z), least, 1)
        np.testing.assert_allclose(curve[p], expected, rtol=0, atol=slack)
        np.testing.assert_allclose(total[p], least, rtol=slack)


@of_functions
@precisions
def test_functions_in_half_floats_are_within_their_rounding(coefficients, dtype):
    f = rays(dtype)
    narrow, wide = (function_map(coefficients, bits=bits) for bits in (16, 32))
    found = moit.transmittance(f, narrow, depth=Z)
    # coefficients are in [-1, 1], off by 2^-12 of themselves
    slack = 2.0**-12 * np.sqrt(2) * coefficients
    assert np.abs(found - moit.transmittance(f, wide, depth=Z)).max() <= slack
    total = moit.total_transmittance(f, wide).astype(float)
    assert (moit.total_transmittance(f, narrow).astype(float) == half(total.astype(dtype))).all()


def test_a_function_that_is_a_sum_of_its_cosines_is_exact():
    # 1/2 + 1/3 cos(pi d) as steps of 1 / n: projecting n midpoints' steps is off by 1 / n^2
    n = 4000
    edges = np.arange(1, n) / n
    level = 0.5 + np.cos(np.pi * (np.arange(n) + 0.5) / n) / 3
    level[0] = 1  # fragments can only take away from 1
    f = moit.Fragments([0, n - 1], edges, 1 - level[1:] / level[:-1], depth_range=(0, 1),
                       dtype=np.float64)  # fmt: skip
    z = np.linspace(0.01, 0.99, 99)
    for coefficients in (2, 8):
        T = moit.transmittance(f, function_map(coefficients, bits=32), depth=z)
        # the first step's extra 1/6 over 1 / n adds 1 / (6 n) to each of the coefficients
        slack = (1 + 2 * (coefficients - 1)) / (6 * n) + 1e-6
        np.testing.assert_allclose(T[0, 0], 0.5 + np.cos(np.pi * z) / 3, atol=slack)


@of_functions
def test_no_other_cosines_are_nearer_in_the_mean_square(coefficients):
    rng = np.random.default_rng(7)
    d, alpha = np.sort(rng.uniform(0.1, 0.9, 6)), rng.uniform(0.1, 0.6, 6)
    f = moit.Fragments([0, 6], d, alpha, depth_range=(0, 1), dtype=np.float64)
    z = (np.arange(4000) + 0.5) / 4000
    truth = moit.transmittance(f, "sorted", depth=z)[0, 0]
    least, _, _, _ = np.linalg.lstsq(series.basis(coefficients, z).T, truth, rcond=None)
    total = series.steps(alpha, d)[1]
    T = moit.transmittance(f, function_map(coefficients, bits=32), depth=z)[0, 0]
    nearest = np.clip(series.function(least, z), total, 1)
    # sampled at midpoints each of 6 steps is off by half a 4000th
    np.testing.assert_allclose(T, nearest, atol=coefficients * 6 / 4000)
    # Parseval: what the coefficients lack of the energy of T is the error
    c = series.projection(alpha, d, coefficients)
    rest = (truth**2).mean() - (c**2).sum()
    error = ((series.function(c, z) - truth) ** 2).mean()
    assert abs(rest - error) < 1e-3
    assert ((T - truth) ** 2).mean() <= error + 1e-12  # clamping only helps


def test_more_cosines_are_nearer():
    rng = np.random.default_rng(8)
    n = 300
    f = moit.Fragments(np.arange(n + 1) * 5, rng.random(5 * n), rng.uniform(0.1, 0.6, 5 * n),
                       depth_range=(0, 1), dtype=np.float64)  # fmt: skip
    z = np.linspace(0, 1, 101)
    truth = moit.transmittance(f, "sorted", depth=z)
    errors = [
        ((moit.transmittance(f, function_map(k, bits=32), depth=z) - truth) ** 2).mean()
        for k in (1, 2, 4, 8, 16, 32)
    ]
    # c_k of steps falls as 1 / k, so the error halves with every doubling
    assert (np.diff(errors) < -0.35 * np.array(errors[:-1])).all()


# ---- Both ----------------------------------------------------------------------------------------

BOTH = [fourier(7), fourier(15, bits=32), function_map(8),
        function_map(8, bits=32)]  # fmt: skip
of_both = pytest.mark.parametrize("technique", BOTH, ids=str)


def of_options(technique, **options):
    return dataclasses.replace(technique, **options)


@of_both
@precisions
def test_a_lone_surface_that_excludes_itself_is_not_occluded(technique, dtype):
    alpha = np.array([0, 1e-3, 0.3, 0.9, 0.99])
    d = np.linspace(0, 1, 21)
    f = moit.Fragments(
        np.arange(106), np.repeat(d, 5), np.tile(alpha, 21), depth_range=(0, 1), dtype=dtype
    )
    found = moit.transmittance(f, of_options(technique, exclude_self=True))
    # half floats keep 11 bits of each of the coefficients; what is left of alpha .99 magnifies
    slack = 0.02 if technique.bits == 16 else 1000 * np.finfo(dtype).eps
    np.testing.assert_allclose(found, 1, atol=slack)
    published = moit.transmittance(f, technique)
    inside = (f.depth > 0.01) & (f.depth < 0.99)  # at one end the whole step is behind
    assert published[inside & (f.alpha > 0.5)].max() < 0.7


@of_both
@precisions
def test_thin_layers_pass_light_and_are_not_dropped(technique, dtype):
    for alpha in (1e-3, 1e-6):
        f = moit.Fragments([0, 1], [0.5], [alpha], [[1, 1, 1]], depth_range=(0, 1), dtype=dtype)
        coverage = 1 - float(moit.total_transmittance(f, technique)[0, 0])
        # half floats near 1 are 2^-11 apart below, near 1e-6 they are 2^-24 apart
        slack = 2.0**-12 if technique.bits == 16 else np.finfo(dtype).eps
        assert abs(coverage - alpha) <= slack
        assert abs(moit.transmittance(f, technique)[0] - 1) <= alpha + slack


@of_both
@precisions
def test_opaque_layers_that_are_not_culled_stop_the_light(technique, dtype):
    f = moit.Fragments([0, 2], [0.25, 0.75], [1, 0.5], [[1, 0, 0], [0, 1, 0]],
                       depth_range=(0, 1), dtype=dtype)  # fmt: skip
    total = moit.total_transmittance(f, technique, cull_opaque=False)[0, 0]
    least = 0.5 * (1 - technique.max_alpha if isinstance(technique, FourierOpacity) else 0)
    assert abs(total - least) < 1e-5
    T = moit.transmittance(f, technique, cull_opaque=False)
    assert T[0] > T[1] >= total and T[1] < 0.25
    alone = moit.transmittance(f, of_options(technique, exclude_self=True), cull_opaque=False)
    assert ((alone >= 0) & (alone <= 1)).all() and alone[0] > 0.7


def clouds_and_surfaces(seed: int, pixels: int = 500) -> moit.Fragments:
    """A cloud of 20 to 60 thin fragments and 1 to 4 surfaces a pixel, in any order."""
    rng = np.random.default_rng(seed)
    depth, alpha, pixel = [], [], []
    for p in range(pixels):
        thin, surfaces = rng.integers(20, 61), rng.integers(1, 5)
        puff = rng.normal(rng.uniform(0.2, 0.8), rng.uniform(0.02, 0.2), thin)
        order = rng.permutation(thin + surfaces)
        depth.append(np.concatenate([np.clip(puff, 0, 1), rng.random(surfaces)])[order])
        opacity = [rng.uniform(0.01, 0.08, thin), rng.uniform(0.2, 0.9, surfaces)]
        alpha.append(np.concatenate(opacity)[order])
        pixel.append(np.full(thin + surfaces, p))
    depth, alpha, pixel = map(np.concatenate, (depth, alpha, pixel))
    color = rng.random((len(depth), 3))
    return moit.Fragments.from_pixels(pixel, depth, alpha, color, shape=(1, pixels))


def test_errors_are_those_of_another_implementation():
    # a prototype in NumPy, on other pixels of this kind, had root mean square errors of T and of
    # colour of .0714 and .0286 with 15 coefficients, .0507 and .0111 without occlusion by itself
    f = clouds_and_surfaces(seed=9)
    background = np.random.default_rng(10).random((1, len(f.counts), 3))
    truth = moit.transmittance(f, "sorted")
    image = moit.composite(f, "sorted", background=background)[..., :3]
    errors = []
    for exclude_self, of_T in ((False, 0.0714), (True, 0.0507)):
        technique = fourier(15, exclude_self=exclude_self)
        T = moit.transmittance(f, technique)
        # 500 pixels, each with its own cloud: a few percent beside the mean
        assert abs(np.sqrt(((T - truth) ** 2).mean()) / of_T - 1) < 0.1
        found = moit.composite(f, technique, background=background)[..., :3]
        errors.append(np.sqrt(((found - image) ** 2).mean()))
    # few pixels make most of the colours' errors: these vary by a quarter
    assert 0.02 < errors[0] < 0.035 and errors[1] < 0.6 * errors[0]


@of_both
def test_surfaces_that_exclude_themselves_are_nearer(technique):
    f = clouds_and_surfaces(seed=11)
    truth = moit.transmittance(f, "sorted")
    image = moit.composite(f, "sorted")
    errors = []
    for exclude_self in (False, True):
        asked = of_options(technique, exclude_self=exclude_self)
        T = np.abs(moit.transmittance(f, asked) - truth).mean()
        errors.append([T, np.abs(moit.composite(f, asked) - image).mean()])
    assert (np.array(errors[1]) < 0.95 * np.array(errors[0])).all()


# ---- Options -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: FourierOpacity(8), "coefficients.*odd.*8"),
        (lambda: FourierOpacity(1), "coefficients.*3 to 31.*1"),
        (lambda: FourierOpacity(33), "coefficients.*3 to 31.*33"),
        (lambda: FourierOpacity(7, bits=8), "bits.*16, 32.*8"),
        (lambda: TransmittanceFunctionMap(0), "coefficients.*1 to 32.*0"),
        (lambda: TransmittanceFunctionMap(8, bits=64), "bits.*16, 32.*64"),
        (lambda: moit.technique("fourier8"), "fourier8.*fourier"),
        (lambda: moit.technique("fourier7(coefficients=15)"), "coefficients.*7.*15"),
    ],
)
def test_bad_options_are_refused_with_what_was_needed(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("value", [7.0, "7", None, True])
def test_coefficients_are_counted_in_integers(value):
    for make in (FourierOpacity, TransmittanceFunctionMap):
        with pytest.raises(TypeError, match=r"coefficients.*integer"):
            make(value)


def test_every_number_of_coefficients_has_a_name():
    for coefficients in range(3, 32, 2):
        technique = FourierOpacity(np.int64(coefficients))
        assert str(technique) == f"fourier{coefficients}"
        assert moit.technique(str(technique)) == technique
    for coefficients in range(1, 33):
        technique = TransmittanceFunctionMap(coefficients, exclude_self=True)
        assert moit.technique(str(technique)) == technique


def test_bits_are_those_of_the_table():
    assert FourierOpacity(7).bits_per_pixel == 112
    assert FourierOpacity(15).bits_per_pixel == 240
    assert FourierOpacity(15).published_bits == {"MBOIT": 240}
    assert FourierOpacity(15, bits=32, depth_range="pixel").bits_per_pixel == 15 * 32 + 64
    assert TransmittanceFunctionMap(8).bits_per_pixel == 9 * 16


# ---- GLSL ----------------------------------------------------------------------------------------


@excluding
@precisions
@pytest.mark.parametrize(
    "technique", [fourier(7), fourier(15), function_map(8, 16), function_map(8, 32)], ids=str
)
def test_series_are_the_same_bits_in_glsl(technique, dtype, exclude_self):
    f, technique = rays(dtype), dataclasses.replace(technique, exclude_self=exclude_self)
    found = moit.transmittance(f, technique, device=software_device(), exact=True)
    expected = moit.transmittance(f, technique)
    if dtype is np.float64 and technique == function_map(8, 32, exclude_self=exclude_self):
        # C adds up doubles in another order, which its float32 does not show
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)
    else:
        np.testing.assert_array_equal(found, expected)
