"""Deep fragments against a plain evaluation, and exact where two fragments are all."""

from itertools import pairwise

import numpy as np
import pytest
from gpu import software_device
from oracle import networks

import moit
from moit import DeepFragments, Network
from moit.neural.features import features

precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
MAX_ALPHA = 1 - 0.5 / 256
UNWARPED = DeepFragments(warp="none")
# The product of 1 - alpha and what absorbance makes of it differ by some roundings.
FEW = 16


def rays(dtype, counts=None, seed=1, alpha=(0.02, 0.9)) -> moit.Fragments:
    """Pixels of 0 to 60 fragments, some of them at one depth; depths in [0, 1]."""
    rng = np.random.default_rng(seed)
    if counts is None:
        counts = np.concatenate([[0, 1, 2, 3, 4, 5, 15, 16, 17, 60], rng.integers(0, 40, 60)])
    n = int(np.sum(counts))
    depth = np.where(rng.random(n) < 0.1, 0.25, rng.random(n))
    return moit.Fragments(
        np.append(0, np.cumsum(counts)), depth, rng.uniform(*alpha, n),
        rng.random((n, 3)), depth_range=(0, 1), dtype=dtype,
    )  # fmt: skip


def pixels(f, network):
    for start, end in pairwise(f.offsets):
        own = slice(start, end)
        z, alpha = f.depth[own].astype(float), f.alpha[own].astype(float)
        a = -np.log1p(-np.minimum(alpha, MAX_ALPHA))
        color = f.color[own].astype(float)
        yield own, networks.Deep(network, z, z, alpha, a, color) if start < end else None


@precisions
def test_images_are_what_a_plain_evaluation_gives(dtype):
    f = rays(dtype)
    found = moit.composite(f, UNWARPED)[0]
    T = moit.transmittance(f, UNWARPED)
    total = moit.total_transmittance(f, UNWARPED)[0]
    seen = features(f, UNWARPED)
    # a float32 sum on the edge between two half floats may fall to either side, by 2^-11 of it
    allowed = 2e-3 if dtype == np.float32 else 1e-5
    off = []
    for p, (own, exact) in enumerate(pixels(f, Network.shipped("dfa"))):
        if exact is None:
            assert total[p] == 1 and (found[p] == 0).all()
            continue
        np.testing.assert_allclose(total[p], exact.total, rtol=1e-5, atol=1e-12)
        off.append(abs(found[p, :3] - exact.color).max())
        np.testing.assert_allclose(T[own], exact.T, rtol=allowed, atol=allowed)
        if exact.features is not None:
            np.testing.assert_allclose(
                seen[own, :5], np.tile(exact.features, (len(T[own]), 1)), rtol=1e-3, atol=1e-5
            )
    assert max(off) <= allowed
    assert np.median(off) <= 1e-5


@precisions
def test_up_to_two_fragments_are_exact(dtype):
    f = rays(dtype, np.tile([0, 1, 2], 50))
    background = (0.3, 0.6, 0.9)
    found = moit.composite(f, "dfa(warp='none')", background=background)
    exact = moit.composite(f, "sorted", background=background)
    assert abs(found - exact).max() <= FEW * np.finfo(dtype).eps
    T = moit.transmittance(f, UNWARPED)
    assert abs(T - moit.transmittance(f, "sorted")).max() <= FEW * np.finfo(dtype).eps


@precisions
def test_two_opaque_enough_fragments_hide_what_the_network_says(dtype):
    color = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5]], float)
    for alpha in ([0.5, 1, 0.5, 0.7], [1, 0.5, 0.5, 0.7]):
        f = moit.Fragments([0, 4], [0.1, 0.2, 0.3, 0.4], alpha, color, dtype=dtype)
        found = moit.composite(f, UNWARPED, cull_opaque=False, background=(9, 9, 9))
        exact = moit.composite(f, "sorted", cull_opaque=False, background=(9, 9, 9))
        np.testing.assert_array_equal(found, exact)


@precisions
def test_weights_sum_to_what_is_covered(dtype):
    f = rays(dtype)
    T = moit.transmittance(f, UNWARPED).astype(float)
    covered = np.array([(f.alpha[own].astype(float) @ T[own]) for own in slices(f)])
    total = moit.total_transmittance(f, UNWARPED)[0].astype(float)
    # the weighted sum is rounded up to 58 times, by 2^-11 of it at most
    assert abs(covered - (1 - total)).max() <= 58 * 2.0**-12


def slices(f):
    return [slice(a, b) for a, b in pairwise(f.offsets)]


