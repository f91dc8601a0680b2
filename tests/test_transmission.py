"""Coloured transmission: what each technique shares between channels, and what it does not.

McGuire and Mara, "A Phenomenological Scattering Model for Order-Independent Transparency", 2016:
net coverage is alpha times 1 - the mean transmission, and each channel of the background is
multiplied by 1 - alpha (1 - transmission) of every fragment.
"""

import numpy as np
import pytest
from variants import EVERY, TARGETS, WITH_CURVE, leaves_nothing

import moit
from moit import PowerMoments, WeightedBlended
from moit.catalog import MomentTechnique
from moit.catalog.technique import FACTS

# per-pixel chooses anew where transmission changes: see its own tests
ABLE = [t for t in EVERY if t.supports_transmission and t.engine == "core"]
UNABLE = [t for t in EVERY if not t.supports_transmission]
SHARED = [t for t in ABLE if not FACTS[t.kind]["knows_channels"]]
BACKGROUND = (0.3, 0.7, 1.1)
F64 = 1e-13  # sums and products of some ten numbers in double


def scene(pixels=60, most=7, seed=0, dtype=np.float64, transmission=None, opaque=0.0, scale=1.0):
    """Random fragments with coloured transmission, some of it 0 or 1, and pixels without any."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, pixels)
    n = int(counts.sum())
    alpha = rng.uniform(0.05, 0.95, n)
    alpha[rng.random(n) < 0.1] = 0
    t = rng.random((n, 3)) * scale
    t[rng.random(n) < 0.2] = 0
    wall = rng.random(n) < opaque
    alpha[wall] = 1
    t[wall] = 0
    if transmission is not None:
        t = np.full((n, 3), transmission)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.permutation(n) / 7 + 1.0,
        alpha,
        rng.uniform(0, 2, (n, 3)),
        transmission=t,
        dtype=dtype,
        shape=(pixels // 10, 10),
    )


def replaced(f, **changes):
    """`f` with other arrays."""
    held = {name: getattr(f, name) for name in ("depth", "alpha", "color", "transmission")}
    held |= {name: getattr(f, name) for name in ("shape", "depth_range", "origin")}
    return moit.Fragments(f.offsets, **{**held, **changes})


def opacities(f):
    """(N, 3)"""
    return f.alpha[:, None] * (1 - f.transmission)


def rays(f):
    """The fragments of each pixel, front to back."""
    for begin, end in zip(f.offsets[:-1], f.offsets[1:], strict=True):
        yield begin + np.argsort(f.depth[begin:end], kind="stable")


def through(f):
    """(H, W, 3) what each channel of the background is multiplied by."""
    return np.reshape([np.prod(1 - opacities(f)[ray], axis=0) for ray in rays(f)], (*f.shape, 3))


def over(f, order):
    """(H, W, 3) fragments over one another and the background, channel by channel."""
    image = []
    for ray in order(f):
        seen = np.array(BACKGROUND)
        for i in ray[::-1]:
            seen = f.alpha[i] * f.color[i] + (1 - opacities(f)[i]) * seen
        image.append(seen)
    return np.reshape(image, (*f.shape, 3))


def has_exact_total(technique):
    """Whether the technique lets the product of 1 - alpha through, but for rounding."""
    f = scene(pixels=200, seed=20, transmission=0.0, most=12)
    total = moit.total_transmittance(f, technique)
    # 16 bits of b0 are off by less than a hundredth, and max_alpha is above .95
    return np.allclose(total, through(f), rtol=0.01, atol=1e-6)


EXACT_TOTAL = [t for t in ABLE if has_exact_total(t)]


def latest_first(f):
    for begin, end in zip(f.offsets[:-1], f.offsets[1:], strict=True):
        yield np.arange(begin, end)[::-1]


# -- exact ones --


@pytest.mark.parametrize(("name", "order"), [("sorted", rays), ("unsorted", latest_first)])
def test_each_channel_is_dimmed_by_its_own_opacity(name, order):
    f = scene()
    got = moit.composite(f, name, background=BACKGROUND)
    np.testing.assert_allclose(got[..., :3], over(f, order), rtol=F64, atol=F64)
    np.testing.assert_allclose(got[..., 3], 1 - through(f).mean(axis=2), rtol=F64, atol=F64)


def test_filters_of_complementary_colours_leave_nothing():
    f = moit.Fragments(
        [0, 2],
        [2.0, 1.0],
        [1.0, 1.0],
        np.zeros((2, 3)),
        transmission=[[1, 0, 0], [0, 1, 1]],
        depth_range=(1, 3),
    )
    one = replaced(f, transmission=[[1, 0, 0], [1, 1, 1]])
    for technique in EXACT_TOTAL:
        both = moit.composite(f, technique, background=(0.5, 0.5, 0.5))
        np.testing.assert_array_equal(both[0, 0], (0, 0, 0, 1), str(technique))
        got = moit.composite(one, technique, background=(0.5, 0.5, 0.5))
        np.testing.assert_allclose(got[0, 0], (0.5, 0, 0, 2 / 3), rtol=F64, err_msg=str(technique))


def test_a_clear_coloured_filter_hides_nothing_though_its_alpha_is_1():
    f = moit.Fragments(
        [0, 3],
        [3.0, 2.0, 1.0],
        [0.5, 1.0, 1.0],
        [[8, 8, 8], [0, 0, 0], [0, 0, 0]],
        transmission=[[0, 0, 0], [0, 0, 0.25], [0.5, 0, 0.5]],
    )
    # 1 - alpha (1 - t) in front of the farthest: red 0, green 0, blue 0.125
    got = moit.composite(f, "sorted", background=(1, 1, 1))
    np.testing.assert_array_equal(got[0, 0, :3], [0, 0, 0.125 * (4 + 0.5)])
    walled = replaced(f, transmission=[[0, 0, 0], [0, 0, 0], [0.5, 0, 0.5]])
    got = moit.composite(walled, "sorted", background=(1, 1, 1))
    np.testing.assert_array_equal(got[0, 0], [0, 0, 0, 1])
    held = moit.transmittance(walled, "sorted")
    np.testing.assert_allclose(held, [0, 1 / 3, 1], rtol=1e-6)
    assert (moit.total_transmittance(walled, "sorted") == 0).all()


# -- totals --


@pytest.mark.parametrize("technique", EXACT_TOTAL, ids=str)
def test_each_channel_of_the_background_has_its_own_total(technique):
    f = scene(seed=1)
    # moments give a pixel whose channels agree exp(-b0), which clamps alpha: see the limits below
    grey = np.ptp(opacities(f), axis=1) == 0
    pixel = np.repeat(np.arange(60), f.counts)
    coloured = np.bincount(pixel[~grey], minlength=60).astype(bool).reshape(f.shape)
    total = moit.total_transmittance(f, technique)
    assert total.shape == (*f.shape, 3)
    np.testing.assert_allclose(total[coloured], through(f)[coloured], rtol=F64, atol=F64)
    shuffled = moit.total_transmittance(f.shuffled(3), technique)
    np.testing.assert_allclose(shuffled[coloured], total[coloured], rtol=F64, atol=F64)
    dark = replaced(f, color=np.zeros((len(f), 3)))
    image = moit.composite(dark, technique, background=BACKGROUND)
    np.testing.assert_allclose(image[..., :3], total * BACKGROUND, rtol=F64, atol=F64)
    np.testing.assert_allclose(image[..., 3], 1 - total.mean(axis=2), rtol=F64, atol=F64)


def test_sums_and_averages_of_opacity_are_each_channels_own():
    f = scene(seed=2)
    summed, averaged = (
        moit.total_transmittance(f, name) for name in ("weighted-sum", "weighted-average")
    )
    for p, ray in enumerate(rays(f)):
        at = np.unravel_index(p, f.shape)
        own = opacities(f)[ray]
        np.testing.assert_allclose(summed[at], 1 - own.sum(axis=0), rtol=F64, atol=F64)
        n = len(ray)
        mean = own.sum(axis=0) / max(n, 1)
        np.testing.assert_allclose(averaged[at], (1 - mean) ** n, rtol=F64, atol=F64)


# -- the shared curve --


@pytest.mark.parametrize("technique", ABLE, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_a_fragment_is_seen_through_is_the_curve_of_net_coverage(technique, dtype):
    f = scene(seed=3, dtype=dtype)
    if technique.kind == "wboit" and technique.weight == "blog":
        pytest.skip("the blog's weight looks at emitted light too; see the test of the image")
    plain = replaced(f, alpha=f.coverage, transmission=None)
    assert (
        moit.transmittance(f, technique).tobytes() == moit.transmittance(plain, technique).tobytes()
    )
    for own, other in zip(moit.bounds(f, technique), moit.bounds(plain, technique), strict=True):
        assert own.tobytes() == other.tobytes()
    if technique in WITH_CURVE:
        depth = np.linspace(1, 60, 7)
        held, same = (moit.transmittance(one, technique, depth) for one in (f, plain))
        assert held.tobytes() == same.tobytes()


def test_net_coverage_is_alpha_less_the_mean_transmission():
    f = scene(seed=4)
    np.testing.assert_allclose(f.coverage, f.alpha * (1 - f.transmission.mean(axis=1)), rtol=1e-14)
    assert replaced(f, transmission=None).coverage.tobytes() == f.alpha.tobytes()
    grey = scene(seed=4, transmission=0.3)
    assert f.alpha.tobytes() == grey.alpha.tobytes()
    # one third of three equal numbers may round; these do not
    np.testing.assert_array_equal(grey.coverage, grey.alpha * (1 - 0.3))


@pytest.mark.parametrize("technique", SHARED, ids=str)
def test_images_add_emitted_light_behind_the_shared_curve(technique):
    f = scene(seed=5)
    if technique.kind == "front" and technique.normalize:
        pytest.skip("the tail is scaled by itself: tests/test_front.py")
    if technique.kind == "wboit" and technique.weight == "blog":
        if technique in TARGETS:
            pytest.skip("targets round what this takes for exact")
        T = blog_transmittance(f, technique.depth_scale)
    else:
        T = moit.transmittance(f, technique)
    image = moit.composite(f, technique, background=BACKGROUND)
    total = moit.total_transmittance(f, technique)
    net_total = moit.total_transmittance(
        replaced(f, alpha=f.coverage, transmission=None), technique
    )
    for p, ray in enumerate(rays(f)):
        at = np.unravel_index(p, f.shape)
        light = (f.alpha[ray] * T[ray]) @ f.color[ray]
        covered = float(f.coverage[ray] @ T[ray])
        # nodes merged by energy let others behind them count with too much, too
        exceeds = getattr(technique, "by_energy", False) and covered - (1 - net_total[at]) > 2**-15
        if (getattr(technique, "normalize", False) or exceeds) and covered > 0:
            light *= (1 - net_total[at]) / covered
        expected = light + total[at] * BACKGROUND
        # half floats round each colour, and each sum, by 2^-11
        half = 2 * len(f.alpha[ray]) * 2.0**-11 if technique in TARGETS else 0
        np.testing.assert_allclose(image[at][:3], expected, rtol=1e-12 + half, atol=1e-13)


def blog_transmittance(f, depth_scale):
    """w (1 - prod(1 - coverage)) / sum(coverage w): McGuire's weight of 2015."""
    z = f.depth * depth_scale
    bright = f.alpha * f.color.max(axis=1)
    w = np.maximum(np.minimum(1, bright), f.coverage)
    w = w * np.clip(0.03 / (1e-5 + (z / 200) ** 4), 1e-2, 3e3)
    T = np.ones(len(f))
    for ray in rays(f):
        summed = f.coverage[ray] @ w[ray]
        if summed > 0:
            T[ray] = w[ray] * (1 - np.prod(1 - f.coverage[ray])) / summed
    return T


