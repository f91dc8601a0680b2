"""What is opaque is background: however far, it is no part of the range that depth warps from."""

import copy
import pickle

import gpu
import numpy as np
import pytest
from variants import EVERY

import moit

BEHIND = (0.1, 0.2, 0.3)
MOST = {np.float32: np.finfo(np.float32).max, np.float64: np.finfo(np.float64).max}
FAR = [20.0, 1e4, 1e10, 1e30, float(MOST[np.float32]), np.inf]
PIXELS, LAYERS = 12, 6

every_technique = pytest.mark.parametrize("technique", EVERY, ids=str)


def layers(far: float | None, dtype=np.float32, tinted: bool = False, **options):
    """Some pixels of translucent layers, each with an opaque one at `far` as its last."""
    rng = np.random.default_rng(0)
    n = LAYERS + (far is not None)
    depth = np.sort(rng.uniform(5, 15, (PIXELS, LAYERS)), axis=1)
    alpha = rng.uniform(0.1, 0.6, (PIXELS, LAYERS))
    color = rng.random((PIXELS, LAYERS, 3))
    passed = rng.random((PIXELS, LAYERS, 3)) * tinted
    if far is not None:
        depth = np.append(depth, np.full((PIXELS, 1), far), axis=1)
        alpha = np.append(alpha, np.ones((PIXELS, 1)), axis=1)
        color = np.append(color, np.full((PIXELS, 1, 3), BEHIND), axis=1)
        passed = np.append(passed, np.zeros((PIXELS, 1, 3)), axis=1)
    with np.errstate(over="ignore"):
        arrays = [a.reshape(PIXELS * n, *a.shape[2:]).astype(dtype) for a in (depth, alpha, color)]
    if tinted:
        options["transmission"] = passed.reshape(-1, 3).astype(dtype)
    return moit.Fragments(np.arange(PIXELS + 1) * n, *arrays, shape=(3, 4), dtype=dtype, **options)


def colors(f: moit.Fragments, technique, **options) -> np.ndarray:
    return moit.composite(f, technique, background=BEHIND, **options)[..., :3]


@every_technique
def test_a_background_at_any_depth_changes_no_colour(technique):
    near = colors(layers(None), technique)
    for far in FAR:
        assert layers(far).depth_range == layers(None).depth_range
        np.testing.assert_allclose(colors(layers(far), technique), near, atol=1e-6)


