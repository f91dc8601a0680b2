"""Fragments with thickness: pieces, tidy images, and what questions make of them.

The truth is tests/deep_model.py. OpenImageIO's flatten is off by up to .89 where volumes overlap,
so it is asked only where samples have been split before.
"""

import pickle
import time

import deep_model
import numpy as np
import OpenImageIO as oiio
import pytest
from gpu import needs_passes, software_device
from variants import EVERY, WITH_CURVE

import moit
from moit.core.pieces import surfaces

# float32 holds a piece's alpha and colour to 2**-24 each, and a ray has up to some forty pieces.
F32 = 1e-6
F64 = 1e-12  # logarithms and exponentials of some forty pieces

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# (front, back, alpha, colour) of one ray each.
RAYS = {
    "one volume": [(1, 3, 0.5, RED)],
    "overlapping": [(1, 3, 0.5, RED), (2, 4, 0.7, BLUE)],
    "nested": [(0, 9, 0.9, RED), (3, 4, 0.2, GREEN), (3.25, 3.5, 0.95, BLUE)],
    "identical": [(1, 2, 0.6, RED), (1, 2, 0.6, BLUE), (1, 2, 0.6, GREEN)],
    "touching": [(1, 2, 0.5, RED), (2, 3, 0.5, GREEN), (3, 4, 0.5, BLUE)],
    "points in a volume": [(0, 4, 0.8, RED), (1, 1, 0.5, BLUE), (3, 3, 0.5, GREEN)],
    "points at both ends": [(1, 2, 0.8, RED), (1, 1, 0.5, BLUE), (2, 2, 0.5, GREEN)],
    "coincident points": [(3, 3, 0.6, RED), (3, 3, 0.6, BLUE)],
    "points that coincide in a volume": [(0, 2, 0.4, GREEN), (1, 1, 0.3, RED), (1, 1, 0.9, BLUE)],
    "an opaque volume over others": [(1, 3, 1.0, RED), (0, 4, 0.7, BLUE), (2, 5, 0.5, GREEN)],
    "opaque volumes": [(1, 3, 1.0, RED), (1, 3, 1.0, BLUE), (1, 3, 0.9, GREEN)],
    "opaque volumes that overlap": [(1, 4, 1.0, RED), (0.5, 3, 1.0, BLUE)],
    "an opaque point in a volume": [(1, 3, 0.5, RED), (2, 2, 1.0, GREEN)],
    "opaque points that coincide": [(2, 2, 1.0, RED), (2, 2, 1.0, GREEN), (2, 2, 0.5, BLUE)],
    "thin media": [(0, 4, 1e-20, RED), (1, 3, 3e-12, BLUE), (2, 2, 0.5, GREEN)],
    "almost opaque": [(0, 2, 1 - 2.0**-24, RED), (1, 3, 1 - 2.0**-24, GREEN)],
    "empty media": [(0, 2, 0.0, RED), (1, 3, 0.0, BLUE), (1, 3, 0.5, GREEN)],
    "nothing at all": [(0, 2, 0.0, RED), (1, 1, 0.0, BLUE)],
    "the thinnest volume": [(1, 1 + 2.0**-23, 0.5, RED), (0, 2, 0.5, BLUE)],
    "huge depths": [(-3e38, 3e38, 0.9, RED), (1e38, 2e38, 0.5, BLUE)],
    "denormal depths": [(0, 1e-44, 0.5, RED), (0, 5e-45, 0.5, BLUE)],
    "unsorted": [(5, 6, 0.5, RED), (1, 1, 0.4, BLUE), (0, 5.5, 0.9, GREEN), (0.5, 0.5, 0.2, RED)],
    "a comb": [(i, i + 1.5, 0.1, (i / 20, 1.0, 0.5)) for i in range(20)],
    "nested shells": [(i, 40 - i, 0.05, (i / 20, 0.5, 1.0)) for i in range(20)],
    "bright": [(0, 2, 0.5, (1e30, 0, 0)), (1, 3, 0.5, (0, -1e30, 0))],
}


def ray(samples, dtype=np.float32, **arrays):
    front, back, alpha, color = zip(*samples, strict=True)
    return moit.Fragments(
        [0, len(samples)],
        np.array(front, dtype),
        np.array(alpha, dtype),
        np.array(color, dtype),
        back=np.array(back, dtype),
        **arrays,
    )


