"""Stochastic transparency and hashed alpha testing: right on the mean, and never by accident.

Means over seeds are compared at so many standard errors that a right implementation fails once in
thousands of changes of the hash; seeds are fixed, so what passes once passes always.
"""

import numpy as np
import pytest
from gpu import software_device
from readings import c

import moit
from moit import HashedAlpha, Stochastic

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
masks = pytest.mark.parametrize("stratified", [False, True], ids=["by chance", "stratified"])

STANDARD_ERRORS = 4.5  # of some hundred means: by chance once in a thousand


def pixels(n=400, layers=6, seed=0, dtype="float32", **options) -> moit.Fragments:
    """n pixels of as many fragments at distinct depths, in random order."""
    rng = np.random.default_rng(seed)
    count = n * layers
    return moit.Fragments(
        np.arange(n + 1) * layers,
        rng.uniform(1, 9, count),
        rng.uniform(0.05, 0.9, count),
        rng.random((count, 3)),
        dtype=dtype,
        **options,
    )


def repeated(times: int, depth, alpha, color=None) -> moit.Fragments:
    """One ray in many pixels, each of which draws other lots."""
    color = np.ones((len(depth), 3)) if color is None else np.asarray(color)
    return moit.Fragments(
        np.arange(times + 1) * len(depth),
        np.tile(np.asarray(depth, float), times),
        np.tile(np.asarray(alpha, float), times),
        np.tile(color, (times, 1)),
    )


def assert_mean_is(found: np.ndarray, exact: np.ndarray, slack: float = 1e-6) -> None:
    """found (draws, ...) has the mean `exact`."""
    found = found.astype(float)
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    assert (np.abs(found.mean(axis=0) - exact) <= STANDARD_ERRORS * error + slack).all()


RAY = np.array([3.0, 1.0, 7.0, 5.0, 2.0]), np.array([0.3, 0.6, 0.9, 0.02, 0.15])
UNBIASED = [
    *(Stochastic(s, stratified=m, normalize=False) for s in (1, 3, 8, 64) for m in (False, True)),
    HashedAlpha(),
]


@pytest.mark.parametrize("technique", UNBIASED, ids=str)
@precisions
def test_transmittance_and_images_are_exact_on_the_mean(technique, dtype):
    times = 6000
    f = repeated(times, *RAY, np.random.default_rng(1).random((5, 3)))
    one = f[:1, :1]
    T = moit.transmittance(f, technique, dtype=dtype).reshape(times, -1)
    assert_mean_is(T, moit.transmittance(one, "sorted"))
    at = np.array([0.5, 1, 1.5, 2.5, 4, 6, 7])
    curve = moit.transmittance(f, technique, depth=at, dtype=dtype)[0]
    assert_mean_is(curve, moit.transmittance(one, "sorted", depth=at)[0, 0])
    image = moit.composite(f, technique, background=(0.2, 0.5, 0.1), dtype=dtype)[0]
    assert_mean_is(image, moit.composite(one, "sorted", background=(0.2, 0.5, 0.1))[0, 0])
    total = moit.total_transmittance(f, technique, dtype=dtype)[0]
    assert_mean_is(total, moit.total_transmittance(one, "sorted")[0, 0])


@pytest.mark.parametrize("technique", UNBIASED, ids=str)
def test_the_mean_over_seeds_is_exact_too(technique):
    f = moit.Fragments([0, 5], *RAY, np.random.default_rng(1).random((5, 3)))
    kind = type(technique)
    options = {} if kind is HashedAlpha else {
        "samples": technique.samples, "stratified": technique.stratified, "normalize": False
    }  # fmt: skip
    drawn = [kind(seed=seed, **options) for seed in range(2000)]
    assert_mean_is(
        np.array([moit.transmittance(f, one) for one in drawn]), moit.transmittance(f, "sorted")
    )
    assert_mean_is(np.array([moit.composite(f, one) for one in drawn]), moit.composite(f, "sorted"))


@masks
@pytest.mark.parametrize("normalize", [False, True])
def test_the_squared_error_falls_as_one_over_the_samples(stratified, normalize):
    f = pixels(3000)
    exact = moit.composite(f, "sorted")
    samples = np.array([1, 2, 4, 8, 16, 32, 64])
    error = []
    for s in samples:
        technique = Stochastic(int(s), stratified=stratified, normalize=normalize)
        error.append(np.mean((moit.composite(f, technique) - exact) ** 2))
    # A mean of 9000 squares is known to a few percent, the slope over a range of 64 to about .02;
    # the quotient of normalize matters where samples are few.
    used = slice(2, None) if normalize else slice(None)
    slope = np.polyfit(np.log(samples[used]), np.log(error[used]), 1)[0]
    if stratified:  # what hides one surface behind another alone falls as the square
        assert -1.5 < slope < -1
    else:
        assert abs(slope + 1) < 0.05


