"""Neural moment transparency against its equations."""

from itertools import pairwise

import numpy as np
import pytest
from gpu import software_device
from oracle import networks

import moit
from moit import Network, NeuralMoments
from moit.neural.features import features

precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
ranges = pytest.mark.parametrize("depth_range", ["pixel", "image"])
MAX_ALPHA = 1 - 0.5 / 256


def technique(depth_range="pixel", **options) -> NeuralMoments:
    return NeuralMoments(depth_range=depth_range, warp="none", **options)


def gentle(kind="neural", seed=3) -> Network:
    """A network whose answers hang little on a feature's last digits."""
    rng = np.random.default_rng(seed)
    sizes = [7, 32, 16, 1]
    weights = [rng.normal(size=(o, i)) / np.sqrt(i) for i, o in pairwise(sizes)]
    biases = [0.1 * rng.normal(size=o) for o in sizes[1:]]
    mean, scale = [0.5, 16, 5, 0, 2, 0, 2], [0.3, 9, 4, 3, 2, 2, 2]
    return Network(kind, weights, biases, mean, scale)


def rays(dtype, seed=1, opaque=False) -> moit.Fragments:
    """Pixels of 0 to 60 fragments, some of them at one depth; depths in [-1, 1]."""
    rng = np.random.default_rng(seed)
    counts = np.concatenate([[0, 1, 2, 3, 4, 5, 15, 16, 17, 60], rng.integers(0, 40, 60)])
    n = int(counts.sum())
    alpha = rng.uniform(0.02, 0.9, n)
    if opaque:
        alpha[rng.random(n) < 0.1] = 1
    depth = np.where(rng.random(n) < 0.1, 0.25, rng.uniform(-1, 1, n))
    offsets = np.append(0, np.cumsum(counts))
    return moit.Fragments(
        offsets, depth, alpha, rng.random((n, 3)), depth_range=(-1, 1), dtype=dtype
    )


def pixels(f):
    for start, end in pairwise(f.offsets):
        if start < end:
            own = slice(start, end)
            z, alpha = f.depth[own].astype(float), f.alpha[own].astype(float)
            yield own, z, -np.log1p(-np.minimum(alpha, MAX_ALPHA))


@ranges
@precisions
def test_transmittance_is_what_the_equations_give(depth_range, dtype):
    network = gentle("neural" if depth_range == "pixel" else "neural-image")
    f = rays(dtype)
    found = moit.transmittance(f, technique(depth_range, network=network))
    assert found.dtype == dtype
    for own, z, a in pixels(f):
        expected = networks.neural(network, z, a, depth_range == "pixel")
        # weights are packed as float32 with mean and scale in them
        np.testing.assert_allclose(found[own], expected, rtol=0, atol=1e-5)


@ranges
@precisions
def test_the_shipped_network_answers_as_numpy_does(depth_range, dtype):
    asked = technique(depth_range)
    network = Network.shipped(asked.network_kind)
    f = rays(dtype)
    seen, found = features(f, asked), moit.transmittance(f, asked)
    low = np.concatenate([np.full(len(a), np.exp(-a.sum())) for _, _, a in pixels(f)])
    expected = np.maximum(networks.said(network, seen), low)
    # of features as float32 has them
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)


@ranges
@precisions
def test_features_are_those_of_the_paper(depth_range, dtype):
    f = rays(dtype)
    seen = features(f, technique(depth_range))
    assert seen.shape == (len(f), 7)
    for own, z, a in pixels(f):
        expected = networks.neural_features(z, a, depth_range == "pixel")
        np.testing.assert_allclose(seen[own], expected, rtol=2e-6, atol=4e-6)


@ranges
def test_one_fragment_or_several_at_one_depth_are_at_the_front(depth_range):
    f = moit.Fragments(
        [0, 1, 4], [0.3, -0.7, -0.7, -0.7], [0.5, 0.1, 0.2, 0.3], depth_range=(-1, 1)
    )
    seen = features(f, technique(depth_range))
    assert (seen[:, 0] == 0).all()
    if depth_range == "pixel":
        assert (seen[:, 3:] == 0).all()  # in the middle of their own range
    assert np.isfinite(moit.transmittance(f, technique(depth_range))).all()


@ranges
@precisions
def test_colours_are_normalized_by_equation_7(depth_range, dtype):
    f = rays(dtype)
    asked = technique(depth_range)
    T = moit.transmittance(f, asked).astype(float)
    found = moit.composite(f, asked, background=(0.2, 0.4, 0.6))[0]
    plain = moit.composite(f, technique(depth_range, normalize=False))[0]
    p = -1
    for start, end in pairwise(f.offsets):
        p += 1
        own = slice(start, end)
        alpha, color = f.alpha[own].astype(float), f.color[own].astype(float)
        total = np.prod(1 - np.minimum(alpha, MAX_ALPHA))
        summed = (alpha * T[own]) @ color if start < end else np.zeros(3)
        covered = (alpha * T[own]).sum()
        scale = (1 - total) / covered if start < end else 0
        behind = total * np.array([0.2, 0.4, 0.6])
        np.testing.assert_allclose(found[p, :3], scale * summed + behind, atol=3e-6, rtol=3e-6)
        np.testing.assert_allclose(plain[p, :3], summed, atol=3e-6, rtol=3e-6)
        np.testing.assert_allclose(found[p, 3], 1 - total, atol=3e-6)


