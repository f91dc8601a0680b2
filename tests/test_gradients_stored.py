"""State of 16 bits moves as if it held all digits: derivatives are those of 32 bits, nearly."""

import dataclasses

import numpy as np
import pytest
from mpmath import mp, mpf
from test_moment_transparency import decoded

import moit
from moit import gradients
from tests.oracle import front, power, states

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


STEP = mpf(10) ** -25


def differences(found, f, loss):
    """Holds derivatives along a direction of all alphas and of all depths to those of a loss of
    numbers in 60 digits."""
    ways = np.random.default_rng(11).normal(size=(2, len(f)))
    given = [[mpf(float(x)) for x in one] for one in (f.depth, f.alpha)]
    for which, (part, way) in enumerate(zip(("depth", "alpha"), ways, strict=True)):
        ends = []
        for step in (STEP, -STEP):
            numbers = list(given)
            numbers[which] = [
                x + step * mpf(float(w)) for x, w in zip(given[which], way, strict=True)
            ]
            ends.append(loss(*numbers))
        parts = getattr(found, part) * way
        wanted = float((ends[0] - ends[1]) / (2 * STEP))
        assert abs(parts.sum() - wanted) <= 1e-9 * np.abs(parts).sum(), part
        assert np.abs(parts).sum() > 0.01


def held_states(technique, f):
    """Of each pass b0 and the moments that one ray's storage holds."""
    found = [moit.moments.gather(f, technique)]
    if technique.kind == "moment-transparency":
        raw = moit.moments.gather(f, technique, raw=True)
        of_passes = raw if technique.passes == 2 else [raw]
        found = [(b0, decoded(technique, words)) for b0, words in of_passes]
    return [[mpf(float(x)) for x in (b0[0], *b[0])] for b0, b in found]


OF_FLOATS, OF_WORDS = (0.0, 0.375) * 2, (0.0, float(np.float32(0.628))) * 2


@pytest.mark.parametrize(
    ("name", "safe"),
    (
        ("power4(bits=16, bias=1e-2)", OF_WORDS),
        ("power4(bits=16, exclude_self=True, bias=1e-2)", OF_WORDS),
        ("power4(storage='half', bias=1e-2)", OF_FLOATS),
        ("moment-transparency(storage='unorm16', warp='linear', bias=1e-2)", (0.5,) * 4),
        ("moment-transparency(storage='nlqm', exclude_self=True, bias=1e-2)", None),
        ("moment-transparency(passes=2, storage='nlqm', bias=1e-2)", None),
        ("two-moments-pass(storage='unorm16', warp='linear', bias=1e-2)", (0.5,) * 4),
        ("two-moments-pass(storage='nlqm', exclude_self=True, bias=1e-2)", None),
    ),
)
def test_stored_moments_move_as_all_digits_would(name, safe):
    """Straight-through: state is what 16 bits hold, and moves as the exact moments do; that of a
    second pass as those of what the first, as it is held, lets through. With less bias what
    rounding does to pivots is more than it outweighs, and these are kept above that."""
    technique, f = moit.technique(name), rays(1, 6)
    T, pullback = gradients.transmittance(f, technique)
    seed = np.random.default_rng(3).normal(size=T.shape)
    with mp.workdps(60):
        stored, before = held_states(technique, f), []

        def sums(z, a):
            total = mp.fsum(a)
            powers = [mp.fsum(x * y**k for x, y in zip(a, z, strict=True)) for k in range(1, 5)]
            return [total, *(x / total for x in powers)]

        def places(depth):
            return [*map(states.warp_of(technique, depth, 1.0, 6.0), depth)]

        given = [[mpf(float(x)) for x in one] for one in (f.depth, f.alpha)]

        def one_pass(k, z, a):
            """The total, and T in front of each of absorbances a."""
            exact = sums(z, a)
            if k == len(before):  # the first that are asked for are those that are given
                before.append(exact)
            moved = zip(stored[k], exact, before[k], strict=True)
            total, *now = (x + (y - y0) for x, y, y0 in moved)
            if safe is None:  # words hold nodes that bias has moved already
                keeps = 1 - mpf(technique.bias_for(np.float64))
                now = [x + keeps * (y - x) for x, y in zip(stored[k][1:], now, strict=True)]
            ray = power.biased(now, technique.bias_for(np.float64) if safe else 0, safe or now)
            own, beta = a if technique.excludes_self else [0] * len(a), technique.overestimation
            read = zip(z, own, strict=True)
            return total, [power.transmittance_but_self(ray, total, *one, beta) for one in read]

        def loss(depth, alpha):
            z, a = places(depth), states.absorbances(technique, alpha)
            total, T = one_pass(0, z, a)
            if len(stored) == 2:
                seen, T = one_pass(1, z, [x * t for x, t in zip(a, T, strict=True)])
                ratio = mp.expm1(-total) / mp.expm1(-seen)
                T = [1 - (1 - t) * ratio for t in T]
            return mp.fsum(mpf(float(s)) * t for s, t in zip(seed, T, strict=True))

        assert float((T * seed).sum()) == pytest.approx(float(loss(*given)), abs=1e-6)
        differences(pullback(seed), f, loss)


def test_keys_move_as_all_digits_would():
    """The same of front layers, whose keys say z in 20 bits and alpha in 12."""
    name, wide = (f"front2(tail='{TAIL}'{more})" for more in (", key_bits=32", ""))
    f, technique = rays(1, 6), moit.technique(wide)
    T, pullback = gradients.transmittance(f, name)
    seed = np.random.default_rng(3).normal(size=T.shape)
    with mp.workdps(60):
        six, one = mp.log(6), 2**20 - 1
        given = [[mpf(float(x)) for x in one] for one in (f.depth, f.alpha)]

        def shares(depth):
            return [mp.log(x) / six for x in depth]

        said = [mp.nint(x * one) / one for x in shares(given[0])]
        clear = [1 - (mp.nint(4095 * mp.sqrt(1 - a)) / 4095) ** 2 for a in given[1]]

        def loss(depth, alpha):
            moved = zip(said, shares(depth), shares(given[0]), strict=True)
            keys = tuple(mp.exp(six * (s + x - x0)) for s, x, x0 in moved)
            seen = tuple(c + (a - a0) for c, a, a0 in zip(clear, alpha, given[1], strict=True))
            answer = front.seen(technique, keys, seen, 1.0, 6.0)[0]
            return mp.fsum(mpf(float(s)) * x for s, x in zip(seed, answer, strict=True))

        assert float((T * seed).sum()) == pytest.approx(float(loss(*given)), abs=1e-6)
        differences(pullback(seed), f, loss)


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