def test_samples_by_chance_have_the_variance_of_a_binomial():
    times = 40_000
    f = repeated(times, *RAY)
    exact = moit.transmittance(f[:1, :1], "sorted")
    for samples in (1, 4, 8):
        technique = Stochastic(samples, stratified=False)
        T = moit.transmittance(f, technique).reshape(times, -1)
        # the variance of 40,000 draws is known to 2 % at three standard errors, more for rare ones
        np.testing.assert_allclose(
            T.var(axis=0), exact * (1 - exact) / samples, rtol=0.06, atol=1e-9
        )


def test_stratified_masks_are_less_noisy():
    f = pixels(4000)
    exact = moit.transmittance(f, "sorted")

    def error(samples, **options):
        found = moit.transmittance(f, Stochastic(samples, **options))
        return np.mean((found - exact) ** 2)

    for samples in (4, 8, 16, 64):
        assert error(samples, stratified=True) < 0.7 * error(samples, stratified=False)
    # with one sample there is nothing to stratify
    assert error(1, stratified=True) == pytest.approx(error(1, stratified=False), rel=0.05)


def test_behind_one_surface_stratified_samples_are_off_by_less_than_one():
    f = repeated(3000, [1, 2], [0.37, 0.5])
    for samples in (1, 5, 8, 33):
        T = moit.transmittance(f, Stochastic(samples))[1::2]
        assert np.abs(T - 0.63).max() < 1 / samples
        covered = samples * (1 - np.unique(T))
        wanted = 0.37 * samples
        assert np.allclose(covered, [np.ceil(wanted), np.floor(wanted)], atol=1e-4)


def test_normalizing_lowers_the_error_and_keeps_little_bias():
    times = 60_000
    f = repeated(times, *RAY, np.random.default_rng(1).random((5, 3)))
    exact = moit.composite(f[:1, :1], "sorted")[0, 0, :3]
    bias = {}
    for samples in (2, 8, 32):
        error = {}
        for normalize in (False, True):
            technique = Stochastic(samples, normalize=normalize)
            found = moit.composite(f, technique)[0, :, :3].astype(float)
            error[normalize] = np.mean((found - exact) ** 2)
        assert error[True] < error[False]
        bias[samples] = np.abs(found.mean(axis=0) - exact).max()
    # 1/samples, known to some 5e-4
    assert bias[8] < bias[2] / 2.5 and bias[32] < bias[8] / 2 + 5e-4
    assert bias[8] < 0.01


def test_the_total_is_exact_with_samples_and_nothing_or_all_with_an_alpha_test():
    f = pixels()
    exact = moit.total_transmittance(f, "sorted")
    np.testing.assert_allclose(moit.total_transmittance(f, Stochastic(2)), exact, rtol=1e-6)
    np.testing.assert_array_equal(
        moit.composite(f, Stochastic(2))[..., 3], moit.composite(f, "sorted")[..., 3]
    )
    hashed = moit.total_transmittance(f, HashedAlpha())
    assert set(np.unique(hashed)) == {0, 1}
    assert set(np.unique(moit.transmittance(f, HashedAlpha()))) == {0, 1}


def test_an_alpha_test_shows_the_nearest_fragment_that_passes():
    f = pixels(500, layers=9)
    image = moit.composite(f, HashedAlpha(), background=(7, 8, 9))[0]
    T = moit.transmittance(f, HashedAlpha()).reshape(500, 9)
    depth, color = f.depth.reshape(500, 9), f.color.reshape(500, 9, 3)
    for p in range(500):
        # what lies deepest of what is still seen is what hides the rest
        seen = np.flatnonzero(T[p] == 1)
        last = seen[np.argmax(depth[p, seen])]
        if image[p, 3] == 0:
            assert len(seen) == 9 and image[p, :3].tolist() == [7, 8, 9]
        else:
            assert (image[p, :3] == color[p, last]).all()
            assert (T[p, depth[p] > depth[p, last]] == 0).all()