@pytest.mark.parametrize("name", ["power4", "trig3", "wavelet8", "adaptive4", "weighted-average"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nor_with_coloured_transmission_or_in_double(name, dtype):
    for tinted in (False, True):
        if tinted and not moit.technique(name).supports_transmission:
            continue
        near = colors(layers(None, dtype, tinted), name)
        for far in (1e4, 1e30, np.inf):
            np.testing.assert_allclose(colors(layers(far, dtype, tinted), name), near, atol=1e-6)


@pytest.mark.parametrize("name", ["power4", "fourier7", "neural", "mlab4", "wboit", "sorted"])
@pytest.mark.parametrize("cull_opaque", [True, False])
def test_nor_on_a_gpu(name, cull_opaque):
    device = gpu.device()
    for far in (1e4, float(MOST[np.float32])):
        f = layers(far)
        options = {"cull_opaque": cull_opaque, "background": BEHIND}
        both = [moit.composite(f, name, device=d, exact=True, **options) for d in ("cpu", device)]
        np.testing.assert_array_equal(*both)
        if moit.technique(name).has_curve and name != "mlab4":
            depth = [1.0, 7.0, 14.9, 15.1, 2e4, 1e20]
            both = [
                moit.transmittance(
                    f, name, depth=depth, device=d, exact=True, cull_opaque=cull_opaque
                )
                for d in ("cpu", device)
            ]
            np.testing.assert_array_equal(*both)


@every_technique
def test_answers_are_finite_where_opaque_fragments_are_not_taken_apart(technique):
    for dtype in (np.float32, np.float64):
        for far in (1e30, float(MOST[dtype])):
            f = layers(far, dtype)
            image = moit.composite(f, technique, cull_opaque=False)
            assert np.isfinite(image).all()
            if technique.has_curve:
                T = moit.transmittance(f, technique, depth=[1, 7, 1e20], cull_opaque=False)
                assert ((T >= 0) & (T <= 1)).all()


def test_a_curve_goes_on_between_the_range_and_an_opaque_fragment_that_is_left_in():
    """The exact curve, and that of a range that each pixel has for itself."""
    f = layers(1e6)
    for name in ("sorted", "depth-peeling32", "deep-shadow"):
        left_in = moit.transmittance(f, name, depth=[1e5, 1e7], cull_opaque=False)
        taken_apart = moit.transmittance(f, name, depth=[1e5, 1e7])
        np.testing.assert_allclose(left_in, taken_apart, atol=0.02)
        assert left_in[..., 0].min() > 0.01
    pixel = moit.technique("power4(depth_range='pixel')")
    z = [moit.transmittance(g, pixel, cull_opaque=False) for g in (layers(20.0), f)]
    np.testing.assert_array_equal(*z)


# -- the range itself --


def ranged(depth, alpha, **options) -> tuple[float, float]:
    return moit.Fragments([0, len(depth)], depth, alpha, dtype="f8", **options).depth_range


def test_the_default_range_is_that_of_what_is_transparent():
    assert ranged([1, 2, 9], [0.5, 0.5, 1]) == (1, 2)
    assert ranged([0.1, 1, 2], [1, 0.5, 0.5]) == (1, 2)
    assert ranged([-4, 1, 2, 9], [1, 0.5, 0, 1]) == (1, 2)
    assert ranged([1, 2, np.inf], [0.5, 0.5, 1]) == (1, 2)
    almost = np.nextafter(1, 0)
    assert ranged([1, 2, 9], [0.5, 0.5, almost]) == (1, 9)


def test_where_all_is_opaque_it_is_that_of_all():
    assert ranged([3, 1, 9], [1, 1, 1]) == (1, 9)
    assert ranged([np.inf], [1]) == (MOST[np.float64],) * 2
    assert ranged([], []) == (1, 1)


def test_what_lets_a_channel_through_is_not_opaque():
    passed = [[0, 0, 0], [0, 1e-9, 0], [0, 0, 0]]
    assert ranged([1, 5, 9], [0.5, 1, 1], transmission=passed) == (1, 5)


def test_opaque_fragments_may_lie_outside_a_range_that_is_given():
    f = moit.Fragments([0, 3], [0.5, 2, 1e9], [1, 0.5, 1], depth_range=(1, 3))
    assert f.depth_range == (1, 3) and f.depth.tolist() == [0.5, 2, 1e9]
    with pytest.raises(moit.FragmentsError, match=r"depth\[1\]: found 4.0; needed a depth within"):
        moit.Fragments([0, 3], [0.5, 4, 1e9], [1, 0.5, 1], depth_range=(1, 3))
    passed = [[0, 0, 0], [0, 0, 0], [0, 0, 0.5]]
    with pytest.raises(moit.FragmentsError, match=r"depth\[2\]: found 1000000000.0"):
        moit.Fragments([0, 3], [0.5, 2, 1e9], [1, 0.5, 1], transmission=passed, depth_range=(1, 3))


def test_a_fault_is_found_behind_thousands_of_opaque_fragments():
    n = 10_000
    depth, alpha = np.full(n, 50.0), np.ones(n)
    alpha[:3], depth[:3] = 0.5, 2
    assert moit.Fragments([0, n], depth, alpha, depth_range=(1, 3)).depth_range == (1, 3)
    alpha[9_876] = 0.5
    with pytest.raises(moit.FragmentsError, match=r"depth\[9876\]"):
        moit.Fragments([0, n], depth, alpha, depth_range=(1, 3))


@pytest.mark.parametrize("wrong", [np.nan, -np.inf])
def test_of_what_is_not_finite_only_opaque_fragments_at_plus_infinity_are_taken(wrong):
    with pytest.raises(moit.FragmentsError, match=r"depth\[1\]"):
        moit.Fragments([0, 2], [1, wrong], [0.5, 1])
    with pytest.raises(moit.FragmentsError, match=r"depth\[1\]: found inf"):
        moit.Fragments([0, 3], [1, np.inf, wrong], [0.5, 0.5, 1])
    with pytest.raises(moit.FragmentsError, match=r"depth\[2\]"):
        moit.Fragments([0, 3], [1, np.inf, wrong], [0.5, 1, 1])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_infinite_background_is_held_as_far_away_as_numbers_go(dtype):
    depth = np.array([1, np.inf], dtype)
    f = moit.Fragments([0, 2], depth, np.array([0.5, 1], dtype))
    assert f.depth.tolist() == [1, MOST[dtype]] and depth[1] == np.inf
    huge = moit.Fragments([0, 2], [1, 1e300], [0.5, 1], dtype=np.float32)
    assert huge.depth.tolist() == [1, float(MOST[np.float32])]
    alpha = np.array([0.5, 1], dtype)
    pixels = moit.Fragments.from_pixels([0, 0], depth, alpha, shape=(1, 1))
    images = moit.Fragments.from_layers(depth.reshape(2, 1, 1), alpha.reshape(2, 1, 1))
    assert pixels.depth.max() == images.depth.max() == MOST[dtype]
    assert pixels.depth_range == images.depth_range == (1, 1)


def test_another_precision_copies_files_and_windows_keep_the_range(tmp_path):
    f = layers(1e30)
    moit.save(tmp_path / "f.npz", f)
    for other in (
        pickle.loads(pickle.dumps(f)),
        copy.deepcopy(f),
        moit.load(tmp_path / "f.npz"),
        f[:1, :2],
        f.shuffled(1),
    ):
        assert other.depth_range == f.depth_range and other.depth.max() == np.float32(1e30)
    with_double = moit.composite(f, "power4", dtype=np.float64)
    np.testing.assert_allclose(with_double, moit.composite(f, "power4"), atol=1e-4)


def test_merging_with_a_background_keeps_the_range():
    near, wall = layers(None), moit.Fragments([0, 1], [1e30], [1], [BEHIND])
    near = near[:1, :1]
    merged = moit.merge([near, wall])
    assert merged.depth_range == near.depth_range and len(merged) == LAYERS + 1
    np.testing.assert_allclose(
        moit.composite(merged, "power4")[..., :3], colors(near, "power4"), atol=1e-6
    )
    double = moit.Fragments([0, 1], [7.0], [0.5], [BEHIND], dtype="f8")
    assert moit.merge([near, wall, double]).depth_range == near.depth_range
    assert moit.merge([wall, wall]).depth_range == (np.float32(1e30),) * 2
    given = moit.Fragments([0, 1], [1e30], [1], [BEHIND], depth_range=(1, 100))
    assert moit.merge([near, given]).depth_range == (1, 100)


def test_deep_files_and_their_bands_keep_the_range(tmp_path):
    path, near = tmp_path / "far.exr", layers(None)
    depth = np.append(near.depth, np.float32([np.finfo(np.float32).max] * 2))
    n = len(near)
    offsets = near.offsets.copy()
    offsets[6:] += 1
    offsets[-1] += 1
    order = np.insert(np.arange(n), [near.offsets[6]], n)
    order = np.append(order, n + 1)
    f = moit.Fragments(
        offsets,
        depth[order],
        np.append(near.alpha, [1, 1])[order],
        np.append(near.color, [BEHIND, BEHIND], axis=0)[order],
        shape=(3, 4),
        dtype="f4",
    )
    moit.write_deep(path, f)
    assert moit.read_deep(path).depth_range == near.depth_range
    for memory in (1 << 20, 1 << 30):
        for band in moit.read_deep_bands(path, memory=memory):
            assert band.depth_range == near.depth_range


def test_bands_that_are_all_opaque_do_not_count_beside_others(tmp_path):
    path, rows = tmp_path / "sky.exr", 64
    depth = np.where(np.arange(rows) < 40, 1e20, np.arange(rows) + 1.0)
    alpha = np.where(np.arange(rows) < 40, 1.0, 0.5)
    f = moit.Fragments(
        np.arange(rows + 1), depth, alpha, np.ones((rows, 3)), shape=(rows, 1), dtype="f4"
    )
    moit.write_deep(path, f)
    assert {band.depth_range for band in moit.read_deep_bands(path)} == {(41, 64)}


def test_samples_of_a_deep_file_at_infinity_are_background(tmp_path):
    import OpenEXR

    path = tmp_path / "infinite.exr"

    def channel(*values):
        pixels = np.empty((1, 1), object)
        pixels[0, 0] = np.float32(values)
        return pixels

    def write(depth, alpha, **more):
        header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
        channels = {"Z": channel(*depth), "A": channel(*alpha), **more}
        OpenEXR.File(header, channels).write(str(path))

    write([2, 3, np.inf], [0.5, 0.5, 1])
    f = moit.read_deep(path)
    assert f.depth.tolist() == [2, 3, float(MOST[np.float32])] and f.depth_range == (2, 3)
    write([2, 3, np.inf], [0.5, 0.5, 1], ZBack=channel(2, 3, np.inf))
    assert moit.read_deep(path).depth_range == (2, 3)
    write([2, np.inf, 3], [0.5, 0.5, 1])
    with pytest.raises(moit.FragmentsError, match=r"Z of pixel x=0, y=0, sample 1: found inf"):
        moit.read_deep(path)


def test_what_is_opaque_needs_no_depth_that_a_log_can_be_taken_of():
    f = moit.Fragments([0, 3], [-5, 1, 2], [1, 0.5, 0.5], np.ones((3, 3)))
    assert f.depth_range == (1, 2)
    for option in ("image", "pixel"):
        technique = moit.PowerMoments(4, depth_range=option)
        assert np.isfinite(moit.composite(f, technique)).all()
        assert np.isfinite(moit.composite(f, technique, cull_opaque=False)).all()
