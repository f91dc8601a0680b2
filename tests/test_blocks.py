"""States of blocks of pixels, against a model in NumPy of their means and of what lies between."""

import dataclasses

import numpy as np
import pytest
from small import some_fragments
from variants import BLOCKS

import moit
from moit.fragments.squares import Squares, squares_of

MOMENTS = [
    moit.PowerMoments(4),
    moit.PowerMoments(8),
    moit.TrigonometricMoments(2),
    moit.BoundedNeural("power6"),
]
SERIES = [
    moit.FourierOpacity(15, bits=32),
    moit.WaveletTransparency(16),
    moit.WaveletTransparency(16, projected="density"),
    moit.TransmittanceFunctionMap(8, bits=32),
]
of_every_kind = pytest.mark.parametrize("technique", [*MOMENTS, *SERIES], ids=str)
of_moments = pytest.mark.parametrize("technique", MOMENTS, ids=str)
totals = pytest.mark.parametrize("total", ["block", "full"])


def picture(opaque=0.0, dtype="float64", **options) -> moit.Fragments:
    """An image whose sides no block divides, some pixels empty, and opaque surfaces here and
    there."""
    f = some_fragments(19, 27, 7, dtype=dtype, **options)
    alpha = np.where(np.random.default_rng(1).random(len(f)) < opaque, 1, f.alpha)
    return moit.Fragments(f.offsets, f.depth, alpha, f.color, shape=f.shape, depth_range=(1, 10))


def with_rows(f: moit.Fragments, pixel) -> moit.Fragments:
    """An image that in place of each pixel has that of the index (height, width)."""
    pixel = np.asarray(pixel)
    take = np.concatenate([np.arange(*f.offsets[p : p + 2]) for p in pixel.ravel()])
    counts = f.counts.ravel()[pixel.ravel()]
    arrays = (None if a is None else a[take] for a in (f.depth, f.alpha, f.color))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return moit.Fragments(offsets, *arrays, shape=pixel.shape, depth_range=f.depth_range)


