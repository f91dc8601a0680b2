"""Slices of blocks that are read within moments of each pixel, and totals in a byte."""

import numpy as np
import pytest

import moit
from moit import Slices


def rays(alike: bool, width: int = 16, height: int = 12, layers: int = 8) -> moit.Fragments:
    """Pixels that all see the same layers, or each its own."""
    rng = np.random.default_rng(4)
    pixels = width * height
    depth = np.sort(rng.uniform(1, 8, (1 if alike else pixels, layers)), axis=1)
    alpha = rng.uniform(0.05, 0.6, depth.shape)
    return moit.Fragments(
        layers * np.arange(pixels + 1),
        np.broadcast_to(depth, (pixels, layers)).ravel(),
        np.broadcast_to(alpha, (pixels, layers)).ravel(),
        shape=(height, width),
        depth_range=(1, 8),
    )


def off(T: np.ndarray, f: moit.Fragments) -> float:
    return float(np.sqrt(np.mean((T - moit.transmittance(f, "sorted")) ** 2)))


@pytest.mark.parametrize("warp", ["log", "linear"])
def test_pixels_that_are_as_their_block_read_what_slices_say(warp):
    f = rays(alike=True)
    fine = Slices(256, 16, resolution=4, inside="power4", warp=warp)
    assert off(moit.transmittance(f, fine), f) < 0.002
    assert off(moit.transmittance(f, moit.PowerMoments(4, exclude_self=True)), f) > 0.01


def test_depth_in_the_unit_interval_is_not_warped():
    f = rays(alike=True)
    unit = moit.Fragments(f.offsets, (f.depth - 1) / 7, f.alpha, shape=f.shape, depth_range=(0, 1))
    fine = Slices(256, 16, resolution=4, inside="power4", warp="none")
    assert off(moit.transmittance(unit, fine), unit) < 0.002


def test_pixels_that_are_not_as_their_block_are_read_by_their_own_moments():
    f = rays(alike=False)
    free = moit.transmittance(f, Slices(64, 16, resolution=4, total="full"))
    lower, upper = moit.bounds(f, "power4")
    within = moit.transmittance(f, Slices(64, 16, resolution=4, total="full", inside="power4"))
    assert (within >= lower - 1e-6).all()
    assert (within <= upper + 1e-6).all()
    cut = np.clip(free, lower, upper)
    assert off(within, f) < 0.8 * off(cut, f) < 0.8 * off(free, f)


def test_curves_are_read_as_fragments_are():
    """Where nothing is, what a fragment of no absorbance would read."""
    f = rays(alike=False)
    technique = Slices(16, resolution=2, inside="power4")
    depth = np.linspace(1.2, 7.7, 5)
    curve = moit.transmittance(f, technique, depth)
    more = np.sort(np.concatenate([f.depth.reshape(-1, 8), np.tile(depth, (192, 1))], axis=1))
    order = np.argsort(np.concatenate([f.depth.reshape(-1, 8), np.tile(depth, (192, 1))], axis=1))
    alpha = np.concatenate([f.alpha.reshape(-1, 8), np.zeros((192, 5))], axis=1)
    both = moit.Fragments(
        13 * np.arange(193),
        more.ravel(),
        np.take_along_axis(alpha, order, axis=1).ravel(),
        shape=f.shape,
        depth_range=(1, 8),
    )
    asked = moit.transmittance(both, technique).reshape(-1, 13)[order >= 8].reshape(-1, 5)
    np.testing.assert_allclose(asked, curve.reshape(-1, 5), atol=1e-9)


def test_a_total_in_a_byte_is_a_64th_off():
    f = rays(alike=False)
    x = {
        total: -np.log(moit.transmittance(f, Slices(64, 16, resolution=2, total=total)))
        for total in ("full", "byte")
    }
    assert np.abs(x["byte"] - x["full"]).max() > 1e-3
    # and blocks whose totals are as its own count by the rounded one
    assert (np.abs(x["byte"] - x["full"]) <= 0.04 * x["full"] + 0.02).all()


def test_a_pixel_far_from_its_block_has_the_most_or_least_of_a_byte():
    """Of four pixels one has all: its total is four of the block's mean; and one nearly nothing."""
    alpha = 1 - np.exp(-np.array([[1.0, 1.0], [1e-4, 1e-4], [0.0, 0.0], [0.0, 0.0]]))
    f = moit.Fragments(
        2 * np.arange(5),
        np.tile([0.25, 0.75], 4),
        alpha.ravel(),
        shape=(2, 2),
        depth_range=(0, 1),
    )
    T = {
        total: moit.transmittance(f, Slices(256, 16, resolution=2, total=total, warp="none"))
        for total in ("full", "byte")
    }
    np.testing.assert_allclose(T["byte"][:2], T["full"][:2], atol=0.02)
    assert T["full"][3] == pytest.approx(np.exp(-1e-4), abs=1e-4)
    assert np.exp(-2 * 0.5 * 4 / 256) < T["byte"][3] < T["full"][3]


def test_a_byte_is_what_a_total_takes():
    sizes = [
        Slices(36, 6, "tile", tile=12, cells=256, resolution=2, total=total).bits_per_pixel
        for total in ("block", "byte", "half", "full")
    ]
    np.testing.assert_allclose(np.diff(sizes), [8, 8, 16])