@ranges
@precisions
def test_transmittance_stays_between_the_total_and_one_whatever_the_network_says(
    depth_range, dtype
):
    f = rays(dtype)
    rng = np.random.default_rng(0)
    kind = technique(depth_range).network_kind
    for size in (1, 1e3):
        wild = Network(
            kind,
            [size * rng.normal(size=s) for s in ((32, 7), (16, 32), (1, 16))],
            [size * rng.normal(size=s) for s in (32, 16, 1)],
        )
        asked = technique(depth_range, network=wild)
        T = moit.transmittance(f, asked)
        least = np.repeat(moit.total_transmittance(f, asked).ravel(), f.counts.ravel())
        # the total is computed in double, T in the fragments' precision
        assert (T >= least * (1 - 64 * np.finfo(dtype).eps)).all() and (T <= 1).all()
        assert np.isfinite(moit.composite(f, asked)).all()


@ranges
@precisions
def test_a_curve_is_exact_outside_of_a_pixels_extent(depth_range, dtype):
    f = moit.Fragments([0, 3], [-0.2, 0.1, 0.3], [0.5, 0.25, 0.5], depth_range=(-1, 1), dtype=dtype)
    asked = technique(depth_range)
    around = [-1.0, -0.21, 0.31, 1.0]
    curve = moit.transmittance(f, asked, depth=around)[0, 0]
    total = moit.total_transmittance(f, asked)[0, 0]
    assert curve[:2].tolist() == [1, 1]
    np.testing.assert_allclose(curve[2:], total, rtol=8 * np.finfo(dtype).eps)
    at = moit.transmittance(f, asked, depth=f.depth.astype(float))[0, 0]
    assert at.tolist() == moit.transmittance(f, asked).tolist()


@ranges
@precisions
def test_thousands_of_fragments_and_extreme_opacity_give_numbers(depth_range, dtype):
    rng = np.random.default_rng(2)
    alpha = np.concatenate([rng.random(10_000), [0, 1, 1e-3, 1 - 1e-7], np.ones(3000)])
    n = len(alpha)
    f = moit.Fragments(
        [0, 10_000, 10_004, n], rng.uniform(-1, 1, n), alpha, rng.random((n, 3)),
        depth_range=(-1, 1), dtype=dtype,
    )  # fmt: skip
    for cull in (True, False):
        image = moit.composite(f, technique(depth_range), cull_opaque=cull)
        assert np.isfinite(image).all() and image.min() >= 0 and image.max() <= 1 + 1e-6
    assert np.isfinite(features(f, technique(depth_range), cull_opaque=False)).all()


@ranges
def test_arrival_order_does_not_show(depth_range):
    # sums run in double: their order is lost in a float
    f = rays(np.float64)
    for seed in (1, 2):
        found = moit.composite(f.shuffled(seed), technique(depth_range))
        assert np.abs(found - moit.composite(f, technique(depth_range))).max() <= 1e-12


def test_transmission_dims_as_the_net_coverage():
    f = rays(np.float64)
    grey = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, depth_range=(-1, 1),
        transmission=np.full((len(f), 3), 0.5),
    )  # fmt: skip
    net = moit.Fragments(f.offsets, f.depth, f.alpha / 2, depth_range=(-1, 1))
    found = moit.transmittance(grey, technique())
    np.testing.assert_allclose(found, moit.transmittance(net, technique()), atol=1e-12)


def test_a_network_for_the_one_range_is_refused_for_the_other():
    scene = Network.shipped("neural-image")
    with pytest.raises(moit.MoitError, match="network: expected one of kind 'neural', got"):
        NeuralMoments(scene)
    with pytest.raises(moit.MoitError, match="expected one of kind 'neural-image'"):
        NeuralMoments(Network.shipped("neural"), depth_range="image")


def test_bits_and_names():
    assert str(NeuralMoments()) == "neural"
    assert str(NeuralMoments(depth_range="image")) == "neural(depth_range='image')"
    for one in (NeuralMoments(), NeuralMoments(depth_range="image")):
        assert moit.technique(str(one)) == one
        assert one.bits_per_pixel == 224
        assert one.published_bits == {"NMT": 352}
    for bad in ({"depth_range": "scene"}, {"warp": "cubic"}, {"max_alpha": 1.0}, {"normalize": 2}):
        with pytest.raises((ValueError, TypeError), match=next(iter(bad))):
            NeuralMoments(**bad)


@ranges
def test_a_gpu_answers_to_the_cores_bits(depth_range):
    device = software_device()
    f = rays(np.float32, opaque=True)
    asked = technique(depth_range)
    for question in (moit.transmittance, moit.composite, moit.total_transmittance):
        np.testing.assert_array_equal(
            question(f, asked, device=device), question(f, asked, device="cpu")
        )