def read_between(rows: np.ndarray, side: int, origin=(0, 0)) -> np.ndarray:
    """What pixels read of numbers (height, width, n), each of its own: means over blocks, bilinear
    between their middles."""
    height, width, n = rows.shape
    top, left = origin[0] % side, origin[1] % side
    down, across = -(-(top + height) // side), -(-(left + width) // side)
    of_row, of_column = (np.arange(height) + top) // side, (np.arange(width) + left) // side
    sums = np.zeros((down, across, n))
    np.add.at(sums, (of_row[:, None], of_column[None]), rows)
    means = sums / (np.bincount(of_row)[:, None] * np.bincount(of_column))[..., None]

    def shares(pixels, first, blocks):
        at = (np.arange(pixels) + first + 0.5) / side - 0.5
        low = np.floor(at).astype(int)
        found = np.zeros((pixels, blocks))
        for block, share in ((low, 1 - (at - low)), (low + 1, at - low)):
            np.add.at(found, (np.arange(pixels), np.clip(block, 0, blocks - 1)), share)
        return found

    along, along_x = shares(height, top, down), shares(width, left, across)
    return np.einsum("yi,xj,ijn->yxn", along, along_x, means)


@pytest.mark.parametrize("cull_opaque", [True, False])
@pytest.mark.parametrize("side", [2, 3, 8, 40])
@of_moments
def test_pixels_read_means_of_moments(technique, side, cull_opaque):
    for f in (picture(opaque=0.2), picture(opaque=0.2)[3:17, 5:25]):
        b0, b = moit.moments.gather(f, technique, cull_opaque=cull_opaque)
        parts = b0[:, None] * b
        pairs = np.iscomplexobj(b)
        parts = np.column_stack([b0, parts.real, parts.imag] if pairs else [b0, parts])
        expected = read_between(parts.reshape(*f.shape, -1), side, f.origin).reshape(parts.shape)
        mean, share = expected[:, 0], expected[:, 1:]
        if pairs:
            count = share.shape[1] // 2
            share = share[:, :count] + 1j * share[:, count:]
        one = dataclasses.replace(technique, resolution=side)
        found = moit.moments.gather(f, one, cull_opaque=cull_opaque)
        np.testing.assert_allclose(found[0], mean, rtol=1e-12, atol=1e-15)
        expected = share / np.where(mean > 0, mean, 1)[:, None]
        np.testing.assert_allclose(found[1], expected, rtol=0, atol=1e-12)

        full = dataclasses.replace(one, total="full")
        own = moit.moments.gather(f, full, cull_opaque=cull_opaque)
        np.testing.assert_array_equal(own[0], b0)
        np.testing.assert_array_equal(own[1], found[1])


@totals
@pytest.mark.parametrize("side", [2, 5, 8])
def test_pixels_read_means_of_wavelets(side, total):
    """Of densities, which are no less than nothing, so that nothing is clamped."""
    f, depth = picture(), np.linspace(1, 10, 40)
    technique = moit.WaveletTransparency(16, projected="density", max_alpha=0.999)
    before = -np.log(moit.transmittance(f, technique, depth))
    expected = read_between(before, side)
    if total == "full":
        scale = before[..., -1] / np.where(expected[..., -1] > 0, expected[..., -1], 1)
        expected = expected * scale[..., None]
    one = dataclasses.replace(technique, resolution=side, total=total)
    inside = depth[1:-1]  # behind the last a curve is the total
    found = -np.log(moit.transmittance(f, one, inside))
    np.testing.assert_allclose(found, expected[..., 1:-1], rtol=1e-9, atol=1e-12)


@totals
@pytest.mark.parametrize("side", [3, 8])
def test_pixels_read_means_of_what_maps_take(side, total):
    """Of maps of one number, the mean transmittance along the ray, so that nothing is clamped."""
    f, depth = picture(), np.linspace(2, 9, 3)
    technique = moit.TransmittanceFunctionMap(1, bits=32)
    expected = read_between(1 - moit.transmittance(f, technique, depth), side)
    if total == "full":
        own = 1 - moit.total_transmittance(f, technique)[..., None]
        read = read_between(own, side)
        expected = expected * own / np.where(read > 0, read, 1)
    one = dataclasses.replace(technique, resolution=side, total=total)
    found = 1 - moit.transmittance(f, one, depth)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


@of_every_kind
def test_a_block_is_what_its_pixels_are_in_any_places(technique):
    f, depth = picture(), np.linspace(1.5, 9, 12)
    place = np.arange(64).reshape(8, 8)
    shuffled = np.random.default_rng(2).permutation(64).reshape(8, 8)
    one = dataclasses.replace(technique, resolution=8)
    found, other = (moit.transmittance(with_rows(f, p), one, depth) for p in (place, shuffled))
    np.testing.assert_allclose(found, np.broadcast_to(found[:1, :1], found.shape), rtol=1e-7)
    np.testing.assert_allclose(other, found, rtol=0, atol=1e-6)


@totals
@of_every_kind
def test_where_all_pixels_are_equal_full_resolution_comes_back(technique, total):
    f = with_rows(picture(), np.full((21, 22), np.argmax(picture().counts)))
    own = {"exclude_self": True} if hasattr(technique, "exclude_self") else {}
    one = dataclasses.replace(technique, resolution=4, total=total, **own)
    whole = dataclasses.replace(one, resolution=1, total="block")
    found, expected = moit.composite(f, one), moit.composite(f, whole)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-5)
    assert np.ptp(found, axis=(0, 1)).max() < 1e-6


@of_every_kind
def test_what_reaches_the_background_is_each_pixels_own(technique):
    f = picture(opaque=0.1)
    exact = moit.total_transmittance(f, "sorted")
    one = dataclasses.replace(technique, resolution=4)
    np.testing.assert_allclose(moit.total_transmittance(f, one), exact, rtol=1e-14)
    np.testing.assert_allclose(moit.composite(f, one)[..., 3], 1 - exact, rtol=0, atol=1e-14)
    own = moit.total_transmittance(f, technique)
    full = moit.total_transmittance(f, dataclasses.replace(one, total="full"))
    np.testing.assert_allclose(full, own, rtol=1e-11)
    np.testing.assert_allclose(own, exact, rtol=1e-9)


@pytest.mark.parametrize("technique", BLOCKS, ids=str)
def test_blocks_of_a_crop_are_those_of_the_whole(technique):
    f = some_fragments(40, 48)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, shape=f.shape, depth_range=(1, 10))
    whole, part = moit.composite(f, technique), moit.composite(f[3:37, 5:44], technique)
    inside = slice(13, -13)
    assert (part[inside, inside] == whole[3:37, 5:44][inside, inside]).all()


