"""Moment Transparency as published, against golden data and a model in NumPy."""

import re

import gpu
import numpy as np
import pytest
from golden import golden
from mpmath import mp
from oracle.hard_rays import flat, hard_rays
from readings import c, glsl

import moit
from moit import MomentTransparency

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
SCALE = 1 - 0.5 / 256
LEAST_PIVOT = 1e-15  # below this a pivot is rounding alone, at the default bias


def fragments_of(data: dict, dtype) -> moit.Fragments:
    return moit.Fragments(data["offsets"], data["depth01"], data["alpha"], dtype=dtype)


def rays(*rows, dtype="float64", shape=None, depth_range=(0, 1)) -> moit.Fragments:
    """Rows of (depth, alpha) pairs, a pixel each."""
    counts = [len(row) for row in rows]
    flat = np.array([one for row in rows for one in row], float).reshape(-1, 2)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    color = np.random.default_rng(0).uniform(0.2, 0.8, (len(flat), 3))
    return moit.Fragments(
        offsets, *flat.T, color, shape=shape, depth_range=depth_range, dtype=dtype
    )


def unwarped(*arguments, **options) -> MomentTransparency:
    return MomentTransparency(*arguments, warp="none", **options)


# ---- Golden data ---------------------------------------------------------------------------------


@precisions
def test_moments_are_the_golden_ones(dtype):
    data = golden("moment_transparency")
    b0, b = moit.moments.gather(fragments_of(data, dtype), unwarped(), cull_opaque=False)
    # the golden ones are rounded to float32, and so are ours and each absorbance
    np.testing.assert_allclose(b0, data["total"], rtol=2e-7)
    np.testing.assert_allclose(b, data["moments"], rtol=0, atol=1.2e-7)


@precisions
@pytest.mark.parametrize("beta", [0.0, 0.25, 1.0])
def test_reconstruction_is_the_golden_hamburger_bound(dtype, beta):
    data = golden("moment_transparency")
    arrays = (data[name].astype(dtype) for name in ("total", "moments", "eval_depth01"))
    found = moit.moments.transmittance(MomentTransparency(overestimation=beta), *arrays)
    share = data["hamburger_lower"] + beta * data["hamburger_weight"]
    error = np.abs(found - np.exp(-data["total"][:, None].astype(float) * share))
    # 1.1e-6 and 2.6e-14
    assert error.max() <= {"float32": 1e-5, "float64": 1e-12}[dtype]


def test_two_passes_are_the_golden_ones():
    data = golden("moment_transparency")
    technique = unwarped(2)
    state = moit.moments.gather(fragments_of(data, "float32"), technique, cull_opaque=False)
    found = moit.moments.transmittance(technique, *state, data["eval_depth01"])
    error = np.abs(found - data["twopass_transmittance"])
    assert np.quantile(error, 0.999) <= 1e-4


@precisions
def test_nonlinear_moments_are_read_as_published(dtype):
    data = golden("moment_transparency")
    given = {
        name: data[f"nlqm_{name}"].astype(dtype)
        for name in ("support", "weight", "fourth_offset", "interval_end", "overestimation")
    }
    found = c.nonlinear_share(*given.values())
    error = np.abs(found - data["nlqm_exact"])
    assert np.quantile(error, 0.999) <= {"float32": 1e-5, "float64": 1e-9}[dtype]


def test_two_surfaces_without_an_offset_leave_nothing_between_and_beside_them():
    """What the offset is kept from shows less than a float's last bit, in both precisions."""
    beside = np.array([1e-7, 1e-5, 1e-3])
    z = np.concatenate([0.25 + beside, 0.75 - beside])
    n = len(z)
    support = np.tile([0.25, 0.75], (n, 1))
    weight = np.full(n, 0.375)
    for beta in (0.0, 0.5, 1.0):
        share = c.nonlinear_share(support, weight, np.zeros(n), z, np.full(n, beta))
        np.testing.assert_allclose(share, 1 - 0.375, atol=1e-6)


