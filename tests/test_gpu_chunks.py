"""Images larger than the device's buffers, and smaller than a pixel."""

import gpu
import numpy as np
import pytest
from small import some_fragments

import moit
from moit.gpu.device import Device

TECHNIQUES = ("sorted", "power4", "trig3-16", "deep-shadow", "mlab4")


@pytest.fixture
def small_buffers(monkeypatch):
    monkeypatch.setattr(Device, "storage_bytes", 4096)
    return gpu.device()


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize("transmission", [False, True])
def test_an_image_in_chunks_is_the_same_image(technique, transmission, small_buffers, monkeypatch):
    f = some_fragments(height=20, width=30, most=9)
    if transmission:
        if not moit.technique(technique).supports_transmission:
            return
        f = moit.Fragments(
            f.offsets, f.depth, f.alpha, f.color, transmission=f.color, shape=f.shape
        )
    behind = np.random.default_rng(1).random((*f.shape, 3))
    asked = np.array([2.0, 5.0])

    def answers():
        found = [
            moit.composite(f, technique, background=behind, device=small_buffers, exact=True),
            moit.transmittance(f, technique, device=small_buffers, exact=True),
            moit.total_transmittance(f, technique, device=small_buffers, exact=True),
        ]
        if moit.technique(technique).has_curve:
            found.append(moit.transmittance(f, technique, asked, device=small_buffers, exact=True))
        return found

    in_chunks = answers()
    monkeypatch.setattr(Device, "storage_bytes", 1 << 26)
    for one, other in zip(in_chunks, answers(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_pixel_beyond_the_buffers_is_refused(small_buffers):
    f = moit.Fragments(
        [0, 1, 2000], np.linspace(1, 2, 2000), np.full(2000, 0.01), np.ones((2000, 3))
    )
    with pytest.raises(moit.GpuError, match=r"pixel 1 has 1999 fragments.*device='cpu'"):
        moit.composite(f, "power4", device=small_buffers, exact=True)


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_nothing_gives_the_background(technique):
    device = gpu.device()
    empty = moit.Fragments([0] * 7, [], [], np.zeros((0, 3)), shape=(2, 3))
    image = moit.composite(empty, technique, background=(1, 2, 3), device=device, exact=True)
    np.testing.assert_array_equal(image, np.broadcast_to(np.float32([1, 2, 3, 0]), (2, 3, 4)))
    assert moit.transmittance(empty, technique, device=device, exact=True).shape == (0,)
    np.testing.assert_array_equal(
        moit.total_transmittance(empty, technique, device=device, exact=True), 1
    )
    none = moit.Fragments([0], [], [], np.zeros((0, 3)), shape=(0, 4))
    assert moit.composite(none, technique, device=device, exact=True).shape == (0, 4, 4)


def test_the_device_of_the_process_answers_by_its_name():
    gpu.device()
    f = some_fragments(height=4, width=5)
    np.testing.assert_array_equal(
        moit.composite(f, "wboit", device="gpu", exact=True), moit.composite(f, "wboit")
    )


def test_bounds_are_asked_of_the_cpu():
    with pytest.raises(moit.GpuError, match="use device='cpu'"):
        moit.bounds(some_fragments(), "power4", device=gpu.device())


def test_what_is_no_device_is_named():
    with pytest.raises(ValueError, match="device: expected 'cpu', 'gpu'"):
        moit.composite(some_fragments(), "power4", device="cuda")