@pytest.mark.parametrize("technique", BLOCKS, ids=str)
def test_threads_and_precisions_agree(technique):
    f = picture(dtype="float32", opaque=0.1)
    once = moit.composite(f, technique, threads=1)
    for one in (f, f[3:, 5:], f[1:12, 2:]):  # crops begin within a row of blocks
        expected = moit.composite(one, technique, threads=1)
        np.testing.assert_array_equal(moit.composite(one, technique, threads=5), expected)
    double = moit.composite(picture(opaque=0.1), technique)
    assert np.quantile(np.abs(double - once), 0.99) <= 2e-3


def test_a_total_of_its_own_helps_where_blocks_are_at_an_edge():
    """Half of the pixels have a pane more, from column 4 on; blocks are from column 0 on."""
    pane, panes = [(2, 0.5), (4, 0.4)], [(1.5, 0.9), (2, 0.5), (4, 0.4)]
    rows = [panes if x >= 4 else pane for _ in range(16) for x in range(16)]
    depth, alpha = np.array([one for row in rows for one in row]).T
    offsets = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    color = np.random.default_rng(0).random((len(depth), 3))
    f = moit.Fragments(offsets, depth, alpha, color, shape=(16, 16), depth_range=(1, 10))
    exact = moit.transmittance(f, "sorted")
    error = {}
    for total in ("block", "full"):
        one = moit.PowerMoments(6, resolution=8, total=total, exclude_self=True)
        error[total] = np.sqrt(np.mean((moit.transmittance(f, one) - exact) ** 2))
    assert error["full"] < 0.7 * error["block"]


@pytest.mark.parametrize(
    ("name", "bits"),
    [
        ("power4(resolution=4)", 160 / 16),
        ("power4(resolution=4,total='full')", 160 / 16 + 32),
        ("power6(resolution=8)", 3.5),
        ("trig3(resolution=2)", 7 * 32 / 4),
        ("neural-bounded(resolution=8,total='full')", 34.5),
        ("fourier7(resolution=2,total='full')", 7 * 16 / 4 + 16),
        ("wavelet8(resolution=4)", 16),
        ("transmittance-function-map7(resolution=4,total='full')", 8 + 16),
        ("wavelet8(bits=16,resolution=4,total='full')", 24),
    ],
)
def test_bits_are_those_of_a_blocks_share_and_a_pixels_total(name, bits):
    one = moit.technique(name)
    assert one.bits_per_pixel == bits
    assert not one.local
    assert one.published_bits == {}
    assert moit.technique(str(one)) == one


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("power4(resolution=0)", "resolution: expected an integer from 1"),
        ("power4(upsampling='depth-aware')", "upsampling: expected 'bilinear' with resolution=1"),
        ("slices8(upsampling='depth-aware')", "upsampling: expected 'bilinear' with resolution=1"),
        ("power4(total='full')", "total: expected 'block' with resolution=1"),
        ("power4(resolution=2,total='pixel')", "total: expected 'block', 'full', got 'pixel'"),
        ("power4-16(resolution=2)", "resolution: expected 1 with bits=16, got 2"),
        ("trig2(resolution=2,depth_range='pixel')", "expected 1 with depth_range='pixel', got 2"),
        ("wavelet8(resolution=4,depth_range='pixel')", "expected 1 with depth_range='pixel'"),
        ("adaptive4(resolution=2)", "there is no option 'resolution'"),
    ],
)
def test_what_has_no_meaning_is_refused(name, message):
    with pytest.raises(ValueError, match=message):
        moit.technique(name)


def wall_with_a_gap(shift=0.0) -> moit.Fragments:
    """Left a near wall with thin glass before it, right a far one with much more glass."""
    near, far = [(2, 0.2), (3, 1)], [(2, 0.2), (4, 0.9), (5, 0.8), (9, 1)]
    rows = [near if x < 4 else far for _ in range(8) for x in range(12)]
    depth, alpha = np.array([one for row in rows for one in row]).T
    offsets = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    color = np.ones((len(depth), 3))
    return moit.Fragments(offsets, depth - shift, alpha, color, shape=(8, 12), dtype="float64")