# -- limits --


@pytest.mark.parametrize("technique", ABLE, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_no_transmission_is_the_same_bits_as_none_given(technique, dtype):
    f = scene(pixels=1000, seed=6, dtype=dtype, transmission=0.0, opaque=0.1)
    plain = replaced(f, transmission=None)
    for cull in (True, False):
        options = {"background": BACKGROUND, "cull_opaque": cull}
        got, expected = (moit.composite(one, technique, **options) for one in (f, plain))
        assert got.tobytes() == expected.tobytes()
        got, expected = (
            moit.total_transmittance(one, technique, cull_opaque=cull) for one in (f, plain)
        )
        for c in range(3):
            assert got[..., c].tobytes() == expected.tobytes()
        got, expected = (moit.transmittance(one, technique, cull_opaque=cull) for one in (f, plain))
        assert got.tobytes() == expected.tobytes()


@pytest.mark.parametrize("technique", ABLE, ids=str)
def test_grey_transmission_is_less_opacity_in_a_brighter_colour(technique):
    f = scene(pixels=400, seed=7, transmission=0.375)  # exact in binary
    alpha = f.alpha * 0.625
    plain = replaced(f, alpha=alpha, color=f.color / 0.625, transmission=None)
    got, expected = (moit.composite(one, technique, background=BACKGROUND) for one in (f, plain))
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-14)
    assert got[..., 3].tobytes() == expected[..., 3].tobytes()


