"""State of 16 bits moves as if it held all digits: derivatives are those of 32 bits, nearly."""

import dataclasses

import numpy as np
import pytest

import moit
from moit import gradients

# What 16 bits hold, and the same in 32.
STORED = (
    ("power4(bits=16)", "power4"),
    ("power6(bits=16, exclude_self=True)", "power6(exclude_self=True)"),
    ("power4(storage='half')", "power4"),
    ("power6(storage='half', depth_range='pixel')", "power6(depth_range='pixel')"),
    ("trig2(bits=16)", "trig2"),
    ("neural-bounded(storage='half')", "neural-bounded"),
    ("fourier7", "fourier7(bits=32)"),
    ("transmittance-function-map", "transmittance-function-map(bits=32)"),
)


def rays(pixels, n):
    rng = np.random.default_rng(7)
    depth, alpha = rng.uniform(1, 6, pixels * n), rng.uniform(0.05, 0.6, pixels * n)
    color = rng.uniform(0, 1, (pixels * n, 3))
    offsets = np.arange(pixels + 1) * n
    return moit.Fragments(offsets, depth, alpha, color, depth_range=(1, 6), dtype="float64")


@pytest.mark.parametrize(("name", "all_digits"), STORED)
def test_derivatives_are_those_of_all_digits(name, all_digits):
    stored, exact = moit.technique(name), moit.technique(all_digits)
    if hasattr(stored, "bias"):
        exact = dataclasses.replace(exact, bias=stored.bias_for(np.float64))
    f, rng = rays(6, 8), np.random.default_rng(3)
    asked = [1.1, 2.0, 3.5, 5.2]
    for ask in (
        lambda technique: gradients.composite(f, technique, background=(0.2, 0.5, 0.3)),
        lambda technique: gradients.transmittance(f, technique),
        lambda technique: gradients.transmittance(f, technique, asked),
    ):
        answer, pullback = ask(stored)
        seed = rng.normal(size=answer.shape)
        got, wanted = pullback(seed), ask(exact)[1](seed)
        for part in ("alpha", "depth", "color"):
            by, of_all = getattr(got, part), getattr(wanted, part)
            # rounding to 11 bits, and what the way back from moments makes of it
            assert np.abs(by - of_all).mean() <= 0.04 * np.abs(of_all).mean(), part


def test_ends_of_extents_in_words_move_with_fragments():
    """All depths scaled alike leave what is within them: with logarithms no derivative is left."""
    f = rays(6, 8)
    for name in ("power4(storage='half', depth_range='pixel')", "neural"):
        answer, pullback = gradients.transmittance(f, name)
        by_depth = pullback(np.random.default_rng(1).normal(size=answer.shape)).depth * f.depth
        by_pixel = by_depth.reshape(6, 8)
        assert np.abs(by_pixel.sum(axis=1)).max() < 1e-9 * np.abs(by_pixel).max()