@pytest.mark.parametrize("on", ["cpu", "gpu"])
def test_what_lies_at_the_depth_of_the_farthest_wall_is_before_it(on):
    on = gpu.device() if on == "gpu" else on
    depth = [0.25, 0.5, 0.25, 0.75, 0.5, 0.75]  # of two pixels, each with glass, glass and a wall
    alpha = [0.5, 1, 0.25, 0.75, 0.5, 1]
    f = moit.Fragments(
        [0, 2, 6], depth, alpha, np.ones((6, 3)), shape=(1, 2), depth_range=(0, 1), dtype="f8"
    )
    technique = MomentTransparency(
        1, resolution=2, low_resolution="average", max_alpha=0.999, warp="linear"
    )
    expected = -np.log1p(-0.999 * np.array([0.5, 0.25, 0.75, 0.5])).sum() / 2
    if on == "cpu":
        b0, _ = moit.moments.gather(f, technique)
        np.testing.assert_allclose(b0, expected, rtol=1e-12)
    total = moit.total_transmittance(f, technique, cull_opaque=True, device=on, exact=True)
    np.testing.assert_array_equal(total, moit.total_transmittance(f, technique))


# ---- The paper's figure 2 ------------------------------------------------------------------------


def apart(n: int, gap: float, seed: int = 0, dtype="float64", count: int = 4000) -> moit.Fragments:
    """Rays of n surfaces at least `gap` apart, in random order."""
    rng = np.random.default_rng(seed)
    depth = np.sort(rng.uniform(0, 1, (count, n)), axis=1)
    depth = depth[(np.diff(depth, axis=1) > gap).all(axis=1)] if n > 1 else depth
    depth = rng.permuted(depth, axis=1)
    alpha = rng.uniform(0.1, 0.9, depth.shape)
    offsets = np.arange(len(depth) + 1) * n
    color = rng.random((depth.size, 3))
    return moit.Fragments(
        offsets, depth.ravel(), alpha.ravel(), color, depth_range=(0, 1), dtype=dtype
    )


def error(f: moit.Fragments, technique) -> np.ndarray:
    return moit.transmittance(f, technique) - moit.transmittance(f, "sorted")


@pytest.mark.parametrize("storage", ["float32", "nlqm"])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_up_to_three_surfaces_come_back(n, storage):
    found = np.abs(error(apart(n, 0.1), unwarped(1, storage)))
    # alpha is scaled by 1/512 of itself, 1 - alpha thus off by 2 %; for three surfaces the bias
    # counts; rounded nodes may come to lie in front of their surface
    assert np.quantile(found, 0.99) <= 0.02
    assert np.sqrt(np.mean(found**2)) <= 3e-3


def test_without_bias_and_scaling_two_surfaces_are_exact():
    exact = unwarped(bias=0.0, max_alpha=1 - 1e-12)
    assert np.abs(error(apart(2, 0.1), exact)).max() <= 1e-7


def test_overestimation_helps_curves_and_overshadows_in_front():
    z = np.linspace(0.02, 0.98, 33)
    for n in (4, 10, 20):
        f = apart(n, 0.0)
        truth = moit.transmittance(f, "sorted", depth=z)
        rms = [
            np.sqrt(np.mean((moit.transmittance(f, unwarped(overestimation=beta), z) - truth) ** 2))
            for beta in (0.0, 0.25)
        ]
        assert rms[1] < 0.6 * rms[0], n
        foremost = np.minimum.reduceat(f.depth, f.offsets[:-1])
        first = f.depth == np.repeat(foremost, f.counts)
        assert (moit.transmittance(f, unwarped())[first] >= 1 - 1e-5).all()
        assert moit.transmittance(f, unwarped(overestimation=0.25))[first].mean() <= 0.97, n