@precisions
def test_the_network_moves_a_pixel_between_two_guesses(dtype):
    f = rays(dtype)
    shapes = (32, 5), (16, 32), (1, 16)
    seen = features(f, UNWARPED)
    answers = []
    for bias in (-200.0, 200.0):
        given = Network("dfa", [np.zeros(s) for s in shapes], [np.zeros(32), np.zeros(16), [bias]])
        answers.append(moit.transmittance(f, DeepFragments(given, warp="none")))
    np.testing.assert_allclose(answers[0], seen[:, 5], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(answers[1], seen[:, 5] + seen[:, 6], rtol=1e-5, atol=1e-6)
    shipped = moit.transmittance(f, UNWARPED)
    said = networks.said(Network.shipped("dfa"), seen[:, :5])
    np.testing.assert_allclose(shipped, seen[:, 5] + said * seen[:, 6], rtol=2e-5, atol=2e-5)


def test_colours_lie_within_those_of_the_fragments_however_bright():
    rng = np.random.default_rng(4)
    f = rays(np.float64, np.full(200, 20))
    bright = 10.0 ** rng.uniform(-2, 3, 200)
    color = (1 + rng.random((len(f), 3))) * np.repeat(bright, 20)[:, None]
    f = moit.Fragments(f.offsets, f.depth, f.alpha, color, depth_range=(0, 1))
    found = moit.composite(f, UNWARPED)[0]
    mean = found[:, :3] / found[:, 3:] / bright[:, None]
    slack = 1 + 40 * 2.0**-11  # of half floats, rounded for each fragment
    assert (mean >= 1 / slack).all() and (mean <= 2 * slack).all()


@precisions
def test_thin_fragments_behind_two_are_seen(dtype):
    for alpha in (1e-3, 1e-5):
        f = moit.Fragments(
            [0, 3], [0.1, 0.2, 0.3], [0.5, 0.5, alpha],
            [[0, 0, 0], [0, 0, 0], [1, 1, 1]], depth_range=(0, 1), dtype=dtype,
        )  # fmt: skip
        found = moit.composite(f, UNWARPED)[0, 0]
        # what is left of b0 without the two nearest has its digits, as it is a difference
        assert found[0] == pytest.approx(
            0.25 * alpha, rel=2e-3 + float(4 * np.finfo(dtype).eps / alpha)
        )
        assert moit.transmittance(f, UNWARPED)[2] == pytest.approx(0.25, rel=2e-3)


@pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")
@precisions
def test_thousands_of_fragments_give_numbers(dtype):
    rng = np.random.default_rng(2)
    alpha = np.concatenate([rng.random(10_000), [0, 0, 0, 1e-3, 1, 1 - 1e-7], np.ones(3000)])
    n = len(alpha)
    f = moit.Fragments(
        [0, 10_000, 10_006, n], rng.random(n), alpha, 1e6 * rng.random((n, 3)), depth_range=(0, 1),
        dtype=dtype,
    )  # fmt: skip
    for cull in (True, False):
        assert np.isfinite(moit.composite(f, UNWARPED, cull_opaque=cull)).all()
        assert np.isfinite(moit.transmittance(f, UNWARPED, cull_opaque=cull)).all()
    assert np.isfinite(features(f, UNWARPED, cull_opaque=False)).all()


def test_arrival_order_shows_by_rounding_to_half_floats_alone():
    f = rays(np.float64, np.full(40, 30))
    depth = f.depth + 1e-6 * np.random.default_rng(0).random(len(f))  # no ties
    f = moit.Fragments(f.offsets, depth, f.alpha, f.color, depth_range=(0, 1.1))
    found = moit.composite(f, UNWARPED)
    other = moit.composite(f.shuffled(1), UNWARPED)
    assert 0 < abs(found - other).max() <= 30 * 2.0**-11
    # the two in front and the total are the same
    assert (found[..., 3] - other[..., 3]).max() <= 1e-12


def test_equal_depths_are_taken_as_they_arrive():
    color = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    f = moit.Fragments([0, 3], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5], color, depth_range=(0, 1))
    assert moit.transmittance(f, UNWARPED)[:2].tolist() == [1, 0.5]


def test_what_it_does_not_do_is_said():
    f = rays(np.float32)
    with pytest.raises(TypeError, match="depth"):
        moit.transmittance(f, UNWARPED, depth=[0.5])
    coloured = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, transmission=np.zeros((len(f), 3))
    )
    with pytest.raises(ValueError, match="transmission"):
        moit.composite(coloured, UNWARPED)
    with pytest.raises(moit.MoitError, match="network: expected one of kind 'dfa'"):
        DeepFragments(Network.shipped("neural"))


def test_bits_and_names():
    one = DeepFragments()
    assert str(one) == "dfa" and moit.technique("dfa(warp='linear')").warp == "linear"
    assert one.bits_per_pixel == 224
    assert one.published_bits == {"NMT": 352}


@precisions
def test_a_gpu_answers_to_the_cores_bits(dtype):
    device = software_device()
    f = rays(dtype)
    for question in (moit.transmittance, moit.composite, moit.total_transmittance):
        np.testing.assert_array_equal(
            question(f, UNWARPED, device=device), question(f, UNWARPED, device="cpu")
        )