@pytest.mark.parametrize("technique", ["sorted", *(PowerMoments(m) for m in (4, 6, 8))], ids=str)
def test_a_clear_fragment_only_adds_its_light(technique):
    f = scene(seed=8, most=4)
    clear = moit.Fragments.from_pixels(
        pixel=np.arange(60),
        depth=np.full(60, 1.5),
        alpha=np.full(60, 0.5),
        color=np.ones((60, 3)),
        transmission=np.ones((60, 3)),
        shape=f.shape,
        depth_range=f.depth_range,
    )
    both = moit.merge([f, clear])
    total = moit.total_transmittance(f, technique)
    np.testing.assert_array_equal(moit.total_transmittance(both, technique), total)
    before, after = (moit.composite(one, technique) for one in (f, both))
    np.testing.assert_array_equal(before[..., 3], after[..., 3])
    assert (after[..., :3] >= before[..., :3]).all()
    held = moit.transmittance(both, technique)
    is_clear = both.coverage == 0
    own = np.sort(held[~is_clear & (both.alpha > 0)])
    np.testing.assert_array_equal(own, np.sort(moit.transmittance(f, technique)[f.coverage > 0]))
    alone = moit.composite(clear, technique, background=(1, 1, 1))
    np.testing.assert_array_equal(alone, np.broadcast_to((1.5, 1.5, 1.5, 0), alone.shape))