def test_an_alpha_test_is_stochastic_transparency_with_one_sample():
    f = pixels()
    for seed in (0, 5):
        np.testing.assert_array_equal(
            moit.transmittance(f, HashedAlpha(seed)),
            moit.transmittance(f, Stochastic(1, seed=seed, stratified=False)),
        )


RANDOM = [t for t in moit.techniques() if t.random] + [Stochastic(8, stratified=False)]


@pytest.mark.parametrize("technique", RANDOM, ids=str)
@precisions
def test_what_is_clear_is_never_seen_and_what_is_opaque_always(technique, dtype):
    depth, alpha = [3, 1, 2, 4], [1, 0, 1, 0.5]
    color = np.eye(4)[:, :3]
    many = repeated(2000, depth, alpha, color)
    for cull_opaque in (True, False):
        T = moit.transmittance(many, technique, cull_opaque=cull_opaque, dtype=dtype)
        assert (T.reshape(-1, 4) == [0, 1, 1, 0]).all()
        image = moit.composite(many, technique, cull_opaque=cull_opaque, dtype=dtype)
        assert (image == [0, 0, 1, 1]).all()


@pytest.mark.parametrize("technique", RANDOM, ids=str)
def test_thin_fragments_are_seen_as_often_as_they_should_be(technique):
    f = repeated(200_000, [1, 2], [1e-3, 0.5])
    # the mean over pixels of a share of samples, with 200 or more events
    behind = 1 - moit.transmittance(f, technique)[1::2].astype(float)
    assert_mean_is(behind, np.array(1e-3))


@pytest.mark.parametrize("technique", RANDOM, ids=str)
@precisions
def test_equal_fragments_draw_lots_of_their_own(technique, dtype):
    # with one lot for all, half of the light would come through
    times = 4000
    f = repeated(times, [1, 1, 1, 2], [0.5, 0.5, 0.5, 0.5])
    T = moit.transmittance(f, technique, dtype=dtype).reshape(times, 4)
    assert (T[:, :3] == 1).all()
    assert_mean_is(T[:, 3], np.array(0.125))


@pytest.mark.parametrize("technique", RANDOM, ids=str)
def test_a_hundred_equal_fragments_draw_lots_of_their_own(technique):
    times = 2000
    f = repeated(times, [*np.ones(100), 2], [*np.full(100, 0.01), 0.5])
    T = moit.transmittance(f, technique).reshape(times, 101)[:, 100]
    assert_mean_is(T, np.array(0.99**100))


@pytest.mark.parametrize("technique", RANDOM, ids=str)
@precisions
def test_arrival_order_changes_no_lot(technique, dtype):
    rng = np.random.default_rng(2)
    n = 20
    depth = rng.choice([1.0, 2.0, 3.0, 4.0], (300, n))
    alpha = rng.choice([0.1, 0.5], (300, n))
    turned = rng.permuted(np.tile(np.arange(n), (300, 1)), axis=1)

    def T(order):
        z, a = (np.take_along_axis(x, order, axis=1) for x in (depth, alpha))
        f = moit.Fragments(np.arange(301) * n, z.ravel(), a.ravel(), dtype=dtype)
        return moit.transmittance(f, technique).reshape(300, n)

    plain = T(np.tile(np.arange(n), (300, 1)))
    np.testing.assert_array_equal(T(turned), np.take_along_axis(plain, turned, axis=1))


@pytest.mark.parametrize("technique", RANDOM, ids=str)
def test_the_same_numbers_draw_the_same_lots_in_both_precisions(technique):
    f = pixels(2000)
    single, double = (moit.transmittance(f, technique, dtype=t) for t in ("f4", "f8"))
    np.testing.assert_array_equal(single, double.astype("f4"))


def test_another_seed_draws_other_lots_and_the_same_the_same():
    f = pixels()
    for kind in (lambda seed: Stochastic(8, seed=seed), HashedAlpha):
        first = moit.transmittance(f, kind(0))
        np.testing.assert_array_equal(moit.transmittance(f, kind(0)), first)
        others = [moit.transmittance(f, kind(seed)) for seed in (1, 2, 2**31 - 1)]
        for other in others:
            assert np.mean(first != other) > 0.1
            residual = [x - moit.transmittance(f, "sorted") for x in (first, other)]
            # of 400 independent pixels; 0.05 is a standard error
            assert abs(np.corrcoef(*residual)[0, 1]) < 0.2


