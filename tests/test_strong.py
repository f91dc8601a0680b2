"""Strongest fragments and moments of the rest: what is exact, what is not, in any order."""

import math

import numpy as np
import pytest
from gpu import expect_bits_of_the_core

import moit
from moit import Strong
from moit.catalog.network import NetworkError
from moit.neural import data

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])


def rays(name="sheets", seed=11, fragments=3000, dtype="float32") -> moit.Fragments:
    f = data.drawn(name, fragments, seed)
    return moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, shape=f.shape, depth_range=f.depth_range, dtype=dtype
    )


def reordered(f: moit.Fragments, seed: int) -> tuple[moit.Fragments, np.ndarray]:
    rng = np.random.default_rng(seed)
    pairs = zip(f.offsets, f.offsets[1:], strict=False)
    order = np.concatenate([rng.permutation(np.arange(s, e)) for s, e in pairs])
    other = moit.Fragments(
        f.offsets, f.depth[order], f.alpha[order], f.color[order], shape=f.shape,
        depth_range=f.depth_range, dtype=f.depth.dtype,
    )  # fmt: skip
    return other, order


def error(f, technique) -> float:
    exact, found = (moit.composite(f, t)[..., :3] for t in ("sorted", technique))
    return math.sqrt(np.mean((exact.astype(float) - found) ** 2))


@precisions
def test_as_many_as_are_kept_are_exact_but_for_their_alpha(dtype):
    f = rays("surfaces", dtype=dtype)  # one to four, and no others
    exact, found = (moit.transmittance(f, t) for t in ("sorted", Strong(4)))
    assert np.abs(exact - found).max() < 4 * 2 * 0.5 / 1023
    assert error(f, Strong(4)) < 1e-3 < error(f, "power4")


@precisions
def test_the_strongest_is_exact_among_many_weak_ones_wherever_it_lies(dtype):
    """What is behind it sees through it; what is in front does not know of it."""
    depth = np.concatenate([np.linspace(1.1, 2.7, 40), [2.0]])
    alpha = np.append(np.full(40, 0.02), 0.9)
    f = moit.Fragments([0, 41], depth, alpha, depth_range=(1, math.e), dtype=dtype)
    exact, found = (moit.transmittance(f, t) for t in ("sorted", Strong(1)))
    assert np.abs(found / exact - 1).max() < 0.06  # moments of even absorbance
    without = moit.transmittance(f, "power6(exclude_self=True)")
    assert np.abs(without - exact).max() > 5 * np.abs(found - exact).max()


def test_the_rest_is_what_a_bounded_network_makes_of_moments_of_it():
    """Without what is kept, fragments of the same extent give what it absorbs."""
    rng = np.random.default_rng(3)
    depth = np.append(rng.uniform(1.2, 2.5, 30), [1.1, 2.6, 1.7])
    alpha = np.append(rng.uniform(0.01, 0.1, 30), [0.01, 0.01, 0.8])
    f = moit.Fragments([0, 33], depth, alpha, depth_range=(1, math.e))
    rest = moit.Fragments([0, 32], depth[:-1], alpha[:-1], depth_range=(1, math.e))
    network = moit.Network.shipped("strong")
    as_bounded = moit.Network(
        "neural-bounded6", network.weights, network.biases, network.mean, network.scale
    )
    bounded = moit.BoundedNeural("power6", as_bounded, storage="half", depth_range="pixel")
    T = moit.transmittance(f, Strong(1))
    of_rest = moit.transmittance(rest, bounded)
    kept = np.where(depth[:-1] > 1.7, 0.2, 1.0)
    np.testing.assert_allclose(T[:-1], kept * of_rest, rtol=4e-3)  # of 1 - alpha


@precisions
def test_orders_differ_by_last_digits_of_halves(dtype):
    for name in ("layers", "puffs", "tufts"):
        f = rays(name, dtype=dtype)
        other, order = reordered(f, 1)
        T, again = moit.transmittance(f, Strong(5)), moit.transmittance(other, Strong(5))
        assert math.sqrt(np.mean((T[order] - again) ** 2)) < 1e-2
        a, b = moit.composite(f, Strong(5)), moit.composite(other, Strong(5))
        assert math.sqrt(np.mean((a - b) ** 2)) < 1.5e-3


def test_it_is_nearer_the_truth_than_the_network_alone():
    share = []
    for name in data.SETS:
        f = rays(name, fragments=20_000)
        share.append(error(f, Strong(5)) / error(f, "neural-bounded6"))
    assert max(share) < 1 and np.mean(share) < 0.5


def test_the_curve_is_that_of_fragments_and_ends_with_the_total():
    f = rays("layers", dtype="float64")
    T = moit.transmittance(f, Strong(5))
    total = moit.total_transmittance(f, Strong(5)).ravel()
    curve = moit.transmittance(f, Strong(5), depth=[0.9, f.depth[7], 3.0]).reshape(-1, 3)
    assert (curve[:, 0] == 1).all() and (curve[:, 2] == total).all()
    # a fragment does not see itself, a depth sees all that may be there
    assert curve[0, 1] <= T[7] * 1.2 and curve[0, 1] == pytest.approx(T[7], abs=0.2)


def test_extents_of_pixels_are_refused_as_they_are_what_moments_have():
    with pytest.raises(ValueError, match="depth_range: 'pixel' has no meaning"):
        Strong(5, depth_range="pixel")
    with pytest.raises(NetworkError, match="expected one of kind 'strong'"):
        Strong(5, network=moit.Network.shipped("neural-bounded6"))


def test_bits_per_pixel():
    assert Strong(5).bits_per_pixel == 8 * 38
    assert Strong(2).bits_per_pixel == 8 * 26
    assert Strong(5, key_bits=64).bits_per_pixel == 8 * 58
    assert Strong(5).order_independent and not Strong(5).needs_order


@pytest.mark.parametrize(
    ("technique", "dtype"),
    [
        (Strong(5), "float32"),
        (Strong(5), "float64"),
        (Strong(1, warp="linear", key_bits=64), "float32"),
    ],
    ids=str,
)
def test_passes_give_the_bits_of_the_core(technique, dtype):
    f = rays("haze", fragments=600, dtype=dtype)
    expect_bits_of_the_core(f, technique)
