"""The bias of a tail behind front layers hangs on its share of the whole, and is pulled."""

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from tests.oracle import front

NEAR, FAR = 1.0, 6.0
STEP = mpf(10) ** -25


@pytest.mark.parametrize(
    "name", ("front2", "front2(tail='trig2')", "front1(tail='neural-bounded', normalize=False)")
)
def test_the_bias_of_a_thin_tail_moves_with_the_absorbance_of_all(name):
    technique = moit.technique(name)
    rng = np.random.default_rng(4)
    depth = np.array([1.2, 1.5, *rng.uniform(2, 5.9, 5)], np.float32)
    alpha = np.array([0.9, 0.8, *rng.uniform(0.01, 0.03, 5)], np.float32)
    f = moit.Fragments([0, 7], depth, alpha, depth_range=(NEAR, FAR))
    _, pullback = gradients.transmittance(f, technique)
    seed = np.array([0, 0, 1, -1, 1, -1, 1], np.float32)  # of sums, what front layers do is most
    found = pullback(seed)
    with mp.workdps(60):
        ray = [[mpf(float(x)) for x in one] for one in (depth, alpha)]

        def loss(which, i, step):
            numbers = [list(one) for one in ray]
            numbers[which][i] += step
            seen, _ = front.seen(technique, *map(tuple, numbers), NEAR, FAR, "float32")
            return mp.fsum(mpf(float(s)) * one for s, one in zip(seed, seen, strict=True))

        for which, got in enumerate((found.depth, found.alpha)):
            wanted = [
                float((loss(which, i, STEP) - loss(which, i, -STEP)) / (2 * STEP)) for i in range(7)
            ]
            # numbers are of floats, and in the twin of the tile of doubles
            np.testing.assert_allclose(got, wanted, rtol=2e-5, atol=2e-6 * np.abs(wanted).max())