@pytest.mark.parametrize("technique", RANDOM, ids=str)
def test_lots_belong_to_the_place_in_the_display(technique):
    f = pixels(15 * 20, shape=(15, 20), origin=(-3, 100))
    T = moit.transmittance(f, technique)
    part = f[4:9, 7:15]
    inside = np.zeros((15, 20), bool)
    inside[4:9, 7:15] = True
    np.testing.assert_array_equal(
        moit.transmittance(part, technique), T[np.repeat(inside.ravel(), f.counts)]
    )
    moved = pixels(15 * 20, shape=(15, 20), origin=(-2, 100))
    assert (moit.transmittance(moved, technique) != T).any()


def test_wrong_options_are_refused():
    for samples in (0, 65, -1):
        with pytest.raises(ValueError, match="samples: expected an integer from 1 to 64"):
            Stochastic(samples)
    for seed in (-1, 2**31):
        with pytest.raises(ValueError, match="seed: expected an integer from 0 to 2147483647"):
            HashedAlpha(seed)
    for wrong in (1.5, "8", None, True):
        with pytest.raises(TypeError, match="samples: expected an integer"):
            Stochastic(wrong)
    with pytest.raises(TypeError, match="stratified: expected True or False"):
        Stochastic(8, stratified=1)
    assert Stochastic(np.int64(8), seed=np.uint8(3)) == Stochastic(8, seed=3)


def test_names_and_bits():
    assert str(Stochastic(8)) == "stochastic8"
    assert str(Stochastic(3, seed=7, stratified=False)) == "stochastic3(seed=7,stratified=False)"
    assert moit.technique("hashed-alpha(seed=4)") == HashedAlpha(4)
    assert moit.technique("stochastic8(seed=4)") == Stochastic(8, seed=4)
    assert Stochastic(8).bits_per_pixel == 256
    assert HashedAlpha().bits_per_pixel == 32


# ---- Hashes ------------------------------------------------------------------------------------


def python_mixed(h: int) -> int:
    """Appleby's fmix32."""
    h ^= h >> 16
    h = h * 0x85EBCA6B % 2**32
    h ^= h >> 13
    h = h * 0xC2B2AE35 % 2**32
    return h ^ h >> 16


def test_the_hash_is_murmurs_finalizer():
    words = np.array([0, 1, 2, 0xDEADBEEF, 2**32 - 1], np.uint32)
    assert c.mixed(words).tolist() == [python_mixed(int(h)) for h in words]


def chi_square(counts: np.ndarray) -> float:
    """How many standard deviations the chi-square statistic of equal chances is too large."""
    expected = counts.sum() / counts.size
    freedom = counts.size - 1
    return float(((counts - expected) ** 2 / expected).sum() - freedom) / np.sqrt(2 * freedom)


def neighbours(dtype) -> np.ndarray:
    """(16, 64, 64, 8) shares: fragments at close depths in a block of pixels, 8 numbers each."""
    layer, y, x = np.meshgrid(np.arange(16), np.arange(64), np.arange(64), indexing="ij")
    depth = (1 + layer * np.finfo(np.float32).eps).astype(dtype)
    keys = c.fragment_keys(3, y, x, depth, np.full(depth.shape, 0.5, dtype))
    return c.random_shares(dtype, keys.ravel(), 8).reshape(*keys.shape, 8)


@precisions
def test_random_numbers_are_uniform_and_independent_of_their_neighbours(dtype):
    u = neighbours(np.dtype(dtype))
    assert u.min() >= 0 and u.max() < 1
    cell = (u * 16).astype(int)
    assert abs(chi_square(np.bincount((u.ravel() * 256).astype(int), minlength=256))) < 5
    for axis, name in enumerate(("fragment", "row", "column", "sample")):
        for step in (1, 2, 4):
            here = cell.take(np.arange(u.shape[axis] - step), axis)
            there = cell.take(np.arange(step, u.shape[axis]), axis)
            pairs = np.bincount((16 * here + there).ravel(), minlength=256)
            assert abs(chi_square(pairs)) < 5, (name, step)


def test_keys_of_seeds_rows_and_columns_do_not_stand_for_each_other():
    y, x = np.meshgrid(np.arange(64), np.arange(64), indexing="ij")
    one = np.ones(y.shape, np.float32)
    keys = [c.fragment_keys(seed, y, x, one, one) for seed in range(8)]
    assert len(np.unique(keys)) >= 8 * 64 * 64 - 3  # 2^15 keys of 32 bits: 0.1 pairs expected