def test_two_passes_overshadow_few_surfaces_and_are_better_for_more():
    for n in (2, 3):
        basic, twice = (error(apart(n, 0.1), unwarped(passes)) for passes in (1, 2))
        assert twice.mean() <= -0.02 < basic.mean()
        assert np.abs(twice).mean() > 5 * np.abs(basic).mean()
    for n in (4, 6, 10, 20, 40):
        basic, twice = (error(apart(n, 0.0), unwarped(passes)) for passes in (1, 2))
        assert np.sqrt(np.mean(twice**2)) < 0.7 * np.sqrt(np.mean(basic**2)), n


def test_the_symmetric_interval_gives_nearly_the_same():
    # the bound is the same for any interval but for the bias, whose distribution is another
    f = apart(6, 0.0)
    found = moit.transmittance(f, unwarped(bias=0.0))
    at = {"warp": "linear", "bias": 0.0, "interval": "symmetric"}
    other = moit.transmittance(f, MomentTransparency(**at))
    assert np.quantile(np.abs(found - other), 0.999) <= 1e-6


# ---- Coverage, limits ----------------------------------------------------------------------------

KINDS = [
    MomentTransparency(warp="linear"),
    MomentTransparency(1, "nlqm", warp="linear"),
    MomentTransparency(1, "unorm16", warp="linear"),
    MomentTransparency(2, warp="linear"),
    MomentTransparency(1, "float32", 8, warp="linear"),
    MomentTransparency(2, "unorm16", 3, warp="linear", low_resolution="average"),
]
of_every_kind = pytest.mark.parametrize("technique", KINDS, ids=str)