@pytest.mark.parametrize("technique", [t for t in ABLE if t.kind != "weighted-sum"], ids=str)
def test_normalised_grey_filters_stay_within_their_colours(technique):
    """What a fragment emits is at most its coverage here, as where it only reflects."""
    if not leaves_nothing(technique):
        pytest.skip("not normalised")
    f = scene(seed=9, transmission=0.5)
    f = replaced(f, color=f.color * 0.25)  # alpha color <= coverage, as color / 0.5 <= 1
    image = moit.composite(f, technique, background=(1, 1, 1))
    assert image[..., :3].max() <= 1 + 1e-12
    assert image.min() >= 0


# -- the rest of moit --


@pytest.mark.parametrize("technique", ABLE, ids=str)
def test_crops_shuffles_and_files_keep_transmission(technique, tmp_path):
    f = scene(seed=10)
    whole = moit.composite(f, technique)
    if technique.local:
        crop = moit.composite(f[1:4, 2:7], technique)
        assert crop.tobytes() == np.ascontiguousarray(whole[1:4, 2:7]).tobytes()
    moit.save(tmp_path / "f.npz", f)
    assert moit.composite(str(tmp_path / "f.npz"), technique).tobytes() == whole.tobytes()
    # half floats round each of up to 31 fragments by 2^-11, in another order to other values
    in_halves = getattr(technique, "in_halves", False)
    of_moments = isinstance(getattr(technique, "behind", technique), MomentTechnique | moit.Strong)
    of_moments = of_moments or getattr(technique, "inside", None) is not None
    half = 31 * 2.0**-11 if getattr(technique, "bits", 32) == 16 or in_halves else 0
    half += 31 * 0.5 / 255 if technique in TARGETS else 0  # and bytes by half a step
    if technique.order_independent:
        mixed = moit.composite(f.shuffled(1), technique)
        # moments of sums in another order: matrices amplify the last digit, most without a zone
        loose = 0.3 if in_halves else 5e-2 if of_moments else 1e-9
        np.testing.assert_allclose(mixed, whole, rtol=0, atol=loose + half)
        totals = [moit.total_transmittance(one, technique) for one in (f, f.shuffled(1))]
        np.testing.assert_allclose(*totals, rtol=F64, atol=F64 + half)
    single = moit.composite(f, technique, dtype=np.float32)
    # moments of few surfaces hang on rounding, lots on the last digit of what they are drawn for
    if not of_moments and not technique.random:
        np.testing.assert_allclose(single, whole, rtol=1e-5, atol=1e-5 + half)


