"""Moments of blocks of pixels, and two passes of moments, on a device: bits are the core's."""

import gpu
import numpy as np
import pytest
from small import some_fragments

import moit
from moit import MomentTransparency
from moit.gpu.bindings import SOFTWARE_ITERATIONS
from moit.gpu.device import Device

BLOCKS = [
    MomentTransparency(passes, storage, side, low_resolution=take)
    for passes, storage, side, take in (
        (1, "float32", 3, "raster"),
        (1, "unorm16", 4, "average"),
        (2, "float32", 5, "average"),
        (2, "unorm16", 2, "raster"),
        (2, "float32", 100, "average"),
    )
]
TWICE = [
    MomentTransparency(2, storage, interval=interval, exclude_self=excludes)
    for storage in ("float32", "nlqm", "unorm16")
    for interval in ("unit", "symmetric")
    for excludes in (False, True)
]


def walled(transmission: bool = False) -> moit.Fragments:
    """Opaque surfaces in some pixels, at several depths, before and behind others."""
    f = some_fragments(height=17, width=23, most=12)
    rng = np.random.default_rng(3)
    alpha = np.where(rng.random(len(f)) < 0.2, 1, f.alpha)
    return moit.Fragments(
        f.offsets,
        f.depth,
        alpha,
        f.color,
        transmission=np.where(rng.random((len(f), 1)) < 0.5, 0, f.color) if transmission else None,
        shape=f.shape,
        origin=(-5, 7),
    )


def agree(f: moit.Fragments, technique: MomentTransparency, device: Device, **same: bool) -> None:
    near, far = f.depth_range
    depth = np.linspace(0.9 * near, 1.1 * far, 6)
    for ask in (
        lambda on: moit.composite(
            f, technique, device=on, exact=True, background=(0.2, 0.3, 0.4), **same
        ),
        lambda on: moit.transmittance(f, technique, device=on, exact=True, **same),
        lambda on: moit.transmittance(f, technique, depth, device=on, exact=True, **same),
        lambda on: moit.total_transmittance(f, technique, device=on, exact=True, **same),
    ):
        np.testing.assert_array_equal(ask(device), ask("cpu"))


@pytest.mark.parametrize("technique", BLOCKS, ids=str)
@pytest.mark.parametrize("cull_opaque", [True, False])
def test_blocks_see_what_lies_before_their_farthest_wall(technique, cull_opaque):
    agree(walled(), technique, gpu.device(), cull_opaque=cull_opaque)


@pytest.mark.parametrize("technique", BLOCKS[:3], ids=str)
def test_blocks_are_of_net_coverage(technique):
    agree(walled(transmission=True), technique, gpu.device())


@pytest.mark.parametrize("technique", TWICE, ids=str)
def test_two_passes_keep_their_doubles(technique):
    agree(walled(), technique, gpu.device())


@pytest.mark.parametrize("technique", BLOCKS[:4], ids=str)
def test_blocks_do_not_end_where_chunks_do(technique, monkeypatch):
    monkeypatch.setattr(Device, "storage_bytes", 8000)
    agree(walled(), technique, gpu.device())


@pytest.mark.parametrize("technique", BLOCKS[:3], ids=str)
def test_blocks_of_nothing_are_empty(technique):
    nothing = moit.Fragments(np.zeros(36, int), [], [], np.empty((0, 3)), shape=(5, 7))
    image = moit.composite(
        nothing, technique, device=gpu.device(), exact=True, background=(0.2, 0.3, 0.4)
    )
    np.testing.assert_array_equal(
        image, moit.composite(nothing, technique, background=(0.2, 0.3, 0.4))
    )


def test_blocks_of_more_pixels_than_a_software_loop_reaches_are_refused():
    device = gpu.device()
    side = 1 + int(np.sqrt(SOFTWARE_ITERATIONS // 8))  # a block of a few too many, and all empty
    if not device.software:
        pytest.skip("not a software renderer")
    empty = moit.Fragments(
        np.zeros(side * side + 1, int), [], [], np.zeros((0, 3)), shape=(side, side)
    )
    average = MomentTransparency(1, resolution=side, low_resolution="average")
    with pytest.raises(moit.GpuError, match=rf"resolution: blocks take {side * side} pixels"):
        moit.composite(empty, average, device=device, exact=True)


def test_blocks_beyond_the_buffers_are_refused(monkeypatch):
    monkeypatch.setattr(Device, "storage_bytes", 4000)
    with pytest.raises(moit.GpuError, match=r"resolution: blocks take 276 pixels.*device='cpu'"):
        moit.composite(walled(), BLOCKS[4], device=gpu.device(), exact=True)