@masks
@precisions
@pytest.mark.parametrize("samples", [1, 7, 32, 33, 64])
def test_each_sample_is_covered_with_probability_alpha(samples, stratified, dtype):
    n = 20_000
    keys = np.arange(n, dtype=np.uint32)
    for share in (0.0, 0.03, 0.5, 0.91, 1.0):
        alpha = np.full(n, share, dtype)
        covered = c.coverages(keys, np.zeros(n), alpha, samples, stratified)
        assert_mean_is(covered, np.full(samples, share))
        number = covered.sum(axis=1)
        if stratified:
            assert number.min() >= np.floor(share * samples)
            assert number.max() <= np.ceil(share * samples)


def test_stratified_samples_are_drawn_from_all_sets_alike():
    n = 60_000
    keys = np.arange(n, dtype=np.uint32)
    covered = c.coverages(keys, np.zeros(n), np.full(n, 0.5), 6, True)
    sets = np.bincount(covered @ (1 << np.arange(6)), minlength=64)
    assert np.count_nonzero(sets) == 20  # 3 of 6
    assert abs(chi_square(sets[sets > 0])) < 5


@masks
@precisions
@pytest.mark.parametrize("samples", [1, 8, 40])
def test_transmittance_is_the_same_bits_in_glsl(samples, stratified, dtype):
    f = pixels(300, layers=11, dtype=dtype, shape=(15, 20), origin=(-3, 100))
    twins = moit.Fragments(
        f.offsets, np.round(f.depth), np.round(f.alpha, 1), shape=f.shape, origin=f.origin
    )
    technique = Stochastic(samples, seed=9, stratified=stratified)
    for one in (f, twins):
        expected = moit.transmittance(one, technique)
        got = moit.transmittance(one, technique, device=software_device(), exact=True)
        np.testing.assert_array_equal(got, expected)


# ---- A model in plain Python -------------------------------------------------------------------


def joined(key: int, thing: int) -> int:
    return python_mixed(key ^ thing)


def model(f: moit.Fragments, samples: int, stratified: bool, seed: int) -> list[float]:
    """The transmittance in front of each fragment, from the words of the paper and the README."""
    T = []
    for pixel, (start, end) in enumerate(zip(f.offsets, f.offsets[1:], strict=False)):
        y, x = (int(at) + o for at, o in zip(divmod(pixel, f.shape[1]), f.origin, strict=True))
        held = [np.inf] * samples
        seen: dict[int, int] = {}
        for i in range(start, end):
            key = python_mixed((seed + 0x9E3779B9) % 2**32)
            key = joined(joined(key, y % 2**32), x % 2**32)
            for value in (f.depth[i], f.alpha[i]):
                near = np.float32(value)
                rest = value - near
                for part in (near, rest):
                    bits = int.from_bytes(part.tobytes(), "little")
                    key = joined(key, bits % 2**32)
                key = joined(key, bits >> 32)
            twin = seen.get(key, 0)
            seen[key] = twin + 1
            key = joined(key, twin)
            lots = [
                (python_mixed((key + 0x9E3779B9 * k) % 2**32) >> 8) * 2.0**-24
                for k in range(samples + 1)
            ]
            alpha = float(f.alpha[i])
            chosen = {s for s in range(samples) if lots[s + 1] < alpha}
            if stratified:
                wanted = float(f.alpha[i] * f.alpha.dtype.type(samples))
                left = int(wanted) + (lots[0] < wanted - int(wanted))
                chosen = set()
                for s in range(samples):
                    if lots[s + 1] * (samples - s) < left - len(chosen):
                        chosen.add(s)
            for s in chosen:
                held[s] = min(held[s], float(f.depth[i]))
        for i in range(start, end):
            T.append(sum(z >= f.depth[i] for z in held) / samples)
    return T


@masks
@precisions
def test_the_model_in_plain_python_draws_the_same_lots(stratified, dtype):
    f = pixels(40, layers=7, dtype=dtype, shape=(5, 8), origin=(-3, 100))
    f = moit.Fragments(
        f.offsets, np.round(f.depth), np.round(f.alpha, 1), shape=f.shape, origin=f.origin
    )
    for samples in (1, 8, 37):
        technique = Stochastic(samples, seed=2**31 - 1, stratified=stratified)
        expected = np.array(model(f, samples, stratified, 2**31 - 1), f.depth.dtype)
        np.testing.assert_array_equal(moit.transmittance(f, technique), expected)
