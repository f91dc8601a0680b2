"""States of blocks of pixels on a device: bits are the core's, by exact passes."""

from types import SimpleNamespace

import gpu
import numpy as np
import pytest
from test_gpu_moment_transparency import agree, walled
from variants import BLOCKS

import moit
from moit.fragments.squares import squares_of
from moit.gpu.blocks import guides_of
from moit.gpu.device import Device
from moit.gpu.plan import FETCHES, INTERLOCKS, _way, plan_of, too_large

MORE = [
    moit.PowerMoments(8, resolution=100),
    moit.WaveletTransparency(4, resolution=3),
    moit.TransmittanceFunctionMap(8, resolution=3),
    moit.TransmittanceFunctionMap(5, bits=32, resolution=2, total="full", exclude_self=True),
]
EACH = [*BLOCKS, *MORE]
# Fragments add to whole numbers of blocks, each chunk's in turn; the table is small.
ADDED = [
    moit.Slices(6, cells=64, resolution=3, total="half"),
    moit.Slices(6, cells=64, resolution=3, total="byte", upsampling="depth-aware"),
    moit.Slices(6, cells=64, resolution=2, upsampling="depth-aware"),
    moit.AdaptiveVoxels(6, cells=64, resolution=3, filter="cubic"),
]


@pytest.mark.parametrize("technique", EACH, ids=str)
@pytest.mark.parametrize("cull_opaque", [True, False])
def test_pixels_read_the_cores_bits(technique, cull_opaque):
    agree(walled(), technique, gpu.device(), cull_opaque=cull_opaque)


@pytest.mark.parametrize("technique", BLOCKS, ids=str)
def test_double_is_the_cores_too(technique):
    f = walled()
    double = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, shape=f.shape, origin=f.origin, dtype="float64"
    )
    image = moit.composite(double, technique, device=gpu.device(), exact=True)
    np.testing.assert_allclose(image, moit.composite(double, technique), rtol=0, atol=1e-13)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_answers_within_moments_are_the_cores(dtype):
    rng = np.random.default_rng(2)
    alpha = rng.uniform(0, 0.7, (40, 6))
    alpha[::5, 0] = 1 - 1e-6  # beyond max_alpha
    # as many fragments in each pixel: the core allows for the roundings of the longest
    f = moit.Fragments(
        6 * np.arange(41),
        np.sort(rng.uniform(1, 20, (40, 6))).ravel(),
        alpha.ravel(),
        rng.random((240, 3)),
        shape=(5, 8),
        dtype=dtype,
    )
    for technique in (
        moit.Slices(3, inside="power4"),
        moit.Slices(3, resolution=2, total="full", inside="power4", warp="linear", normalize=False),
        moit.Slices(9, resolution=3, table="tile", tile=3, cells=64, total="byte", inside="power4"),
    ):
        on = {"device": gpu.device(), "exact": True}
        depth = np.linspace(0.5, 21, 9)
        for ask, *where in ((moit.composite,), (moit.transmittance,), (moit.transmittance, depth)):
            found = ask(f, technique, *where, **on)
            np.testing.assert_allclose(found, ask(f, technique, *where), rtol=0, atol=1e-13)


@pytest.mark.parametrize("technique", BLOCKS[::2], ids=str)
def test_blocks_are_of_net_coverage(technique):
    agree(walled(transmission=True), technique, gpu.device())


@pytest.mark.parametrize("technique", [*BLOCKS[1::2], *MORE[2:3], *ADDED], ids=str)
def test_blocks_do_not_end_where_chunks_do(technique, monkeypatch):
    monkeypatch.setattr(Device, "storage_bytes", 8000)
    agree(walled(), technique, gpu.device())