def picture(height=19, width=27, most=9, seed=0, opaque=0.0, dtype="float32") -> moit.Fragments:
    """An image whose sides no block divides, some pixels empty."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, height * width)
    n = int(counts.sum())
    alpha = np.where(rng.random(n) < opaque, 1, rng.uniform(0, 0.95, n))
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.uniform(1, 10, n),
        alpha,
        rng.random((n, 3)),
        shape=(height, width),
        depth_range=(1, 10),
        dtype=dtype,
    )


@of_every_kind
@precisions
def test_coverage_is_exact(technique, dtype):
    f = picture(dtype=dtype, opaque=0.1)
    found = moit.composite(f, technique)[..., 3]
    truth = moit.composite(f, "sorted")[..., 3]
    np.testing.assert_allclose(found, truth, rtol=0, atol=4 * np.finfo(dtype).eps)


@of_every_kind
def test_grey_fragments_give_grey_as_much_as_they_cover(technique):
    f = picture(dtype="float64")
    grey = moit.Fragments(
        f.offsets, f.depth, f.alpha, np.ones((len(f), 3)), shape=f.shape, depth_range=(1, 10)
    )
    found = moit.composite(grey, technique, background=(0.25,) * 3)
    expected = found[..., 3] + 0.25 * (1 - found[..., 3])
    np.testing.assert_allclose(found[..., 0], expected, rtol=1e-12)


@of_every_kind
@precisions
def test_thin_and_opaque_layers_are_fine(technique, dtype):
    for alphas in ([1e-3], [1e-7, 1e-7], [1, 1, 1], [0, 0.5, 0], [1] * 40, [1 - 1e-7] * 3):
        n = len(alphas)
        f = moit.Fragments(
            [0, n],
            np.linspace(1, 10, n) if n > 1 else [3.0],
            alphas,
            np.full((n, 3), 0.5),
            depth_range=(1, 10),
            dtype=dtype,
        )
        T = moit.transmittance(f, technique, cull_opaque=False)
        assert ((T >= 0) & (T <= 1)).all() and T[0] >= 0.999
        found = moit.composite(f, technique, cull_opaque=False)[0, 0]
        cover = 1 - np.prod(1 - f.alpha.astype(float))
        np.testing.assert_allclose(found, [cover / 2] * 3 + [cover], rtol=1e-6, atol=1e-8)


def test_words_keep_what_words_can():
    f = picture(dtype="float64", most=5)
    whole = moit.transmittance(f, MomentTransparency(bias=3e-5))
    for storage, interval in (("nlqm", "unit"), ("unorm16", "unit"), ("unorm16", "symmetric")):
        held = moit.transmittance(f, MomentTransparency(1, storage, interval=interval))
        # a surface whose depth a word moves in front of it is all that differs much
        assert np.mean(np.abs(held - whole)) <= 0.03, (storage, interval)


# ---- Moments of blocks ---------------------------------------------------------------------------


def blocks_in_numpy(f: moit.Fragments, side: int, average: bool, cull_opaque: bool = True):
    """(b0 (P,), b (P, 4)) that pixels read, from MT 4.1, for depths in [0, 1]."""
    height, width = f.shape
    down, across = -(-height // side), -(-width // side)
    sums = np.zeros((down, across, 5))
    of = [slice(*f.offsets[p : p + 2]) for p in range(height * width)]
    for by in range(down):
        for bx in range(across):
            ys = range(by * side, min((by + 1) * side, height))
            xs = range(bx * side, min((bx + 1) * side, width))
            pixels = [y * width + x for y in ys for x in xs]
            walls = []
            for p in pixels:
                z, a = f.depth[of[p]], f.alpha[of[p]]
                walls.append(z[a == 1].min(initial=np.inf) if cull_opaque else np.inf)
            if not average:
                y = min(by * side + side // 2, height - 1)
                x = min(bx * side + side // 2, width - 1)
                pixels = [y * width + x]
            for p in pixels:
                z, a = (v[of[p]].astype(float) for v in (f.depth, f.alpha))
                keep = (z <= max(walls)) & ~((a == 1) & cull_opaque)
                w = -np.log1p(-a[keep] * SCALE)
                terms = [np.sum(w * z[keep] ** k) for k in range(5)]
                sums[by, bx] += np.array(terms) / len(pixels)

    def shares(pixel: int, blocks: int) -> list[tuple[int, float]]:
        at = (pixel + 0.5) / side - 0.5
        low = int(np.floor(at))
        pair = [(low, 1 - (at - low)), (low + 1, at - low)]
        return [(min(max(block, 0), blocks - 1), share) for block, share in pair]

    read = np.zeros((height, width, 5))
    for y in range(height):
        for x in range(width):
            for by, sy in shares(y, down):
                for bx, sx in shares(x, across):
                    read[y, x] += sy * sx * sums[by, bx]
    read = read.reshape(-1, 5)
    b0 = read[:, 0]
    return b0, read[:, 1:] / np.where(b0 > 0, b0, 1)[:, None]


@pytest.mark.parametrize("cull_opaque", [True, False])
@pytest.mark.parametrize("low_resolution", ["raster", "average"])
@pytest.mark.parametrize("side", [2, 3, 8, 40])
def test_pixels_read_the_moments_of_blocks(side, low_resolution, cull_opaque):
    f = picture(seed=side, opaque=0.3, dtype="float64")
    unit = moit.Fragments(f.offsets, (f.depth - 1) / 9, f.alpha, shape=f.shape, depth_range=(0, 1))
    technique = unwarped(resolution=side, low_resolution=low_resolution)
    b0, b = moit.moments.gather(unit, technique, cull_opaque=cull_opaque)
    expected = blocks_in_numpy(unit, side, low_resolution == "average", cull_opaque)
    np.testing.assert_allclose(b0, expected[0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(b, expected[1], rtol=0, atol=1e-12)
    z = np.tile(np.linspace(0, 1, 9), (len(b0), 1))
    curve = moit.transmittance(unit, technique, z[0], cull_opaque=False)
    if not cull_opaque:
        alone = moit.moments.transmittance(technique, b0, b, z)
        np.testing.assert_allclose(curve.reshape(alone.shape)[:, :8], alone[:, :8], rtol=1e-14)


def in_blocks(rows: moit.Fragments, side: int) -> moit.Fragments:
    """An image where each pixel of `rows` fills a block."""
    height, width = rows.shape
    place = np.arange(height * width).reshape(height, width)
    place = place.repeat(side, axis=0).repeat(side, axis=1)
    counts = rows.counts[place.ravel()]
    take = np.concatenate([np.arange(*rows.offsets[p : p + 2]) for p in place.ravel()])
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rows.depth[take],
        rows.alpha[take],
        rows.color[take],
        shape=place.shape,
        depth_range=rows.depth_range,
    )


@pytest.mark.parametrize("low_resolution", ["raster", "average"])
@pytest.mark.parametrize("passes", [1, 2])
def test_in_the_middle_of_blocks_of_equal_pixels_full_resolution_comes_back(passes, low_resolution):
    f = in_blocks(picture(5, 7, dtype="float64"), 3)
    low = moit.composite(f, MomentTransparency(passes, "float32", 3, low_resolution=low_resolution))
    full = moit.composite(f, MomentTransparency(passes))
    # the middle of an odd block is a pixel's own
    np.testing.assert_allclose(low[1::3, 1::3], full[1::3, 1::3], rtol=0, atol=1e-6)
    assert np.abs(low - full).max() > 0.01  # elsewhere neighbours mix in


@pytest.mark.parametrize("low_resolution", ["raster", "average"])
@pytest.mark.parametrize("passes", [1, 2])
def test_where_all_pixels_are_equal_full_resolution_comes_back(passes, low_resolution):
    f = in_blocks(picture(1, 1, seed=1, dtype="float64"), 20)
    low = moit.composite(f, MomentTransparency(passes, "float32", 8, low_resolution=low_resolution))
    np.testing.assert_allclose(low, moit.composite(f, MomentTransparency(passes)), rtol=1e-6)


def wall_and_glass(gap: bool) -> moit.Fragments:
    """8 x 8 pixels of two panes of glass and a wall, which in one pixel is farther or missing."""
    rows = [[(0.2, 1), (0.9, 0.8), (0.4, 0.5)] for _ in range(64)]
    rows[3] = [(0.9, 0.8)] if gap else [(0.5, 1), (0.9, 0.8)]
    return rays(*rows, shape=(8, 8))


@pytest.mark.parametrize("low_resolution", ["raster", "average"])
def test_blocks_hold_what_lies_in_front_of_their_farthest_opaque_surface(low_resolution):
    technique = unwarped(resolution=8, low_resolution=low_resolution)
    b0, b = moit.moments.gather(wall_and_glass(gap=False), technique)
    # the pane at 0.4 lies behind its own pixels' wall and in front of the farthest, that at 0.9
    # behind it
    share = 1 if low_resolution == "raster" else 63 / 64
    np.testing.assert_allclose(b0, -np.log1p(-0.5 * SCALE) * share)
    np.testing.assert_allclose(b[:, 0], 0.4)
    # where one pixel has no wall, nothing of the block is hidden
    b0, b = moit.moments.gather(wall_and_glass(gap=True), technique)
    both = -np.log1p(-np.array([0.5, 0.8]) * SCALE)
    middle = both.sum() if low_resolution == "raster" else both[0] * share + both[1]
    np.testing.assert_allclose(b0, middle)


def test_blocks_of_a_crop_are_those_of_the_whole():
    f = picture(40, 48, dtype="float64")
    for technique in (MomentTransparency(resolution=8), MomentTransparency(2, resolution=5)):
        whole = moit.composite(f, technique)
        part = moit.composite(f[3:37, 5:44], technique)
        inside = slice(11, -11)
        assert (part[inside, inside] == whole[3:37, 5:44][inside, inside]).all()


def test_one_row_of_pixels_has_blocks_of_one_row():
    f = picture(1, 50, dtype="float64")
    unit = moit.Fragments(f.offsets, (f.depth - 1) / 9, f.alpha, depth_range=(0, 1))
    b0, _ = moit.moments.gather(unit, unwarped(resolution=8))
    np.testing.assert_allclose(b0, blocks_in_numpy(unit, 8, average=False)[0])


# ---- Moments by themselves, bounds, names --------------------------------------------------------


@of_every_kind
@precisions
def test_what_is_gathered_reads_back_to_the_transmittance(technique, dtype):
    f = picture(dtype=dtype)
    state = moit.moments.gather(f, technique)
    z = np.linspace(0, 1, 7).astype(dtype)
    curve = moit.transmittance(f, technique, depth=(1 + 9 * z)).reshape(-1, 7)
    rows = len(curve)
    alone = moit.moments.transmittance(technique, *state, np.tile(z, (rows, 1)))
    if technique.passes == 2:
        (b0, b), (second_b0, second_b) = state
        assert b.shape == second_b.shape == (rows, 4) and b0.shape == second_b0.shape == (rows,)
        assert (second_b0 <= b0 * 1.001).all()
    # behind all is the exact coverage, and T = 0 is as little as a picture can show; warped depths
    # differ by their last digit
    inner = np.abs(curve - alone)[:, 1:-1]
    assert np.quantile(inner, 0.98) <= 1e-4


def decoded(technique, words: np.ndarray) -> np.ndarray:
    """Moments of depths in [0, 1] that words stand for, up to the offset's least value."""
    w = words / 65535
    if technique.storage == "nlqm":
        powers = [w[:, i, None] ** np.arange(1, 5) for i in (0, 1)]
        weight = w[:, 2, None]
        b = (1 - weight) * powers[0] + weight * powers[1]
        b[:, 3] += w[:, 3] ** 8 / 64
        return b
    encode = np.array(
        [
            [-2.07224649, 13.7948857237, 0.105877704, 9.7924062118],
            [32.23703778, -59.4683975703, -1.9077466311, -33.7652110555],
            [-68.571074599, 82.0359750338, 9.3496555107, 47.9456096605],
            [39.3703274134, -35.364903257, -6.6543490743, -23.9728048165],
        ]
    )
    w[:, 0] -= 0.035955884801
    return w @ np.linalg.inv(encode)


