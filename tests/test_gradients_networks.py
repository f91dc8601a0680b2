"""Derivatives by the weights of a network against differences in 60 digits."""

import itertools

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from moit.neural.backpropagation import Perceptron
from moit.neural.examples import examples_of
from tests.oracle import states
from tests.test_gradients import FAR, NEAR, STEP, fragments, numbers_of


@pytest.mark.parametrize(
    ("name", "layers"),
    [
        ("neural-bounded(bias=1e-6)", (72, 144, 153)),
        ("neural-slices5(bits=16)", (88, 160, 169)),
        ("neural", (256, 784, 801)),
    ],
)
def test_weights_have_the_derivatives_of_differences(name, layers):
    technique = moit.technique(name)
    numbers = numbers_of(6)
    f = fragments(numbers)
    T, pullback = gradients.transmittance(f, technique)
    seed = np.random.default_rng(3).normal(size=T.shape)
    found = pullback(seed).network
    assert found.shape == layers[2:]
    with mp.workdps(60):
        depth, alpha = ([mpf(float(x)) for x in one] for one in numbers[:2])
        warped = states.warp_of(technique, depth, NEAR, FAR)
        z = [warped(one) for one in depth]

        def loss(packed):
            read, _ = states.STATES[technique.kind](technique, z, alpha, depth, packed)
            return mp.fsum(mpf(s) * read(*one) for s, *one in zip(seed, z, alpha, strict=True))

        packed = [mpf(float(w)) for w in states.weights_of(technique)]
        ends = (0, *layers[:2], layers[2] - 1)  # the largest of each layer, and the last bias
        most = [a + int(np.abs(found[a:b]).argmax()) for a, b in itertools.pairwise(ends)]
        for i in (*most, layers[2] - 1):
            ends = [loss([*packed[:i], packed[i] + s, *packed[i + 1 :]]) for s in (STEP, -STEP)]
            assert found[i] == pytest.approx(float((ends[0] - ends[1]) / (2 * STEP)), rel=1e-9)


@pytest.mark.parametrize(
    "name", ("neural-bounded", "neural-bounded6", "neural-slices8", "neural", "dfa")
)
def test_training_goes_down_the_slopes_of_the_core(name):
    """`moit.train` works on many fragments at once, by matrices, and on what they were made of."""
    technique = moit.technique(name)
    rng = np.random.default_rng(5)
    offsets = np.cumsum([0, 5, 9, 3, 12])
    depth, alpha = rng.uniform(NEAR, FAR, offsets[-1]), rng.uniform(0.05, 0.8, offsets[-1])
    f = moit.Fragments(offsets, depth, alpha, depth_range=(NEAR, FAR), dtype="float64")
    examples = examples_of(f, technique)
    packed = states.weights_of(technique).astype(np.float64)
    network = Perceptron((examples.features.shape[1], *technique_layers(name), 1), packed)
    held = network.forward(examples.features.astype(np.float64))
    T, pullback = gradients.transmittance(f, technique)
    read, slope = examples.transmittance(held[-1][0])
    np.testing.assert_allclose(T, read, atol=2e-5)  # features of floats
    seed = rng.normal(size=T.shape)
    np.testing.assert_allclose(
        pullback(seed).network, network.gradient(held, (seed * slope)[None]), atol=1e-4, rtol=1e-3
    )


def technique_layers(name):
    return (8, 8) if name.startswith(("neural-bounded", "neural-slices")) else (32, 16)


def test_techniques_without_a_network_have_no_derivatives_by_one():
    _, pullback = gradients.transmittance(fragments(numbers_of(3)), "power4")
    assert pullback(np.ones(3)).network is None


def test_blocks_of_equal_pixels_move_a_network_as_these_do():
    """Their means are what each pixel's state is, so a network sees the same, and is seen once."""
    numbers = [np.concatenate([one] * 12) for one in numbers_of(5)[:2]]
    f = moit.Fragments(
        np.arange(13) * 5, *numbers, shape=(3, 4), depth_range=(NEAR, FAR), dtype="float64"
    )
    seed, found = np.random.default_rng(2).normal(size=60), []
    for name in ("neural-bounded(bias=1e-6)", "neural-bounded(bias=1e-6, resolution=2)"):
        _, pullback = gradients.transmittance(f, name)
        found.append(pullback(seed).network)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-7, atol=1e-9)