def test_what_slices_cannot_have_on_a_device_is_said(monkeypatch):
    f = walled()
    own = moit.Slices(8, inside="power4", depth_range="pixel")
    with pytest.raises(moit.GpuError, match="technique: slices that moments bound"):
        moit.composite(f, own, device=gpu.device(), exact=True)
    monkeypatch.setattr(Device, "storage_bytes", 8000)
    with pytest.raises(moit.GpuError, match=r"table: 391 tables of .* have 300288 bytes"):
        moit.composite(f, moit.Slices(8, 8, "pixel", cells=64), device=gpu.device(), exact=True)
    with pytest.raises(moit.GpuError, match="resolution: 108 blocks have 15120 bytes"):
        moit.composite(f, moit.Slices(32, cells=64, resolution=2), device=gpu.device(), exact=True)


def test_texts_for_engines_read_blocks_nearly_as_the_core_does():
    f = walled()
    for technique in BLOCKS[:6]:
        found = moit.composite(f, technique, device=gpu.device(), exact=False)
        assert np.abs(found - moit.composite(f, technique)).max() <= 2e-3, str(technique)


def test_pictures_of_triangles_are_composited_of_arrays_and_say_why():
    glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    camera = moit.Camera(eye=(0, 0, 3), target=(0, 0, 0))
    for technique in BLOCKS[:6:2]:
        options = {"device": gpu.device(), "exact": True, "report": True}
        made = moit.render([glass], technique, (24, 16), camera=camera, **options)
        assert (made.device, made.way) == ("gpu", "arrays")
        assert made.reason == "blocks of pixels have state of their own"
        expected = moit.render([glass], technique, (24, 16), camera=camera)
        np.testing.assert_allclose(made.image, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize(("side", "software", "is_drawn"), [(180, 1, 1), (181, 1, 0), (181, 0, 1)])
def test_blocks_of_more_pixels_than_loops_of_a_software_device_reach_have_no_plan(
    side, software, is_drawn
):
    device = SimpleNamespace(software=software, info={"extensions": []}, storage_bytes=1 << 40)
    technique = moit.MomentTransparency(2, resolution=side)
    empty = np.zeros(0, np.float32)
    none = moit.Fragments(
        [0, 0], empty, empty, np.zeros((0, 3), np.float32), depth_range=(1.0, 9.0)
    )
    fields, ways = technique.fields_for(none), dict.fromkeys(("listed", "joined", "exact"), False)
    plan = plan_of(device, technique, fields, (1, 9), "rgba32f", None, (2000, 1000), **ways)
    assert plan.reason == ("" if is_drawn else "loops are not sure to reach all pixels of a block")


def test_a_buffer_that_a_device_does_not_hold_is_named():
    device = SimpleNamespace(storage_bytes=1000)
    assert too_large(device, {"image": 1000, "state": 10}) == ""
    assert too_large(device, {"state": 10, "image": 1001}) == "image takes 1001 bytes"


def test_where_no_surface_is_shares_go_by_twice_the_farthest():
    f = moit.Fragments([0, 1, 2, 3], [3.0, 5.0, 2.0], [1.0, 1.0, 0.5], shape=(1, 3))
    squares = squares_of(f, 2)
    pixels, blocks = guides_of(f, squares, f.alpha == 1)
    np.testing.assert_array_equal(pixels, [3, 5, 10])
    np.testing.assert_array_equal(blocks, [5, 10])
    assert guides_of(f, squares, f.alpha > 1) is None


@pytest.mark.parametrize("way", ["interlock", "fetch", "replay"])
def test_the_first_way_that_a_device_has_is_gone(way):
    extensions = {"interlock": [INTERLOCKS, FETCHES], "fetch": [FETCHES], "replay": []}[way]
    device = SimpleNamespace(info={"extensions": extensions, "color_targets": 8}, renderer="R")
    drawn = SimpleNamespace(ordered=True, formats=("rgba32f",) * 8)
    assert _way(device, drawn, None) == way
    assert _way(device, drawn, way) == way
    if way == "replay":
        with pytest.raises(moit.GpuError, match=r"R has no GL_EXT.*; use 'replay'"):
            _way(device, drawn, "fetch")
