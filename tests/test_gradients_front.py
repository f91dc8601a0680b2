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
    "name", ("front2", "front2(tail='trig2')", "front2(tail='neural-bounded')")
)
def test_the_bias_of_a_thin_tail_moves_with_the_absorbance_of_all(name):
    technique = moit.technique(name)
    rng = np.random.default_rng(4)
    depth = np.array([1.2, 1.5, *rng.uniform(2, 5.9, 5)], np.float32)
    alpha = np.array([0.9, 0.8, *rng.uniform(1e-4, 3e-4, 5)], np.float32)
    f = moit.Fragments([0, 7], depth, alpha, depth_range=(NEAR, FAR))
    _, pullback = gradients.transmittance(f, technique)
    seed = np.array([0, 0, 1, -1, 2, -1, -1], np.float32)  # what is in front of all is not seen
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
            # all but the results is double
            np.testing.assert_allclose(got, wanted, rtol=1e-6, atol=1e-12)
