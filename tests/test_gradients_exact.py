"""Doubles with their own bias, where moments hold less than fragments tell: derivatives are those
of the fragments, against differences in 60 digits."""

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from tests.oracle import states

STEP = mpf(10) ** -25
CLUSTERS = (-0.97, -0.97 + 3e-6, -0.97 + 8e-6, 0.97 - 7e-6, 0.97 - 2e-6, 0.97)
PAIR = (-0.3, -0.3 + 2e-6, 0.1, 0.6)
SEEN = (-0.97, -0.4, 0.3, 0.97)  # as many as nodes, and what bias leaves of that


@pytest.mark.parametrize(
    ("name", "depth"),
    (
        ("power8(warp='none')", CLUSTERS),
        ("power6(warp='none', exclude_self=True)", PAIR),
        ("power4(warp='none')", CLUSTERS),
        ("power8(warp='none')", SEEN),
    ),
)
def test_derivatives_are_of_fragments_not_of_what_doubles_keep_of_moments(name, depth):
    technique = moit.technique(name)
    n, rng = len(depth), np.random.default_rng(2)
    alpha, (seed, *ways) = rng.uniform(0.1, 0.8, n), rng.normal(size=(3, n))
    order = rng.permutation(n)
    given = [np.array(depth)[order], alpha]
    f = moit.Fragments([0, n], *given, depth_range=(-1, 1), dtype="float64")
    found = gradients.transmittance(f, technique)[1](seed)
    parts = np.array([found.depth, found.alpha]) * ways
    ends = []
    with mp.workdps(60):
        for step in (STEP, -STEP):
            numbers = [
                tuple(mpf(float(x)) + step * mpf(float(w)) for x, w in zip(one, way, strict=True))
                for one, way in zip(given, ways, strict=True)
            ]
            answer = states.seen(technique, *numbers, -1, 1)[0]
            ends.append(mp.fsum(mpf(float(s)) * t for s, t in zip(seed, answer, strict=True)))
        wanted = float((ends[0] - ends[1]) / (2 * STEP))
    assert abs(parts.sum() - wanted) < 1e-9 * np.abs(parts).sum()
