"""State of 16 bits moves as if it held all digits: derivatives are those of 32 bits, nearly."""

import dataclasses

import numpy as np
import pytest

import moit
from moit import gradients

TAIL = "power4(bias=1e-3)"
# What 16 bits hold, and the same in 32; and keys of 32 bits.
STORED = (
    ("power4(bits=16)", "power4"),
    ("power6(bits=16, exclude_self=True)", "power6(exclude_self=True)"),
    ("power4(storage='half')", "power4"),
    ("power6(storage='half', depth_range='pixel')", "power6(depth_range='pixel')"),
    ("trig2(bits=16)", "trig2"),
    ("neural-bounded(storage='half')", "neural-bounded"),
    ("fourier7", "fourier7(bits=32)"),
    ("transmittance-function-map", "transmittance-function-map(bits=32)"),
    ("wboit(bits=16)", "wboit"),
    ("moment-transparency(storage='unorm16')", "moment-transparency"),
    ("moment-transparency-nlqm", "moment-transparency"),
    ("two-moments-pass(storage='nlqm', bias=1e-4)", "two-moments-pass"),
    (f"front2(tail='{TAIL}', key_bits=32)", f"front2(tail='{TAIL}')"),
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
    asks = [
        lambda technique: gradients.composite(f, technique, background=(0.2, 0.5, 0.3)),
        lambda technique: gradients.transmittance(f, technique),
        lambda technique: gradients.total_transmittance(f, technique),
    ]
    if stored.has_curve:
        asks.append(lambda technique: gradients.transmittance(f, technique, asked))
    for ask in asks:
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


def test_keys_move_as_the_fragments_that_they_say():
    """Of keys of 32 bits all is known by z and alpha as they are rounded: there derivatives are
    those of keys that hold all digits, to the last of these."""
    f, rng = rays(6, 8), np.random.default_rng(5)
    z = 2 * np.log(f.depth) / np.log(6) - 1
    rounded_z = 2 * np.rint((0.5 + 0.5 * z) * (2**20 - 1)) / (2**20 - 1) - 1
    depth = 6 ** ((rounded_z + 1) / 2)
    alpha = 1 - (np.rint(4095 * np.sqrt(1 - f.alpha)) / 4095) ** 2
    said = moit.Fragments(f.offsets, depth, alpha, depth_range=(1, 6), dtype="float64")
    seed = rng.normal(size=len(depth))
    got = gradients.transmittance(f, f"front2(tail='{TAIL}', key_bits=32)")[1](seed)
    wanted = gradients.transmittance(said, f"front2(tail='{TAIL}')")[1](seed)
    np.testing.assert_allclose(got.alpha, wanted.alpha, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(got.depth * f.depth, wanted.depth * depth, rtol=1e-8, atol=1e-8)
    assert np.abs(got.depth).max() > 0.1