@precisions
@pytest.mark.parametrize("storage", ["nlqm", "unorm16"])
@pytest.mark.parametrize("passes", [1, 2])
def test_raw_moments_are_words_that_decode_to_them(passes, storage, dtype):
    f = picture(dtype=dtype, most=20)
    technique = MomentTransparency(passes, storage, warp="linear")
    states = moit.moments.gather(f, technique), moit.moments.gather(f, technique, raw=True)
    pairs = zip(*states, strict=True) if passes == 2 else [states]
    for (b0, b), (half, words) in pairs:
        full = b0 > 0
        assert words.dtype == np.uint16 and words.shape == b.shape
        assert (half == half.astype(np.float16)).all()
        np.testing.assert_allclose(half, b0, rtol=2.0**-11)
        # half a word of every part; nodes enter the fourth moment four times, and bias shows where
        # surfaces all but coincide
        off = np.abs(decoded(technique, words) - b)[full].max(axis=1)
        assert np.quantile(off, 0.95) <= 4e-5


@of_every_kind
def test_bounds_hold_and_say_something_where_moments_are_the_pixels_own(technique):
    f = picture(dtype="float32")
    lower, upper = moit.bounds(f, technique)
    exact = moit.transmittance(f, "sorted").astype(float)
    assert (lower <= exact * (1 + 1e-6)).all() and (upper >= exact * (1 - 1e-6)).all()
    proves = technique.resolution == 1
    assert ((upper < 0.99).mean() > 0.1) == proves
    if proves:
        state = moit.moments.gather(f, technique)
        z = np.full((len(f.counts), 1), 0.5, np.float32)
        low, high = moit.moments.bounds(technique, *state, z)
        exact = moit.transmittance(f, "sorted", depth=[5.5]).reshape(z.shape)
        assert (high >= exact * (1 - 1e-6)).all() and (low <= high).all()


