"""Splats drawn by a GPU: the fragments and pictures of the CPU."""

import dataclasses

import gpu
import numpy as np
import pytest
from test_splats import CAMERA, SCENES, SIZE, some_splats

import moit
from moit.geometry.splats import CONVENTIONS
from moit.gpu import splats as drawn_splats

WALL = moit.Mesh([[-9, -9, -0.2], [9, -9, -0.2], [0, 9, -0.2]], [[0, 1, 2]], (0.9, 0.2, 0.1))
GLASS = moit.Mesh([[-9, -9, 0.3], [9, -9, 0.3], [0, 9, 0.3]], [[0, 1, 2]], alpha=0.4)
IN_FRONT = moit.Mesh([[-0.2, -0.2, 0.4], [0.3, -0.2, 0.4], [0, 0.3, 0.4]], [[0, 1, 2]], (0, 0, 1))
SPLATS = some_splats(2, 600, size=-2.4)
MIXED = [
    *(SPLATS, WALL, SPLATS[::2].seen_by("exact"), GLASS, IN_FRONT),
    *(SPLATS[::3], SPLATS[1::9].seen_by("3dgs-all")),
]
SMALL = (48, 32)


def assert_same(found, expected):
    for name in ("offsets", "depth", "alpha", "color"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    assert found.depth_range == expected.depth_range


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("name", SCENES)
def test_fragments_have_the_bits_of_the_cpu(name, convention):
    splats, camera = SCENES[name]
    several = splats.seen_by(convention)
    found = moit.rasterize(several, camera, SIZE, device=gpu.software_device())
    assert_same(found, moit.rasterize(several, camera, SIZE))


def test_thick_ones_have_the_deviations_of_the_cpu():
    thick = SPLATS[::4].seen_by("exact", thick=True)
    for scene in ([thick], [thick, GLASS, SPLATS[1::4].seen_by("exact")]):
        found = moit.rasterize(scene, CAMERA, SMALL, device=gpu.software_device())
        expected = moit.rasterize(scene, CAMERA, SMALL)
        assert (expected.deviation > 0).sum() > 1000
        assert_same(found, expected)
        np.testing.assert_array_equal(found.deviation, expected.deviation)
        assert found.back is None


def test_of_splats_at_one_depth_the_first_are_seen():
    dense = SCENES["many, opaque, with an end"][0]
    flat = moit.Splats(
        dense.means * (1, 1, 0), 3 * dense.scales, dense.rotations, dense.opacities, sh=dense.sh
    )
    camera = moit.Camera(eye=(0, 0, 2))
    expected = moit.rasterize(flat, camera, SMALL)
    assert np.ptp(expected.depth) == 0
    all_there_are = moit.rasterize(flat.seen_by("exact"), camera, SMALL)
    assert expected.counts.max() < all_there_are.counts.max() / 2
    assert_same(moit.rasterize(flat, camera, SMALL, device=gpu.software_device()), expected)


def test_each_run_of_a_scene_ends_by_itself():
    """What one part hides does not end what follows it in another; nor does a mesh."""
    dense = SCENES["many, opaque, with an end"][0]
    scene = [dense, GLASS, dense[::2].seen_by("exact"), dense[::3], SPLATS]
    found = moit.rasterize(scene, CAMERA, SMALL, device=gpu.software_device())
    assert_same(found, moit.rasterize(scene, CAMERA, SMALL))


def test_long_lists_of_a_tile_are_gone_through_in_parts(monkeypatch):
    monkeypatch.setattr(drawn_splats, "SPLATS_AT_ONCE", 37)
    splats = SCENES["many, opaque, with an end"][0]
    found = moit.rasterize(splats, CAMERA, SMALL, device=gpu.software_device())
    assert_same(found, moit.rasterize(splats, CAMERA, SMALL))


# Moments are sums of floats there, of doubles here: see test_render.
PICTURES = {
    "sorted": ("replay", 1e-6),
    "unsorted": ("add", 1e-6),
    "wboit": ("add", 2e-6),
    "power4": ("add", 5e-3),
    "mlab4": ("fetch", 1e-5),
}


@pytest.mark.parametrize("technique", PICTURES)
def test_pictures_of_splats_and_meshes_are_those_of_the_cpu(technique):
    way, atol = PICTURES[technique]
    options = {"camera": CAMERA, "background": (0.1, 0.2, 0.3)}
    on_gpu = {"device": gpu.device(), "exact": True, "target": "rgba32f", "report": True}
    made = moit.render(MIXED, technique, SMALL, **options, **on_gpu)
    assert made.device == "gpu"
    if gpu.device().software:
        assert made.way == way
    technique = moit.technique(technique)
    if way == "add" and hasattr(technique, "bias"):
        technique = dataclasses.replace(technique, bias=technique.blended_bias)
    expected = moit.render(MIXED, technique, SMALL, **options)
    np.testing.assert_allclose(made.image, expected, atol=atol)
    assert np.abs(expected - moit.render([WALL, GLASS], technique, SMALL, **options)).max() > 0.2


def test_blocks_of_pixels_see_the_splats_of_the_pixel_they_ask():
    """The last block of a row asks the last pixel."""
    made = moit.render(
        SPLATS,
        "moment-transparency-lr8(normalize=False)",
        (50, 26),
        camera=CAMERA,
        device=gpu.device(),
        exact=True,
        target="rgba32f",
        report=True,
    )
    technique = moit.technique("moment-transparency-lr8(normalize=False)")
    technique = dataclasses.replace(technique, bias=technique.blended_bias)
    expected = moit.render(SPLATS, technique, (50, 26), camera=CAMERA)
    assert made.way == "add"
    np.testing.assert_allclose(made.image, expected, atol=2e-2)
    assert np.abs(made.image - expected).mean() < 1e-3


def test_none_that_are_seen_are_an_empty_picture():
    behind = moit.Splats([[0, 0, 9]], [0.1], [[1, 0, 0, 0]], [0.9])
    for several in (behind, behind[:0]):
        found = moit.rasterize(several, CAMERA, SMALL, device=gpu.device())
        assert len(found.depth) == 0


def test_what_no_buffer_holds_is_refused(monkeypatch):
    device = gpu.device()
    monkeypatch.setattr(type(device), "storage_bytes", property(lambda _: 12 * 48 * 32))
    held = 12 * 48 * 32 // drawn_splats.SCREEN_SPLAT.itemsize
    message = rf"scene: \d+ splats are seen, and a buffer of .* holds {held};"
    with pytest.raises(moit.GpuError, match=message):
        moit.rasterize(SPLATS, CAMERA, SMALL, device=device)
    with pytest.raises(moit.GpuError, match="scene: lists of splats take 24576 bytes"):
        moit.rasterize(SPLATS[:2], CAMERA, (64, 32), device=device)
