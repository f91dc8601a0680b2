"""Derivatives by the weights of a network against differences in 60 digits."""

import itertools

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from tests.oracle import states
from tests.test_gradients import FAR, NEAR, STEP, fragments, numbers_of


@pytest.mark.parametrize(
    ("name", "layers"), [("neural-bounded(bias=1e-6)", (72, 144, 153)), ("neural", (256, 784, 801))]
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


def test_techniques_without_a_network_have_no_derivatives_by_one():
    _, pullback = gradients.transmittance(fragments(numbers_of(3)), "power4")
    assert pullback(np.ones(3)).network is None