@pytest.mark.parametrize(
    ("technique", "name", "bits", "published"),
    [
        (MomentTransparency(), "moment-transparency", 160, 32),
        (MomentTransparency(storage="nlqm"), "moment-transparency-nlqm", 240, 42),
        (MomentTransparency(resolution=8), "moment-transparency-lr8", 2.5, 12.3125),
        (MomentTransparency(2), "two-moments-pass", 320, 52),
        (MomentTransparency(2, resolution=8), "two-moments-pass-lr8", 5, 12.625),
    ],
)
def test_names_and_bits_are_those_of_the_table(technique, name, bits, published):
    assert str(technique) == name
    assert moit.technique(name) == technique and technique in moit.techniques()
    assert technique.bits_per_pixel == bits
    assert technique.published_bits == {"MT": 8 * published}
    assert technique.order_independent


@pytest.mark.parametrize(
    "name",
    [
        "moment-transparency(storage='unorm16')",
        "moment-transparency-lr8(low_resolution='average',storage='unorm16')",
        "moment-transparency(interval='symmetric',resolution=4)",
        "two-moments-pass(overestimation=0.25,storage='nlqm')",
        "two-moments-pass-lr8(bias=0.0)",
    ],
)
def test_names_show_options(name):
    assert str(moit.technique(name)) == name
    assert moit.technique(str(moit.technique(name))) == moit.technique(name)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"passes": 3}, ValueError, "passes: expected 1, 2"),
        ({"storage": "half"}, ValueError, "storage: expected 'float32', 'nlqm', 'unorm16'"),
        ({"resolution": 0}, ValueError, "resolution: expected an integer from 1"),
        ({"resolution": 1.5}, TypeError, "resolution: expected an integer"),
        ({"resolution": 8, "storage": "nlqm"}, ValueError, "expected 1 with storage='nlqm', got 8"),
        ({"resolution": 8, "depth_range": "pixel"}, ValueError, "expected 1 with depth_range"),
        ({"resolution": 8, "exclude_self": True}, ValueError, "expected 1 with exclude_self"),
        ({"interval": "[0, 1]"}, ValueError, "interval: expected 'unit', 'symmetric'"),
        ({"low_resolution": "mean"}, ValueError, "low_resolution: expected 'raster', 'average'"),
    ],
)
def test_bad_options_say_what_was_found_and_needed(options, error, words):
    with pytest.raises(error, match=re.escape(words)):
        MomentTransparency(**options)