@pytest.mark.parametrize("technique", ABLE, ids=str)
def test_fragments_without_colour_have_totals_and_bounds(technique):
    f = scene(seed=11)
    for transmission in (f.transmission, None):
        coloured = replaced(f, transmission=transmission)
        bare = replaced(f, color=None, transmission=transmission)
        total, same = (moit.total_transmittance(one, technique) for one in (coloured, bare))
        assert total.tobytes() == same.tobytes()
        ours, theirs = (moit.bounds(one, technique) for one in (coloured, bare))
        assert all(a.tobytes() == b.tobytes() for a, b in zip(ours, theirs, strict=True))


def test_a_weight_of_ones_own_is_given_the_net_coverage():
    f = scene(seed=12)
    given = []

    def weight(depth, alpha, color):
        given.append(alpha)
        return alpha / depth

    moit.composite(f, WeightedBlended(weight=weight))
    np.testing.assert_array_equal(given[0], f.coverage)
    assert len(given) == 1
    moit.total_transmittance(f, WeightedBlended(weight=weight))
    assert len(given) == 1, "totals need no weights"


@pytest.mark.parametrize("technique", [*UNABLE, "made up"], ids=str)
def test_techniques_that_cannot_say_so_and_who_can(technique, monkeypatch):
    f = scene(seed=13)
    if technique == "made up":  # there may be none that cannot
        technique = moit.AlphaBlend()
        monkeypatch.setattr(moit.AlphaBlend, "supports_transmission", False)
    for question in (moit.composite, moit.transmittance, moit.bounds, moit.total_transmittance):
        with pytest.raises(ValueError, match=r"^transmission: .*without.*sorted") as error:
            question(f, technique)
        assert str(technique) in str(error.value)


def test_comparisons_take_transmission(tmp_path):
    f = scene(pixels=400, seed=14, dtype=np.float32)
    f = replaced(f, shape=(20, 20))
    report = moit.compare(
        f, ["sorted", "weighted-sum", "wboit", "power4", "power8"], repeat=1, progress=False
    )
    rows = {row.technique: row for row in report.rows}
    assert rows["sorted"].rmse < 1e-6
    assert rows["sorted"].T_max < 1e-6
    assert rows["power8"].rmse < rows["weighted-sum"].rmse
    assert {row.technique for row in report.rows if row.note} == {"weighted-sum"}  # renormalised?
    report.to_html(tmp_path / "report.html")
    assert (tmp_path / "report.html").stat().st_size > 10_000
