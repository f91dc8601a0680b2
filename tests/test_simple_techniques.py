"""Sorted, unsorted and weighted techniques against their papers' formulas in NumPy float64."""

from fractions import Fraction

import numpy as np
import pytest
from oracle import blends
from variants import EVERY, TARGETS, WITH_CURVE, WITHOUT_CURVE, fills_coverage

import moit
from moit import AlphaBlend, Sorted, WeightedAverage, WeightedBlended, WeightedSum

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])

# A few units in the last place: sums run in double, results are rounded once; 1 - alpha and powers
# of it cancel a little.
EPSILONS = 64
# Weights take powers of depth up to the sixth in the fragments' own precision; near the far plane
# eq. 10 takes the third power of 1 - d down to .015, where rounding counts 200 times.
WEIGHT_EPSILONS = 512

NEAR, FAR = 0.5, 400.0
WEIGHTS = ["blog", "eq7", "eq8", "eq9", "eq10", "phenomenological"]
UNWEIGHTED = [
    (Sorted(), blends.front_to_back),
    (AlphaBlend(), blends.in_arrival_order),
    (WeightedSum(), blends.weighted_sum),
    (WeightedAverage(), blends.weighted_average),
]
WEIGHTED = [
    (
        WeightedBlended(weight=name, depth_scale=scale),
        blends.weighted_blended(blends.weight(name, NEAR, FAR, scale)),
    )
    for name in WEIGHTS
    for scale in (1.0, 0.25)
]
SIMPLE = [*UNWEIGHTED, *WEIGHTED]
against_formulas = pytest.mark.parametrize(
    ("technique", "blend"), SIMPLE, ids=[str(technique) for technique, _ in SIMPLE]
)


def tolerance(technique, dtype) -> float:
    count = WEIGHT_EPSILONS if isinstance(technique, WeightedBlended) else EPSILONS
    return count * float(np.finfo(dtype).eps)