def test_states_of_two_passes_must_come_as_pairs():
    technique = MomentTransparency(2)
    (b0, b), second = moit.moments.gather(picture(), technique)
    with pytest.raises(ValueError, match="pairs of b0"):
        moit.moments.transmittance(technique, b0, b, np.zeros((len(b0), 1)))
    with pytest.raises(ValueError, match="b0 must be"):
        moit.moments.transmittance(technique, (b0, b[1:]), second, np.zeros((len(b0), 1)))


@pytest.mark.parametrize("technique", KINDS[4:], ids=str)
def test_blocks_are_the_same_bits_for_any_threads(technique):
    f = picture(100, 131, seed=4)
    one = moit.composite(f, technique, threads=1)
    for threads in (2, 5):
        assert (moit.composite(f, technique, threads=threads) == one).all()


# ---- One text ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def many() -> moit.Fragments:
    """Hard rays of every kind, ordinary ones, and an empty one, with depths in [0, 1]."""
    offsets, depth, alpha = flat(hard_rays(seed=11, of_each_kind=10))
    rng = np.random.default_rng(12)
    counts = np.append(rng.integers(1, 30, 300), 0)
    more = int(counts.sum())
    return moit.Fragments(
        np.concatenate([offsets, offsets[-1] + np.cumsum(counts)]),
        np.concatenate([(depth + 1) / 2, rng.uniform(0, 1, more)]),
        np.concatenate([alpha, rng.uniform(0, 1, more)]),
    )


