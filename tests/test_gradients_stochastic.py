"""Derivatives of what is drawn are on average those of what it is on average."""

import numpy as np
import pytest

import moit
from moit import gradients

PIXELS = 40_000
DEPTH = np.array([3.0, 1.0, 2.0, 4.0, 2.4])
ALPHA = np.array([0.5, 0.3, 0.6, 0.8, 0.2])


def same_rays(transmission=None):
    rng = np.random.default_rng(2)
    color = np.tile(rng.uniform(0, 1, (5, 3)), (PIXELS, 1))
    tint = None if transmission is None else np.tile(transmission, (PIXELS, 1))
    numbers = (np.tile(DEPTH, PIXELS), np.tile(ALPHA, PIXELS), color)
    offsets = np.arange(PIXELS + 1) * 5
    return moit.Fragments(offsets, *numbers, transmission=tint, depth_range=(1, 5), dtype="float64")


@pytest.mark.parametrize("asks", ("image", "T", "curve"))
def test_derivatives_are_on_average_those_of_what_is_exact(asks):
    f = same_rays()
    found = []
    for technique in ("stochastic8(normalize=False)", "sorted"):
        if asks == "image":
            answer, pullback = gradients.composite(f, technique, background=(0.3, 0.5, 0.2))
            seed = np.broadcast_to(np.array([0.7, -0.4, 1.1, 0.3]), answer.shape)
        elif asks == "T":
            answer, pullback = gradients.transmittance(f, technique)
            seed = np.tile([0.5, 1, -1, 2, 0.4], PIXELS)
        else:
            answer, pullback = gradients.transmittance(f, technique, [1.5, 2.0, 2.45, 3.7])
            seed = np.broadcast_to(np.array([1, 0.5, -2, 1.5]), answer.shape)
        d = pullback(seed)
        found.append((d.alpha.reshape(PIXELS, 5), d.color.reshape(PIXELS, 15), d.depth))
    for drawn, exact in zip(found[0][:2], found[1][:2], strict=True):
        noise = drawn.std(axis=0) / np.sqrt(PIXELS)
        # draws are the same in each run; of pixels that are drawn without one another
        assert (np.abs(drawn.mean(axis=0) - exact[0]) <= 5 * noise + 1e-12).all()
        assert asks == "image" or not drawn[:, 5:].any()
    assert found[0][0].std(axis=0)[1] > 0
    assert not found[0][2].any()
