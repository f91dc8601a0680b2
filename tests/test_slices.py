"""Slices of optical depth: whole sums, one's own share, and what they prove.

The reference reads slices by their definition, in float64, without rounding to steps.
"""

import gpu
import numpy as np
import pytest

import moit
from moit import Slices

STEP = {8: np.log(256) / 255, 16: np.log(65536) / 65535}
VARIANTS = [
    Slices(64),
    Slices(5),
    Slices(16, 16, "tile", tile=2),
    Slices(32, 8, "pixel"),
    Slices(16, resolution=2),
    Slices(64, 16, resolution=4, total="full"),
    Slices(16, 8, "tile", tile=4, resolution=2, total="full"),
    Slices(8, 8, "pixel", resolution=2, warp="linear"),
    Slices(8, inside="power4", depth_range="pixel"),
]
variants = pytest.mark.parametrize("technique", VARIANTS, ids=str)
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def picture(seed, width=9, height=6, most=20, dtype=np.float32, opaque=0.0):
    """Rays of up to `most` fragments, some at one depth."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, width * height)
    n = counts.sum()
    depth = np.where(rng.random(n) < 0.2, rng.integers(2, 6, n), rng.uniform(1, 8, n))
    alpha = rng.uniform(0, 1, n) ** rng.integers(1, 4, n)
    alpha[rng.random(n) < opaque] = 1
    return moit.Fragments(
        np.append(0, np.cumsum(counts)),
        depth.astype(dtype),
        alpha.astype(dtype),
        rng.random((n, 3)).astype(dtype),
        shape=(height, width),
        depth_range=(1, 8),
    )


def one_ray(depth, alpha, dtype=np.float64):
    n = len(depth)
    return moit.Fragments(
        [0, n], np.array(depth, dtype), np.array(alpha, dtype), depth_range=(0, 1)
    )


def shuffled(f, seed):
    """The fragments of each pixel in another order, and which one each was."""
    rng = np.random.default_rng(seed)
    order = np.concatenate(
        [a + rng.permutation(b - a) for a, b in zip(f.offsets[:-1], f.offsets[1:], strict=True)]
    )
    other = moit.Fragments(
        f.offsets,
        f.depth[order],
        f.alpha[order],
        f.color[order],
        shape=f.shape,
        depth_range=f.depth_range,
    )
    return other, order


@variants
@precisions
def test_transmittance_is_the_same_bits_in_any_order(technique, dtype):
    for seed in range(3):
        f = picture(seed, dtype=dtype, opaque=0.05)
        T = moit.transmittance(f, technique, cull_opaque=False)
        for k in range(3):
            other, order = shuffled(f, k)
            if technique.inside:  # moments are sums of floats
                close = moit.transmittance(other, technique, cull_opaque=False)
                np.testing.assert_allclose(close, T[order], atol=2e-5)
                continue
            np.testing.assert_array_equal(
                moit.transmittance(other, technique, cull_opaque=False), T[order]
            )


def test_too_much_for_a_slice_is_its_most_in_any_order():
    rng = np.random.default_rng(0)
    depth, alpha = rng.choice([0.3, 0.30001, 0.6], 3000), rng.uniform(0.2, 1, 3000)
    technique = Slices(4, warp="none")
    T = moit.transmittance(one_ray(depth, alpha), technique, cull_opaque=False)
    for k in range(5):
        order = np.random.default_rng(k).permutation(3000)
        other = moit.transmittance(
            one_ray(depth[order], alpha[order]), technique, cull_opaque=False
        )
        np.testing.assert_array_equal(other, T[order])
    # Four slices hold 255 steps each at most, whatever falls in them.
    assert T[depth == 0.6].min() > np.exp(-4 * np.log(256))


@precisions
@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("table", ["image", "tile", "pixel"])
def test_a_fragment_alone_is_not_occluded(bits, table, dtype):
    rng = np.random.default_rng(1)
    n = 400
    f = moit.Fragments(
        np.arange(n + 1),
        rng.uniform(1, 9, n).astype(dtype),
        rng.uniform(0, 1, n).astype(dtype),
        shape=(20, 20),
        depth_range=(1, 9),
    )
    technique = Slices(16, bits, table)
    assert (moit.transmittance(f, technique) == 1).all()


@pytest.mark.parametrize("count", [2, 3, 10])
def test_coincident_fragments_share_evenly(count):
    for depth in np.random.default_rng(2).random(20):
        f = one_ray([depth] * count, [0.3] * count)
        T = moit.transmittance(f, Slices(64, 16, warp="none"))
        # each has half of all others in front, as steps know them
        expected = 0.7 ** ((count - 1) / 2)
        np.testing.assert_allclose(T, expected, rtol=(count + 1) * STEP[16])


def test_what_is_two_slices_away_counts_exactly():
    rng = np.random.default_rng(3)
    for _ in range(50):
        cells = np.cumsum(rng.integers(2, 20, 8))
        depth = (cells + rng.random(8)) / 256
        alpha = rng.uniform(0.05, 0.9, 8)
        f = one_ray(depth, alpha)
        T = moit.transmittance(f, Slices(64, 16, warp="none", cells=256))
        exact = np.cumprod(np.append(1, 1 - alpha))[:-1]
        np.testing.assert_allclose(T, exact, rtol=9 * STEP[16])


def test_what_is_between_slices_is_read_by_the_definition():
    rng = np.random.default_rng(4)
    cells, n = 64, 40
    depth, alpha = rng.random(n), rng.uniform(0, 0.5, n)
    # all 64 cells have slices at their 65 borders: none are joined
    filled = (np.arange(cells) + 0.5) / cells
    f = one_ray(np.append(depth, filled), np.append(alpha, np.full(cells, 0.01)))
    T = moit.transmittance(f, Slices(65, 16, warp="none", cells=cells))
    x, tau = f.depth * cells, -np.log1p(-f.alpha)
    tent = np.clip(1 - np.abs(x[:, None] - np.arange(cells + 1)), 0, None)
    slices = tau @ tent
    middle = np.cumsum(slices) - slices / 2
    expected = np.exp(-np.maximum(tent @ middle - tau / 2, 0))
    np.testing.assert_allclose(T, expected, atol=(n + cells) * STEP[16] / 2)


def test_slices_stand_where_anything_is():
    """Layers in three cells apart have two slices each, however many cells are between them."""
    depth = [0.2, 0.2003, 0.9]
    f = one_ray(depth, [0.5, 0.5, 0.5])
    fine = moit.transmittance(f, Slices(6, 16, warp="none", cells=8192))
    np.testing.assert_allclose(fine, [1, 0.5, 0.25], rtol=0.01)
    coarse = moit.transmittance(f, Slices(3, 16, warp="none", cells=8192))
    assert abs(coarse[1] - 0.5) > 0.1


def test_thin_layers_count_right_in_the_mean():
    """Each has less than half a step: rounded to the nearest, they would not count at all."""
    rng = np.random.default_rng(5)
    pixels, n = 256, 64
    depth = np.sort(rng.random((pixels, n)), axis=1).ravel()
    f = moit.Fragments(
        np.arange(pixels + 1) * n,
        depth,
        np.full(pixels * n, 0.005),
        shape=(16, 16),
        depth_range=(0, 1),
    )
    found = moit.transmittance(f, Slices(64, 8, warp="none")).reshape(pixels, n)
    exact = moit.transmittance(f, "sorted").reshape(pixels, n)
    np.testing.assert_allclose(found.mean(0), exact.mean(0), atol=0.012)


@pytest.mark.parametrize("side", [2, 4, 8])
@pytest.mark.parametrize("total", ["block", "full"])
def test_pixels_that_are_alike_read_what_they_keep(side, total):
    """Of a picture whose pixels are all alike, blocks have the mean of dropped fractions."""
    rng = np.random.default_rng(6)
    depth, alpha = rng.random(12), rng.uniform(0, 0.6, 12)
    pixels = 16 * 16
    f = moit.Fragments(
        np.arange(pixels + 1) * 12,
        np.tile(depth, pixels),
        np.tile(alpha, pixels),
        shape=(16, 16),
        depth_range=(0, 1),
    )
    options = {"warp": "none", "cells": 64}
    own = moit.transmittance(f, Slices(65, 16, **options))
    blocks = moit.transmittance(f, Slices(65, 16, **options, resolution=side, total=total))
    np.testing.assert_allclose(blocks, own, rtol=14 * STEP[16])


@pytest.mark.parametrize(
    "technique",
    [
        Slices(8, resolution=4, table="pixel", total="full"),
        Slices(8, 8, "tile", tile=4),
        Slices(8, 8, "tile", tile=4, resolution=4),
    ],
    ids=str,
)
def test_blocks_count_from_display_coordinates(technique):
    """Where a crop has whole blocks and their neighbours it has what the whole picture has."""
    f = picture(7, 24, 16)
    T = moit.transmittance(f, technique)
    rows = np.arange(24 * 16).reshape(16, 24)[5:, 6:]
    counts = np.diff(f.offsets)[rows.ravel()]
    taken = np.concatenate([np.arange(f.offsets[p], f.offsets[p + 1]) for p in rows.ravel()])
    crop = moit.Fragments(
        np.append(0, np.cumsum(counts)),
        f.depth[taken],
        f.alpha[taken],
        shape=rows.shape,
        origin=(5, 6),
        depth_range=f.depth_range,
    )
    inside = (np.arange(6, 24) >= 10) & (np.arange(5, 16) >= 10)[:, None]
    inner = np.repeat(inside.ravel(), counts)
    assert inner.any()
    np.testing.assert_array_equal(moit.transmittance(crop, technique)[inner], T[taken][inner])


def test_as_many_slices_are_used_as_there_are():
    """Where all cells have something they are joined by an eighth of an octave at a time."""
    f = picture(3, 40, 20, most=20)
    exact = moit.transmittance(f, "sorted")

    def error(count):
        return np.sqrt(np.mean((moit.transmittance(f, Slices(count, cells=512)) - exact) ** 2))

    errors = [error(count) for count in (34, 40, 48, 62)]
    assert (np.diff(errors) < 0).all()


def test_blocks_keep_the_nearest_to_the_mean_of_their_pixels():
    """Whole steps below it would lose three eighths of a step in the mean."""
    rng = np.random.default_rng(4)
    side, n = 128, 128 * 128
    alpha = np.empty((n, 2))
    alpha[:, 0] = rng.uniform(0, 0.05, n)
    alpha[:, 1] = 0.5
    f = moit.Fragments(
        2 * np.arange(n + 1),
        np.tile([2.0, 7.0], n),
        alpha.ravel(),
        shape=(side, side),
        depth_range=(1, 8),
    )
    behind = moit.transmittance(f, Slices(4, resolution=2))[1::2]
    found, true = -np.log(behind).mean(), -np.log1p(-alpha[:, 0]).mean()
    assert abs(found - true) < 0.2 * STEP[8]


def test_the_full_total_scales_what_blocks_have():
    """A pixel with twice the layers of its neighbours has twice as much in front of the last."""
    pixels = 64
    depth = np.tile([0.2, 0.4, 0.8], pixels)
    alpha = np.full(3 * pixels, 0.3)
    alpha[3 * 27 : 3 * 28] = 1 - 0.7**2
    f = moit.Fragments(np.arange(pixels + 1) * 3, depth, alpha, shape=(8, 8), depth_range=(0, 1))
    options = {"warp": "none", "resolution": 4}
    full = moit.transmittance(f, Slices(64, 16, **options, total="full")).reshape(pixels, 3)
    blocks = moit.transmittance(f, Slices(64, 16, **options)).reshape(pixels, 3)
    assert abs(full[27, 2] - 0.7**4) < 0.005
    assert abs(full[0, 2] - 0.7**2) < 0.005
    assert abs(blocks[27, 2] - 0.7**4) > 0.05


@variants
@precisions
@pytest.mark.parametrize("cull_opaque", [True, False])
def test_bounds_hold(technique, dtype, cull_opaque):
    depths = np.linspace(0.5, 9, 23)
    for seed in range(4):
        f = picture(seed, 16, 12, dtype=dtype, opaque=0.03)
        exact = f.astype(np.float64) if hasattr(f, "astype") else widened(f)
        for asked in (None, depths):
            options = {"cull_opaque": cull_opaque}
            if asked is not None:
                options["depth"] = asked
            lower, upper = moit.bounds(f, technique, **options)
            T = moit.transmittance(exact, "sorted", **options)
            if asked is None and technique.ties != "sorted":
                T = together(exact, T, cull_opaque)
            assert (lower <= T * (1 + 1e-12)).all()
            assert (T <= upper * (1 + 1e-12)).all()


def widened(f):
    return moit.Fragments(
        f.offsets,
        f.depth.astype(np.float64),
        f.alpha.astype(np.float64),
        f.color.astype(np.float64),
        shape=f.shape,
        depth_range=f.depth_range,
    )


def together(f, T, cull_opaque):
    """Of fragments of one depth, each seen through what lies in front of all."""
    T = T.copy()
    pixel = np.repeat(np.arange(f.offsets.size - 1), np.diff(f.offsets))
    for p, depth in set(zip(pixel.tolist(), f.depth.tolist(), strict=True)):
        same = (pixel == p) & (f.depth == depth)
        if not (cull_opaque and (f.alpha[same] == 1).any()):
            T[same] = T[same].max()
    return T


def test_bounds_are_of_some_use():
    f = picture(8, 16, 12)
    lower, upper = moit.bounds(f, Slices(64, 16))
    assert np.mean(upper - lower) < 0.1
    T = moit.transmittance(f, Slices(64, 16))
    slack = 20 * STEP[16]
    assert (T >= lower - slack).all()
    assert (T <= upper + slack).all()


def test_what_moments_prove_is_kept_within():
    f = picture(9, 16, 12)
    T = moit.transmittance(f, Slices(2, inside="power4"))
    lower, upper = moit.bounds(f, "power4")
    assert (T >= lower - 1e-6).all()
    assert (T <= upper + 1e-6).all()
    free = moit.transmittance(f, Slices(2))
    assert ((free < lower - 1e-3) | (free > upper + 1e-3)).any()


@pytest.mark.parametrize("bits", [2, 7, 8, 11, 16])
def test_passes_keep_codes_of_any_bits_as_the_core_does(bits):
    f = picture(7)
    technique = Slices(12, bits, "tile", tile=3)
    exact = {"device": gpu.software_device(), "exact": True}
    for question in (moit.transmittance, moit.composite):
        assert np.array_equal(question(f, technique, **exact), question(f, technique))


def test_bits_of_a_pixel():
    assert Slices(64).bits_per_pixel == 512
    assert Slices(64, 16, "tile", tile=16).bits_per_pixel == 1024 + 512 / 256
    assert Slices(64, resolution=4, total="full").bits_per_pixel == 64
    assert Slices(128, resolution=8, total="full").bits_per_pixel == 48
    assert Slices(64, table="pixel", resolution=4).bits_per_pixel == 32 + 16
    assert Slices(64, resolution=4, total="full", inside="power4").bits_per_pixel == 192


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 1}, "count"),
        ({"count": 257}, "count"),
        ({"bits": 17}, "bits"),
        ({"table": "images"}, "table"),
        ({"tile": 6, "resolution": 4, "table": "tile"}, "tile: expected a multiple of the res"),
        ({"cells": 100}, "cells"),
        ({"resolution": 0}, "resolution"),
        ({"total": "full"}, "total: expected"),
        ({"total": "half"}, "total"),
        ({"inside": "power6"}, "inside"),
        ({"resolution": 2, "depth_range": "pixel"}, "resolution: expected 1"),
    ],
)
def test_options_that_are_none_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        Slices(**options)


def test_tables_of_an_image_are_bounded(monkeypatch):
    f = picture(3)  # of 6 x 9 pixels: 3 x 5 squares of two
    technique = Slices(16, table="pixel", resolution=2, cells=8192)
    size = 15 * 8192 * 8
    monkeypatch.setattr("moit.catalog.slices.MOST_TABLE_BYTES", size - 1)
    with pytest.raises(
        ValueError, match=r"^cells: .* has 15 tables of 8192 cells in an image of 6"
    ):
        moit.composite(f, technique)
    single = Slices(16, table="pixel", cells=8192)  # these are made one after the other
    assert moit.composite(f, single).shape == (6, 9, 4)
    monkeypatch.setattr("moit.catalog.slices.MOST_TABLE_BYTES", size)
    assert moit.composite(f, technique).shape == (6, 9, 4)


def test_a_full_slice_stays_full_however_many_fragments_come():
    technique, alpha = Slices(8, 16, warp="none"), 1 - 2.0**-8  # 32768 steps
    behind = [
        moit.transmittance(one_ray([1 / 2048] * n, [alpha] * n), technique, depth=[0.9])
        for n in (4, 2**17)  # sums of 32 bits would be 0 again
    ]
    assert behind[0] == pytest.approx(2.0**-16, rel=1e-3)
    assert np.array_equal(*behind)