def depths_of(f: moit.Fragments, each: int, dtype) -> np.ndarray:
    """Depths between 0 and 1, half of them a fragment's."""
    rng = np.random.default_rng(7)
    z = rng.uniform(0, 1, (len(f.counts), each))
    full = f.counts > 0
    z[full, : each // 2] = f.depth[f.offsets[:-1][full], None]
    return z.astype(dtype)


@precisions
def test_scaled_absorbance_is_the_same_bits_in_glsl_and_good_to_the_last_digits(dtype, many):
    alpha = np.concatenate([many.alpha, np.geomspace(1e-12, 1, 1000), [0, 1]]).astype(dtype)
    one = moit.Fragments(
        np.arange(len(alpha) + 1), np.zeros(len(alpha)), alpha, depth_range=(0, 1), dtype=dtype
    )
    found = glsl.state_of(one, unwarped())[:, 4]
    b0, _ = moit.moments.gather(one, unwarped(), cull_opaque=False)
    np.testing.assert_array_equal(found, b0)
    with mp.workdps(40):
        truth = [-mp.log(1 - mp.mpf(float(a)) * (1 - mp.mpf(1) / 512)) for a in alpha]
    # two roundings more than that of a logarithm
    np.testing.assert_allclose(
        found.astype(float), np.array(truth, float), rtol=3 * np.finfo(dtype).eps
    )


@precisions
@pytest.mark.parametrize("storage", ["float32", "nlqm", "unorm16"])
def test_stored_moments_are_read_to_the_same_bits_in_glsl(many, storage, dtype):
    f = moit.Fragments(many.offsets, many.depth, many.alpha, dtype=dtype)
    for interval, z in (
        ("unit", depths_of(f, 8, dtype)),
        ("symmetric", 2 * depths_of(f, 8, dtype) - 1),
    ):
        depth = f.depth if interval == "unit" else 2 * f.depth - 1
        given = moit.Fragments(f.offsets, depth, f.alpha, depth_range=(-1, 1))
        technique = unwarped(1, storage, interval=interval, overestimation=0.25)
        b0, b = moit.moments.gather(given, technique)
        found = glsl.curves_of_state(technique, np.column_stack([b, b0]), z)
        np.testing.assert_array_equal(found, moit.moments.transmittance(technique, b0, b, z))


@precisions
@pytest.mark.parametrize("storage", ["float32", "nlqm", "unorm16"])
def test_second_moments_are_read_to_the_same_bits_in_glsl(many, storage, dtype):
    technique = unwarped(2, storage)
    f = moit.Fragments(many.offsets, many.depth, many.alpha, dtype=dtype)
    first, second = moit.moments.gather(f, technique)
    z = depths_of(f, 8, dtype)
    state = np.column_stack([first[1], first[0], second[1], second[0]])
    found = glsl.curves_of_state(technique, state, z)
    expected = moit.moments.transmittance(technique, first, second, z)
    np.testing.assert_array_equal(found, expected)


def test_words_of_either_interval_decode_to_the_moments():
    z = 2 * np.linspace(0, 1, 400)[:, None] - 1
    rng = np.random.default_rng(3)
    weights = rng.dirichlet(np.ones(6), 500)
    places = rng.uniform(-1, 1, (500, 6))
    mixed = np.stack([(weights * places**k).sum(axis=1) for k in (1, 2, 3, 4)], axis=1)
    for symmetric in (True, False):
        b = np.concatenate([np.hstack([z, z**2, z**3, z**4]), mixed])
        if not symmetric:
            y = np.concatenate([(z + 1) / 2])
            places01 = (places + 1) / 2
            more = np.stack([(weights * places01**k).sum(axis=1) for k in (1, 2, 3, 4)], axis=1)
            b = np.concatenate([np.hstack([y, y**2, y**3, y**4]), more])
        words, moments = c.quantised_moments(b, symmetric)
        assert words.min() >= 0 and words.max() <= 65535
        # a word is off by half; the decoding matrices' rows sum to at most 2.1 in absolute value
        assert np.abs(moments - b).max() <= 2.2 * 0.5 / 65535