def image(dtype, seed=0, opaque=0.0, ties=True) -> moit.Fragments:
    """7 x 31 pixels of 0 to 12 fragments, some clear, with ties some at one depth; one of 300."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 13, 7 * 31)
    counts[100] = 300
    n = int(counts.sum())
    depth = np.exp(rng.uniform(np.log(NEAR), np.log(FAR), n))
    if ties:
        depth = np.where(rng.random(n) < 0.3, rng.choice([1.0, 4.0, 64.0], n), depth)
    alpha = np.where(rng.random(n) < 0.1, 0.0, rng.uniform(0.01, 0.99, n))
    alpha = np.where(rng.random(n) < opaque, 1.0, alpha)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        depth.clip(NEAR, FAR),
        alpha,
        rng.uniform(0, 2, (n, 3)),
        shape=(7, 31),
        depth_range=(NEAR, FAR),
        dtype=dtype,
    )


def pixels(f: moit.Fragments):
    """(slice, depth, alpha, color) of each pixel, in float64."""
    for start, end in zip(f.offsets, f.offsets[1:], strict=False):
        own = slice(start, end)
        yield own, *(a[own].astype(float) for a in (f.depth, f.alpha, f.color))


@against_formulas
@precisions
def test_images_are_what_the_formula_gives(technique, blend, dtype):
    f = image(dtype)
    background = np.array([0.2, 0.5, 3.0])
    found = moit.composite(f, technique, background=background)
    assert found.shape == (7, 31, 4) and found.dtype == dtype
    for pixel, (_, depth, alpha, color) in enumerate(pixels(f)):
        T, total = blend(depth, alpha, color)
        exact = blends.image(T, total, alpha, color, background)
        scale = max(1.0, np.abs(exact).max())
        # what cancels in weighted-sum's 1 - sum of alpha is as large as the sum
        scale = max(scale, 3 * alpha.sum() if isinstance(technique, WeightedSum) else 0)
        error = np.abs(found.reshape(-1, 4)[pixel] - exact).max()
        assert error <= tolerance(technique, dtype) * scale


@against_formulas
@precisions
def test_transmittance_is_what_the_formula_multiplies_colours_by(technique, blend, dtype):
    f = image(dtype)
    found = moit.transmittance(f, technique)
    assert found.shape == (len(f),) and found.dtype == dtype
    for own, depth, alpha, color in pixels(f):
        T, _ = blend(depth, alpha, color)
        if alpha.any():
            assert np.allclose(found[own], T, rtol=tolerance(technique, dtype), atol=1e-30)


@against_formulas
@precisions
def test_total_transmittance_is_what_the_background_is_multiplied_by(technique, blend, dtype):
    f = image(dtype)
    found = moit.total_transmittance(f, technique)
    assert found.shape == (7, 31) and found.dtype == dtype
    for pixel, (_, depth, alpha, color) in enumerate(pixels(f)):
        _, total = blend(depth, alpha, color)
        scale = max(1.0, alpha.sum())
        assert abs(found.flat[pixel] - total) <= tolerance(technique, dtype) * scale


@against_formulas
@precisions
def test_the_nearest_opaque_fragment_is_the_background(technique, blend, dtype):
    f = image(dtype, seed=1, opaque=0.15)
    background = np.array([9.0, 9.0, 9.0])
    picture = moit.composite(f, technique, background=background).reshape(-1, 4)
    found = moit.transmittance(f, technique)
    left = moit.total_transmittance(f, technique).ravel()
    seen = 0
    for pixel, (own, depth, alpha, color) in enumerate(pixels(f)):
        T, total, exact = blends.culled(blend, depth, alpha, color, background)
        seen += total == 0
        scale = max(9.0, np.abs(exact).max(), 3 * alpha.sum())
        assert np.abs(picture[pixel] - exact).max() <= tolerance(technique, dtype) * scale
        assert abs(left[pixel] - total) <= tolerance(technique, dtype) * max(1, alpha.sum())
        behind = (alpha == 1).any() and depth > depth[alpha == 1].min()
        assert (found[own][behind] == 0).all()
        known = ~np.isnan(T) & (alpha < 1)
        if alpha[known & (T > 0)].any():
            assert np.allclose(
                found[own][known], T[known], rtol=tolerance(technique, dtype), atol=1e-30
            )
    assert seen > 50


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_the_first_of_two_opaque_fragments_at_one_depth_is_seen(technique, dtype):
    color = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    f = moit.Fragments([0, 3], [3, 2, 2], [1, 1, 1], color, dtype=dtype)
    assert moit.composite(f, technique)[0, 0].tolist() == [0, 1, 0, 1]
    assert moit.total_transmittance(f, technique)[0, 0] == 0


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_transparent_fragments_at_the_depth_of_the_opaque_one_stay(technique, dtype):
    alone = moit.Fragments([0, 1], [2], [0.5], [[1, 1, 1]], depth_range=(1, 3), dtype=dtype)
    both = moit.Fragments(
        [0, 3], [2, 2, 3], [1, 0.5, 0.5], [[0, 1, 0], [1, 1, 1], [5, 5, 5]],
        depth_range=(1, 3), dtype=dtype,
    )  # fmt: skip
    expected = moit.composite(alone, technique, background=(0, 1, 0))[0, 0]
    found = moit.composite(both, technique)[0, 0]
    assert found[:3].tolist() == expected[:3].tolist()
    assert found[3] == 1
    T = moit.transmittance(both, technique)
    assert T[1] == moit.transmittance(alone, technique)[0]
    assert T[2] == 0


@pytest.mark.parametrize("technique", WITH_CURVE, ids=str)
@precisions
def test_curves_are_0_behind_the_opaque_surface(technique, dtype):
    f = moit.Fragments([0, 2], [2, 3], [0.5, 1], depth_range=(1, 5), dtype=dtype)
    without = moit.Fragments([0, 1], [2], [0.5], depth_range=(1, 5), dtype=dtype)
    at = [1.5, 2, 2.5, 3, 3.001, 4, 5]
    found = moit.transmittance(f, technique, depth=at)[0, 0]
    assert (found[4:] == 0).all()
    assert (found[:4] == moit.transmittance(without, technique, depth=at)[0, 0, :4]).all()


@precisions
def test_culling_can_be_turned_off(dtype):
    color = [[1, 0, 0], [0, 1, 0]]
    f = moit.Fragments([0, 2], [1, 2], [1, 0.5], color, dtype=dtype)
    culled = moit.composite(f, WeightedSum(), background=(0, 0, 1))[0, 0]
    assert culled.tolist() == [1, 0, 0, 1]
    kept = moit.composite(f, WeightedSum(), background=(0, 0, 1), cull_opaque=False)[0, 0]
    assert kept.tolist() == [1, 0.5, -0.5, 1.5]
    T = moit.transmittance(f, Sorted(), cull_opaque=False)
    assert T.tolist() == [1, 0]
    # unsorted without culling lays the later one over the opaque one
    over = moit.composite(f, AlphaBlend(), cull_opaque=False)[0, 0]
    assert over.tolist() == [0.5, 0.5, 0, 1]


@against_formulas
@precisions
def test_without_culling_opaque_fragments_are_as_others(technique, blend, dtype):
    f = image(dtype, seed=2, opaque=0.15)
    found = moit.transmittance(f, technique, cull_opaque=False)
    for own, depth, alpha, color in pixels(f):
        T, _ = blend(depth, alpha, color)
        if alpha.any():
            assert np.allclose(found[own], T, rtol=tolerance(technique, dtype), atol=1e-30)


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_nothing_occludes_where_no_fragment_has_opacity(technique, dtype):
    color = np.ones((3, 3))
    f = moit.Fragments([0, 3], [1, 2, 3], [0, 0, 0], color, depth_range=(1, 9), dtype=dtype)
    assert (moit.transmittance(f, technique) == 1).all()
    assert moit.total_transmittance(f, technique).tolist() == [[1]]
    found = moit.composite(f, technique, background=(0.25, 0.5, 0.75))
    assert found[0, 0].tolist() == [0.25, 0.5, 0.75, 0]


@precisions
def test_sorted_composites_equal_depths_in_arrival_order(dtype):
    color = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    f = moit.Fragments([0, 3], [2, 1, 2], [0.5, 0.5, 0.5], color, dtype=dtype)
    assert moit.transmittance(f, Sorted()).tolist() == [0.5, 1, 0.25]
    assert moit.composite(f, Sorted())[0, 0].tolist() == [0.25, 0.5, 0.125, 0.875]


@precisions
def test_a_sorted_curve_counts_what_is_strictly_nearer(dtype):
    f = moit.Fragments([0, 3], [2, 1, 2], [0.5, 0.5, 0.5], dtype=dtype)
    found = moit.transmittance(f, Sorted(), depth=[0.5, 1, 1.5, 2, 2.5])
    assert found.shape == (1, 1, 5) and found.dtype == dtype
    assert found[0, 0].tolist() == [1, 1, 0.5, 0.5, 0.125]


@precisions
def test_sorting_first_makes_unsorted_right_when_the_order_is_turned(dtype):
    # over in arrival order is exact for fragments that arrive back to front
    f = image(dtype).sorted()
    turned = moit.Fragments.from_pixels(
        np.repeat(np.arange(len(f.counts)), f.counts)[::-1],
        f.depth[::-1], f.alpha[::-1], f.color[::-1], shape=f.shape, dtype=dtype,
    )  # fmt: skip
    exact = moit.composite(f, Sorted())
    found = moit.composite(turned, AlphaBlend())
    assert np.abs(found - exact).max() <= 8 * EPSILONS * np.finfo(dtype).eps


@precisions
def test_a_callable_weight_is_called_with_all_fragments(dtype):
    f = image(dtype)

    def weight(depth, alpha, color):
        assert len(depth) == len(alpha) == len(color) == len(f)
        return alpha / depth**2

    found = moit.composite(f, WeightedBlended(weight=weight))
    blend = blends.weighted_blended(lambda depth, alpha, color: alpha / depth**2)
    for pixel, (_, depth, alpha, color) in enumerate(pixels(f)):
        T, total = blend(depth, alpha, color)
        exact = blends.image(T, total, alpha, color, (0, 0, 0))
        assert np.abs(found.reshape(-1, 4)[pixel] - exact).max() <= 64 * np.finfo(dtype).eps


@precisions
def test_a_callable_weight_that_is_a_known_formula_changes_nothing(dtype):
    f = image(dtype)
    known = blends.weight("eq9", NEAR, FAR)
    found = moit.transmittance(f, WeightedBlended(weight=known))
    same = moit.transmittance(f, WeightedBlended(weight="eq9"))
    assert np.allclose(found, same, rtol=WEIGHT_EPSILONS * np.finfo(dtype).eps, atol=1e-30)


def test_depth_scale_is_a_change_of_units():
    f = image("float64")
    half = moit.Fragments(
        f.offsets, f.depth / 2, f.alpha, f.color, shape=f.shape, depth_range=(NEAR / 2, FAR / 2)
    )
    for name in WEIGHTS:
        found = moit.composite(half, WeightedBlended(weight=name, depth_scale=2.0))
        assert np.abs(found - moit.composite(f, WeightedBlended(weight=name))).max() <= 1e-13


NORMALIZED = [t for t in EVERY if fills_coverage(t) and not isinstance(t, WeightedSum)]


@pytest.mark.parametrize("technique", NORMALIZED, ids=str)
@precisions
def test_a_normalized_colour_lies_within_the_range_of_its_fragments(technique, dtype):
    # darker means underflow, brighter overflow
    rng = np.random.default_rng(3)
    n, layers = 400, 20
    for low, high in ((1e-6, 1e-2), (0.01, 0.99), (0.9, 0.9999)):
        f = moit.Fragments(
            np.arange(n + 1) * layers,
            np.exp(rng.uniform(np.log(NEAR), np.log(FAR), n * layers)),
            rng.uniform(low, high, n * layers),
            rng.uniform(0.4, 0.6, (n * layers, 3)),
            depth_range=(NEAR, FAR),
            dtype=dtype,
        )
        found = moit.composite(f, technique)[0].astype(float)
        covered = found[:, 3] > 0  # an alpha test may let nothing pass
        found = found[covered]
        color = f.color.reshape(n, layers, 3).astype(float)[covered]
        mean = found[:, :3] / found[:, 3:]
        slack = 64 * np.finfo(dtype).eps
        # coverage is 1 - total in the fragments' precision: little of it leaves few digits
        slack = slack + np.finfo(dtype).eps / found[:, 3:]
        assert (mean >= color.min(axis=1) * (1 - slack)).all()
        assert (mean <= color.max(axis=1) * (1 + slack)).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
@pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")
def test_one_colour_and_the_same_background_stay_what_they_are(technique, dtype):
    if not fills_coverage(technique):
        pytest.skip("weights need not sum to what is covered")
    f = image(dtype, seed=4)
    one = moit.Fragments(
        f.offsets, f.depth, f.alpha, np.full((len(f), 3), 0.25), shape=f.shape, dtype=dtype
    )
    found = moit.composite(one, technique, background=(0.25, 0.25, 0.25))[..., :3]
    many = max(1.0, float(f.alpha[f.offsets[100] : f.offsets[101]].sum()))
    scale = many if isinstance(technique, WeightedSum) else 1
    allowed = EPSILONS * np.finfo(dtype).eps * scale
    if technique in TARGETS:  # weights of some hundred fragments are more than half can hold
        found = found.reshape(-1, 3)[f.counts < 32]
        allowed = 31 * 2.0**-11  # of their sums
    assert np.abs(found - 0.25).max() <= allowed


@pytest.mark.parametrize("technique", WITHOUT_CURVE, ids=str)
def test_depth_is_refused_where_a_technique_has_no_curve(technique):
    f = image("float32")
    with pytest.raises(TypeError, match="depth"):
        moit.transmittance(f, technique, depth=[1.0])


def test_which_techniques_have_curves():
    for technique in (Sorted(), moit.PowerMoments(4), moit.PowerMoments(6), moit.PowerMoments(8)):
        assert technique in WITH_CURVE
    for technique in (AlphaBlend(), WeightedSum(), WeightedAverage(), WeightedBlended()):
        assert technique in WITHOUT_CURVE


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_a_background_is_one_colour_or_an_image(technique, dtype):
    if technique.engine != "core":
        pytest.skip("per-pixel chooses anew where what is behind is brighter than white")
    f = image(dtype, seed=5, opaque=0.05)
    one = moit.composite(f, technique, background=(0.5, 1, 2))
    image_of_it = np.tile(np.array([0.5, 1, 2]), (7, 31, 1))
    assert (moit.composite(f, technique, background=image_of_it) == one).all()
    black = moit.composite(f, technique)
    total = moit.total_transmittance(f, technique)[..., None].astype(float)
    assert np.allclose(
        one[..., :3], black[..., :3] + total * (0.5, 1, 2), rtol=0, atol=200 * np.finfo(dtype).eps
    )
    gradient = np.linspace(0, 1, 7 * 31 * 3).reshape(7, 31, 3)
    found = moit.composite(f, technique, background=gradient)
    for y, x in ((0, 0), (3, 7), (6, 30)):
        alone = moit.composite(f, technique, background=gradient[y, x])
        assert (found[y, x] == alone[y, x]).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_coverage_is_what_total_transmittance_leaves(technique, dtype):
    f = image(dtype, seed=6, opaque=0.05)
    coverage = moit.composite(f, technique)[..., 3]
    total = moit.total_transmittance(f, technique)
    assert np.abs(1 - coverage.astype(float) - total).max() <= 32 * np.finfo(dtype).eps


@pytest.mark.parametrize("technique", EVERY, ids=str)
@precisions
def test_pixels_without_fragments_show_the_background(technique, dtype):
    f = moit.Fragments([0, 0, 0], [], [], np.zeros((0, 3)), dtype=dtype)
    found = moit.composite(f, technique, background=(0.25, 0.5, 0.75))
    assert found[0].tolist() == [[0.25, 0.5, 0.75, 0]] * 2
    assert moit.total_transmittance(f, technique).tolist() == [[1, 1]]
    assert moit.transmittance(f, technique).shape == (0,)
    nothing = moit.Fragments([0], [], [], np.zeros((0, 3)), shape=(0, 5), dtype=dtype)
    assert moit.composite(nothing, technique).shape == (0, 5, 4)


ORDER_INDEPENDENT = [technique for technique in EVERY if technique.order_independent]


@pytest.mark.parametrize("technique", ORDER_INDEPENDENT, ids=str)
@precisions
@pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")
def test_arrival_order_does_not_show(technique, dtype):
    f = image(dtype, seed=7, ties=not technique.ties_in_order)
    if getattr(technique, "moment_count", 0) and getattr(technique, "bias", None) == 0:
        pytest.skip("without bias reconstructions of few surfaces hang on rounding")
    found = moit.composite(f, technique)
    other = moit.composite(f.shuffled(1), technique)
    # moments differ by n epsilons, reconstructions from them by more; weighted ones hardly
    allowed = 5e-2 if getattr(technique, "moment_count", 0) else 300 * np.finfo(dtype).eps
    bits = 32 if getattr(technique, "moment_count", 0) else getattr(technique, "bits", 32)
    if isinstance(technique, moit.Strong):  # and of halves more
        allowed = 5e-2
    if bits == 16:  # each of up to 31 surfaces is rounded by 2^-11
        allowed = 31 * 2.0**-11
    if getattr(technique, "in_halves", False):  # the image's range leaves near surfaces few digits
        allowed = 0.1 if technique.range_per_pixel else 0.3
    if technique in TARGETS:  # and a byte by half a step
        allowed += 31 * 0.5 / 255
    assert (np.abs(found - other) <= allowed * np.maximum(1, np.abs(found))).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_a_crop_composites_as_the_crop_of_the_whole(technique):
    if not technique.local:
        pytest.skip("pixels share a state, of which those at the edge of a crop lack a part")
    f = image("float32", seed=8, opaque=0.05)
    whole = moit.composite(f, technique, background=(0.1, 0.2, 0.3))
    part = moit.composite(f[2:5, 4:20], technique, background=(0.1, 0.2, 0.3))
    assert (part == whole[2:5, 4:20]).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
@pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")
def test_dtype_asks_for_a_precision(technique):
    f = image("float32", seed=9)
    found = moit.composite(f, technique, dtype=np.float64)
    assert found.dtype == np.float64
    wide = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, shape=f.shape, depth_range=f.depth_range,
        dtype=np.float64,
    )  # fmt: skip
    assert (moit.composite(wide, technique) == found).all()
    assert moit.transmittance(wide, technique, dtype=np.float32).dtype == np.float32


def test_layers_of_one_opacity_cover_what_they_do_in_rational_numbers():
    """Up to 16 layers are summed up, more go by a logarithm: either way all digits count."""
    counts, alphas = np.arange(1, 21), (1e-13, 3e-5, 0.25, 0.999)
    per_pixel = np.repeat(counts, len(alphas))
    alpha = np.repeat(np.tile(alphas, len(counts)), per_pixel)
    f = moit.Fragments(
        np.concatenate([[0], np.cumsum(per_pixel)]),
        np.ones(len(alpha)),
        alpha,
        np.ones((len(alpha), 3)),
    )
    covered = moit.composite(f, WeightedAverage(), background=(0, 0, 0)).reshape(-1, 4)[:, 0]
    expected = [float(1 - (1 - Fraction(a)) ** int(n)) for n in counts for a in alphas]
    np.testing.assert_allclose(covered, expected, rtol=1e-14)