def test_blocks_count_by_how_near_their_surfaces_are():
    f = wall_with_a_gap()
    one = moit.PowerMoments(4, resolution=4)
    b0, _ = moit.moments.gather(f, one)
    aware, _ = moit.moments.gather(f, dataclasses.replace(one, upsampling="depth-aware"))
    own, _ = moit.moments.gather(f, moit.PowerMoments(4))
    b0, aware, own = (x.reshape(f.shape) for x in (b0, aware, own))
    beside = [3, 4]  # of the edge, which is one of blocks, too
    assert (np.abs(b0 - own)[:, beside] > 0.3).all()
    # a share of 3/8 beside 5/8 counts a hundredth and less where surfaces are that far apart
    assert (np.abs(aware - own)[:, beside] < 0.02).all()
    np.testing.assert_allclose(aware[:, 8:], own[:, 8:], rtol=1e-12)
    # without surfaces, and where they are not taken apart, shares are bilinear
    for options in ({"cull_opaque": False}, {}):
        g = f if options else picture()
        first, second = (
            moit.moments.gather(g, dataclasses.replace(one, upsampling=how), **options)
            for how in ("bilinear", "depth-aware")
        )
        np.testing.assert_array_equal(first[1], second[1])


def test_slices_of_blocks_count_by_how_near_their_surfaces_are():
    f, depth = wall_with_a_gap(), [4.5]  # between the glass in front of the farther wall
    one = moit.Slices(8, 16, resolution=4, cells=64, warp="linear")
    ways = one, dataclasses.replace(one, upsampling="depth-aware"), moit.Slices(8, 16, cells=64)
    beside = np.s_[:, 4]  # the edge
    plain, aware, own = (-np.log(moit.transmittance(f, way, depth)[beside]) for way in ways)
    assert (np.abs(plain - own) > 0.3).all()
    assert (np.abs(aware - own) < 0.03).all()
    ways = ways[:2]
    plain, aware = (moit.transmittance(f, way, depth, cull_opaque=False) for way in ways)
    np.testing.assert_array_equal(plain, aware)


def test_pixels_without_a_surface_count_blocks_without_one():
    """A near wall covers the first block of each row, and nothing is behind the others."""
    width, height = 12, 4
    walled = np.tile(np.arange(width) < 4, height)
    counts = np.where(walled, 2, 1)
    offsets = np.append(0, np.cumsum(counts))
    depth, alpha = np.full(offsets[-1], 1.5), np.full(offsets[-1], 0.8)
    alpha[offsets[:-1][walled]] = 0.2
    depth[offsets[1:][walled] - 1], alpha[offsets[1:][walled] - 1] = 2, 1
    f = moit.Fragments(offsets, depth, alpha, shape=(height, width), depth_range=(1, 9))
    one = moit.PowerMoments(4, resolution=4)
    b0, _ = moit.moments.gather(f, one)
    aware, _ = moit.moments.gather(f, dataclasses.replace(one, upsampling="depth-aware"))
    own, _ = moit.moments.gather(f, moit.PowerMoments(4))
    b0, aware, own = (x.reshape(f.shape) for x in (b0, aware, own))
    assert (np.abs(b0 - own)[:, 4] > 0.3).all()
    assert (np.abs(aware - own)[:, 4] < 0.25 * np.abs(b0 - own)[:, 4]).all()


def test_depths_to_go_by_are_positive():
    f = wall_with_a_gap(shift=3.5)
    one = moit.PowerMoments(4, resolution=4, upsampling="depth-aware", warp="linear")
    for way in (one, moit.Slices(8, resolution=4, upsampling="depth-aware", warp="linear")):
        with pytest.raises(
            moit.FragmentsError, match=r"depth\[1\]: found -0\.5; needed positive depth of op"
        ):
            moit.composite(f, way)


def test_a_shadow_map_has_states_of_its_own():
    glass = moit.Mesh([[-1, 1, -1], [1, 1, -1], [0, 1, 1]], [[0, 1, 2]], alpha=0.5)
    for name in ("power6(resolution=2)", "wavelet8(resolution=2)"):
        with pytest.raises(ValueError, match=r"states of blocks.*resolution=1"):
            moit.ShadowMap(glass, name, light=(0, -1, 0), resolution=8)


def test_squares_count_from_row_and_column_0_of_the_display():
    f = moit.Fragments(np.zeros(7, int), [], [], shape=(2, 3), origin=(1, 4), depth_range=(1, 2))
    assert squares_of(f, 3) == Squares(side=3, left=1, top=1, across=2, down=1)
    f = moit.Fragments(np.zeros(7, int), [], [], shape=(2, 3), origin=(2, -3), depth_range=(1, 2))
    assert squares_of(f, 3) == Squares(side=3, left=0, top=2, across=1, down=2)