def random_volumes(seed, pixels=40, most=12, dtype=np.float32, grid=8, **options):
    """Some surfaces, some opaque, some empty; grid: depths are whole numbers below it, or any."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, pixels)
    n = int(counts.sum())
    front = rng.integers(0, grid, n) if grid else rng.uniform(0, 9, n)
    length = rng.integers(0, 4, n) if grid else rng.uniform(0, 4, n) * (rng.random(n) < 0.8)
    alpha = rng.uniform(0, 1, n)
    alpha[rng.random(n) < 0.05] = 1
    alpha[rng.random(n) < 0.05] = 0
    extra = {}
    if options.get("transmission"):
        extra["transmission"] = rng.random((n, 3)) * (alpha < 1)[:, None]
    if options.get("emission"):
        extra["emission"] = rng.uniform(0, 2, (n, 3)) * (rng.random(n) < 0.3)[:, None]
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        front,
        alpha,
        rng.uniform(0, 1, (n, 3)),
        back=np.maximum(front, front + length),
        shape=(pixels // 10, 10),
        dtype=dtype,
        **extra,
    )


def expected_image(f):
    """(H, W, 4) over black, by the model."""
    image = np.zeros((len(f.counts), 4))
    for pixel in range(len(f.counts)):
        light, opacity = deep_model.flattened(deep_model.samples_of(f, pixel))
        image[pixel] = *light, opacity.mean()
    return image.reshape(*f.shape, 4)


def assert_close(image, expected, tolerance):
    scale = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(image, expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", RAYS)
def test_a_ray_is_what_the_document_says(name, dtype):
    f = ray(RAYS[name], dtype)
    tolerance = F32 if dtype == np.float32 else F64
    tidy = f.tidy()
    expected = expected_image(f)
    assert_close(moit.composite(tidy, "sorted"), expected, tolerance)
    if "coincide" not in name:  # surfaces that do are in arrival order unless tidied
        assert_close(moit.composite(f, "sorted"), expected, tolerance)
    pieces = deep_model.tidy(deep_model.samples_of(f))
    assert tidy.depth.tolist() == [piece[0] for piece in pieces]
    assert tidy.back.tolist() == [piece[1] for piece in pieces]
    opacity = np.array([piece[2][0] for piece in pieces])
    np.testing.assert_allclose(tidy.alpha, opacity, rtol=tolerance)
    assert tidy.tidy() is tidy
    assert np.array_equal(ray(RAYS[name][::-1], dtype).tidy().alpha, tidy.alpha) or (
        np.allclose(ray(RAYS[name][::-1], dtype).tidy().alpha, tidy.alpha, rtol=tolerance)
    )


@pytest.mark.parametrize("options", [{}, {"emission": True}, {"transmission": True}, {"grid": 0}])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("seed", range(4))
def test_random_rays_are_what_the_document_says(seed, dtype, options):
    f = random_volumes(seed, dtype=dtype, **options)
    tolerance = F32 if dtype == np.float32 else F64
    expected = expected_image(f)
    # Emission in a medium is dimmed by the medium; at a surface it is not.
    assert_close(moit.composite(f.tidy(), "sorted"), expected, 2 * tolerance)


@pytest.mark.parametrize("seed", range(12))
def test_merged_images_are_what_all_their_samples_are(seed):
    f = [random_volumes(3 * seed + i, grid=8 if seed % 2 else 0).tidy() for i in range(3)]
    assert_close(moit.composite(moit.merge(f).tidy(), "sorted"), expected_image(moit.merge(f)), F32)


@pytest.mark.parametrize("seed", range(4))
def test_merged_files_are_openimageios_deep_merge_flattened(seed, tmp_path):
    parts, paths = [], []
    for i in range(2):
        parts.append(random_volumes(2 * seed + i, most=3).tidy())
        paths.append(str(tmp_path / f"{i}.exr"))
        moit.write_deep(paths[i], parts[i])
    merged = oiio.ImageBufAlgo.deep_merge(*map(oiio.ImageBuf, paths), occlusion_cull=False)
    flat = oiio.ImageBufAlgo.flatten(merged)
    names = flat.spec().channelnames
    expected = flat.get_pixels(oiio.FLOAT)[..., [names.index(c) for c in "RGBA"]]
    read = [moit.read_deep(path) for path in paths]
    image = moit.composite(moit.merge(read).tidy(), "sorted")
    assert_close(image, expected_image(moit.merge(parts)), F32)
    # It mixes three and more opaque ones pair by pair, and its sums are float32's.
    opaque = expected[..., 3] == 1
    assert (~opaque).any()
    np.testing.assert_allclose(image[~opaque], expected[~opaque], atol=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_curves_and_totals_are_exact_inside_volumes(dtype):
    f = random_volumes(5, dtype=dtype, grid=0)
    depths = np.concatenate([np.linspace(-1, 14, 41), f.depth[:20], f.back[:20]])
    curve = moit.transmittance(f, "sorted", depths, cull_opaque=False)
    at_fragments = moit.transmittance(f, "sorted", cull_opaque=False)
    total = moit.total_transmittance(f, "sorted", cull_opaque=False)
    tolerance = F32 if dtype == np.float32 else F64
    for pixel in range(len(f.counts)):
        samples = deep_model.samples_of(f, pixel)
        y, x = divmod(pixel, f.shape[1])
        expected = [deep_model.transmittance(samples, depth)[0] for depth in depths.tolist()]
        assert_close(curve[y, x], np.array(expected), tolerance)
        assert abs(total[y, x] - deep_model.transmittance(samples, np.inf)[0]) < tolerance
        for i in range(f.offsets[pixel], f.offsets[pixel + 1]):
            if f.back[i] > f.depth[i]:  # surfaces at its front are in front of it
                through = deep_model.transmittance(samples, float(f.depth[i]))[0]
                assert abs(at_fragments[i] - through) < tolerance


PROVING = [t for t in WITH_CURVE if t.engine == "core"]


@pytest.mark.parametrize("technique", PROVING, ids=str)
def test_bounds_hold_inside_volumes(technique):
    f = random_volumes(6, dtype=np.float64, grid=0)
    f = moit.Fragments(
        f.offsets, f.depth + 1, f.alpha * 0.95, f.color, back=f.back + 1, shape=f.shape
    )
    depths = np.linspace(0.5, 14, 23)
    lower, upper = moit.bounds(f, technique, depths)
    for pixel in range(len(f.counts)):
        y, x = divmod(pixel, f.shape[1])
        samples = deep_model.samples_of(f, pixel)
        exact = np.array([deep_model.transmittance(samples, d)[0] for d in depths.tolist()])
        assert (lower[y, x] <= exact * (1 + 1e-12)).all()
        assert (exact <= upper[y, x] * (1 + 1e-12)).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_techniques_see_the_pieces_as_surfaces(technique):
    if technique.engine != "core":
        pytest.skip("chooses anew")
    f = random_volumes(7)
    f = moit.Fragments(f.offsets, f.depth + 1, f.alpha, f.color, back=f.back + 1, shape=f.shape)
    points = technique.thick in ("moments", "waves", "cells")
    pieces, first = surfaces(f, technique) if points else f._split()
    assert pieces.back is None and len(first) == len(f)
    assert np.array_equal(moit.composite(f, technique), moit.composite(pieces, technique))
    assert np.array_equal(
        moit.transmittance(f, technique), moit.transmittance(pieces, technique)[first]
    )
    if points:
        return  # tests/test_thick.py
    # A volume begins with its first piece, and a surface stays in its place.
    behind = np.nextafter(f.depth, np.float32(np.inf))  # where it is behind a surface
    assert ((pieces.depth[first] == f.depth) | (pieces.depth[first] == behind)).all()


@pytest.mark.parametrize("technique", moit.techniques(), ids=str)
def test_a_gpu_sees_the_same(technique):
    needs_passes(technique)
    if technique.engine != "core":
        pytest.skip("chooses anew")
    device = software_device()
    f = random_volumes(8, emission=True)
    f = moit.Fragments(
        f.offsets, f.depth + 1, f.alpha, f.color, back=f.back + 1, emission=f.emission
    )
    image = moit.composite(f, technique, device=device, exact=True)
    assert np.array_equal(image, moit.composite(f, technique))
    assert np.array_equal(
        moit.transmittance(f, technique, device=device, exact=True),
        moit.transmittance(f, technique),
    )


def test_a_pixel_costs_what_sorting_costs():
    """Nested shells: every piece lies in half of all volumes. A million take about a second of a
    processor, and would take half an hour where all were looked at in all pieces."""
    n = 1_000_000
    front = np.arange(n, dtype=np.float64)
    f = moit.Fragments([0, n], front, np.full(n, 1e-4), np.ones((n, 3)), back=2.0 * n - front)
    begin = time.process_time()
    pieces = f.tidy()
    assert time.process_time() - begin < 100
    assert len(pieces) == 2 * n - 1
    through = np.prod(1 - pieces.alpha)
    np.testing.assert_allclose(through, (1 - 1e-4) ** n, rtol=1e-9)


def test_dense_volumes_leave_nothing_behind():
    """What has ended has no part in what comes, however dense it was."""
    samples = [(0, 2, 1 - 2.0**-50, RED), (0, 4, 1e-9, BLUE), (1, 3, 1 - 2.0**-53, RED)]
    f = ray([*samples, (0, 4, 1e-9, GREEN)], np.float64).tidy()
    assert f.depth.tolist() == [0, 1, 2, 3]
    expected = -np.expm1(2 * np.log1p(-1e-9) / 4)
    np.testing.assert_allclose(f.alpha[3], expected, rtol=1e-12)
    np.testing.assert_allclose(f.color[3], [0, 0.5, 0.5], rtol=1e-12)


def test_depths_that_float32_cannot_hold_cut_where_they_are():
    f = ray([(1, 2, 0.75, RED)])
    depth = [1 + 0.3 * 2.0**-23, 1.1, 1.25, 1.5, 1.75, np.nextafter(2.0, 0), 2.0]
    expected = [0.25 ** min(1.0, z - 1) for z in depth]
    curve = moit.transmittance(f, "sorted", depth)[0, 0]
    np.testing.assert_allclose(curve, expected, rtol=F32)
    assert curve[0] < 1


def test_numbers_stay_finite_whatever_comes():
    """Depths, lengths, alphas and colours at the ends of what float64 holds, in any company."""
    rng = np.random.default_rng(9)
    tiny, huge = np.finfo(np.float64).smallest_subnormal, np.finfo(np.float64).max
    depths = [-huge, -1.0, 0.0, tiny, 2 * tiny, 1.0, np.nextafter(1.0, 2), 1e300, huge]
    alphas = [0.0, tiny, 1e-300, 1e-17, 0.5, np.nextafter(1.0, 0), 1.0]
    lights = [-huge, -1.0, 0.0, tiny, 1.0, huge]
    for dtype in (np.float64, np.float32):
        most = np.finfo(dtype).max
        for _ in range(300):
            n = int(rng.integers(1, 9))
            ends = np.sort(np.clip(rng.choice(depths, (2, n)), -most, most), axis=0)
            f = moit.Fragments(
                [0, n],
                ends[0],
                rng.choice(alphas, n),
                np.clip(rng.choice(lights, (n, 3)), -most, most),
                back=ends[1],
                emission=np.clip(rng.choice(lights, (n, 3)), -most, most),
                transmission=rng.choice(alphas, (n, 3)) if rng.random() < 0.5 else None,
                dtype=dtype,
            )
            g = f.tidy()
            again = moit.Fragments(*_held(g)[:4], **_held(g)[4])  # looks at every number
            assert len(again) == len(g) and (g.depth[1:] >= g.depth[:-1]).all()
            assert (g.depth[1:] >= g.back[:-1]).all()


def _held(f):
    more = {name: getattr(f, name) for name in ("transmission", "back", "emission", "shape")}
    return f.offsets, f.depth, f.alpha, f.color, more


# What is held, and goes wherever the other arrays go


def same(f, g):
    for name in ("offsets", "depth", "alpha", "color", "transmission", "back", "emission"):
        mine, other = getattr(f, name), getattr(g, name)
        assert (mine is None) == (other is None), name
        assert mine is None or np.array_equal(mine, other), name
    assert (f.shape, f.depth_range, f.origin) == (g.shape, g.depth_range, g.origin)


FULL = random_volumes(10, emission=True, transmission=True)


def test_files_and_pickles_keep_it(tmp_path):
    moit.save(tmp_path / "f.npz", FULL)
    same(moit.load(tmp_path / "f.npz"), FULL)
    same(pickle.loads(pickle.dumps(FULL)), FULL)


def test_windows_and_orders_keep_it():
    window = FULL[1:3, 2:7]
    keep = np.concatenate(
        [
            np.arange(FULL.offsets[10 * y + x], FULL.offsets[10 * y + x + 1])
            for y in (1, 2)
            for x in range(2, 7)
        ]
    )
    for name in ("depth", "back", "emission"):
        assert np.array_equal(getattr(window, name), getattr(FULL, name)[keep])
    for f in (FULL.shuffled(1).sorted(), FULL.sorted()):
        assert sorted(f.back.tolist()) == sorted(FULL.back.tolist())
        assert (f.back >= f.depth).all()
    order = np.lexsort([FULL.depth, np.repeat(np.arange(40), FULL.counts)])
    assert np.array_equal(FULL.sorted().emission, FULL.emission[order])


def test_lists_and_layers_take_it():
    pixel = np.repeat(np.arange(40), FULL.counts)[::-1]
    arrays = [getattr(FULL, name)[::-1] for name in ("depth", "alpha", "color")]
    more = {name: getattr(FULL, name)[::-1] for name in ("transmission", "back", "emission")}
    f = moit.Fragments.from_pixels(pixel, *arrays, shape=FULL.shape, **more)
    assert sorted(map(tuple, f.emission.tolist())) == sorted(map(tuple, FULL.emission.tolist()))
    assert (f.back >= f.depth).all() and np.array_equal(f.offsets, FULL.offsets)
    depth, alpha = np.ones((2, 1, 2)), np.array([[[0.5, 0]], [[0, 0]]])
    emission = np.zeros((2, 1, 2, 3))
    emission[1, 0, 1] = 1, 2, 3
    layers = moit.Fragments.from_layers(
        depth, alpha, np.zeros((2, 1, 2, 3)), back=2 * depth, emission=emission
    )
    assert layers.counts.tolist() == [1, 1] and layers.emission.tolist() == [[0] * 3, [1, 2, 3]]
    assert layers.back.tolist() == [2, 2] and layers.depth_range == (1, 2)


def test_merging_fills_up_what_some_lack():
    plain = moit.Fragments([0, 1], [5.0], [0.5], [[1, 1, 1]])
    thick = moit.Fragments([0, 1], [1.0], [0.5], [[1, 1, 1]], back=[9.0])
    bright = moit.Fragments([0, 1], [3.0], [0.0], [[0, 0, 0]], emission=[[1, 2, 3]])
    f = moit.merge([plain, thick, bright])
    assert f.back.tolist() == [5, 9, 3] and f.depth_range == (1, 9)
    assert f.emission.tolist() == [[0] * 3, [0] * 3, [1, 2, 3]]
    assert moit.merge([plain, plain]).back is None


def test_repr_says_what_there_is():
    assert repr(FULL).endswith("color, transmission, back, emission, origin (0, 0))") or repr(
        FULL
    ).endswith("color, transmission, back, emission)")


def test_other_precisions_keep_it():
    f = random_volumes(11, dtype=np.float64, grid=0, emission=True)
    image = moit.composite(f, "sorted", dtype=np.float32)
    assert image.dtype == np.float32
    assert_close(image, expected_image(f), 2 * F32)


def test_moments_and_features_are_of_the_pieces():
    f = random_volumes(12)
    f = moit.Fragments(f.offsets, f.depth + 1, f.alpha, f.color, back=f.back + 1, shape=f.shape)
    pieces, first = f._split()
    points, _ = surfaces(f, moit.technique("power4"))
    for mine, other in zip(
        moit.moments.gather(f, "power4"), moit.moments.gather(points, "power4"), strict=True
    ):
        assert np.array_equal(mine, other)
    from moit.neural.features import features

    assert np.array_equal(features(f, "neural"), features(pieces, "neural")[first])


def test_comparisons_and_choices_take_them():
    f = moit.merge([random_volumes(i, pixels=400, most=4) for i in range(2)])
    f = moit.Fragments(
        f.offsets, f.depth + 1, f.alpha * 0.95, f.color, back=f.back + 1, shape=(20, 20)
    )
    report = moit.compare(f, ["sorted", "power4"], metrics="mse", repeat=1, progress=False)
    errors = {str(row["technique"]): row["T_max"] for row in report.rows}
    assert errors["sorted"] < 1e-6 < errors["power4"]
    choice = moit.choose(f)
    np.testing.assert_allclose(choice.image, moit.composite(f, "per-pixel"), atol=1e-6)


def test_the_range_holds_surfaces_beyond_what_gaussians_reach():
    f = moit.Fragments([0, 3], [1.0, 5.0, 100.0], [0.5] * 3, deviation=[0.0, 0.1, 0.0])
    assert f.depth_range[0] <= 1 and f.depth_range[1] >= 100
