"""Anchors against their definition told a ray at a time, in any order, and what they prove."""

import dataclasses

import numpy as np
import pytest
from gpu import software_device
from hypothesis import given
from hypothesis import strategies as st

import moit
from moit import Anchors

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
SIZES = [
    Anchors(4, cells=4),
    Anchors(1, cells=1),
    Anchors(3, cells=7, gamma=0.0, key_bits=64),
    Anchors(16, cells=16),
]
of_every_size = pytest.mark.parametrize("technique", SIZES, ids=str)

STEP = 1 / 512  # nepers of a cell
FULL = 7130 * STEP  # of a cell

# Keys, words and cells are whole numbers; what is read from them is rounded some dozen times.
CLOSE = {"float32": 1e-5, "float64": 1e-12}


def is_large(technique):
    return technique.key_bits == 64


def depth_of(word, large):
    """No rounding moves these to other words: of large keys all digits are binary."""
    return word / 65536 if large else word / 65535


def rays(seed, dtype="float64", pixels=60, most=16, words=None, large=False):
    """Depths that are words of the range, for large keys several in a word of 16 bits."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, pixels)
    n = int(counts.sum())
    word = rng.integers(0, 65536, n) if words is None else rng.choice(words, n)
    word = word + rng.integers(0, 3 if words else 256, n) / 256 if large else word
    alpha = rng.uniform(0, 1, n) * rng.choice([0.9, 0.4, 0.02], n)
    alpha = np.where(rng.random(n) < 0.1, 0.0, alpha)
    return moit.Fragments(
        np.append(0, np.cumsum(counts)), depth_of(word, large), alpha, rng.random((n, 3)),
        depth_range=(0, 1), dtype=dtype,
    )  # fmt: skip


def told(technique, word, alpha, asked):
    """T of each fragment, whether it is kept, T in front of words `asked`, and the total."""
    u, most, parts = depth_of(word, is_large(technique)), technique.max_alpha, 1
    if is_large(technique):
        parts = 256  # of a word that keys tell apart
    lower = 1023 - np.rint(1023 * np.sqrt(1 - alpha)).astype(int)
    with np.errstate(divide="ignore"):
        octaves = np.log2(alpha) - technique.gamma * u / np.log(2)
    importance = np.clip(63 + 63 * octaves / 12, 0, 63).astype(int)
    nearness = (parts * 65536 - 1 - word * parts).astype(int)
    key = np.where(lower > 0, (importance * 65536 * parts + nearness) * 1024 + lower, 0)
    held = np.sort(key[key > 0])[::-1][: technique.kept]
    least = held[-1] if len(held) == technique.kept else 0
    kept = (key > 0) & (key >= least)
    of_key = {k: -np.log(max((1 - (k & 1023) / 1023) ** 2, 1 - most)) for k in held}
    digits = parts * 65536 - 1
    at = np.array([(digits - (k >> 10 & digits)) / parts for k in held])
    absorbed = np.array([of_key[k] for k in held])
    covers = alpha > 0
    whole = np.floor(word)
    near, far = (whole[covers].min(), whole[covers].max()) if covers.any() else (0, 0)
    lines = near + np.arange(1, technique.cells) / technique.cells * (far - near + 1)
    # a word at one of these is behind it; lines are passed by whole words
    places = np.concatenate([at, np.ceil(lines - 1e-6)]) - 1e-4
    order = np.argsort(places)
    edges, cuts = places[order], np.concatenate([at, lines])[order]
    cells = np.zeros(len(edges) + 1)
    own = -np.log1p(-np.minimum(alpha, most))

    def steps(a, w):
        a = np.minimum(a, FULL) / STEP
        whole = np.floor(a)
        threshold = (np.floor(w) * 159 + whole * 193) % 256 / 256 + 1 / 512
        return (whole + np.floor(a - whole + threshold)) * STEP

    without_place = np.flatnonzero(key == least)[np.count_nonzero(held == least) :]
    for i in range(len(word)):
        last = i in without_place and least > 0
        if last or not kept[i]:
            a = of_key[least] if last else own[i]
            cells[np.searchsorted(edges, word[i])] += steps(a, word[i])
    assert cells.max(initial=0) < FULL

    def in_front(w, a):
        cell = np.searchsorted(edges, w)
        start, end = max([near, *cuts[:cell]]), min([*cuts[cell:], far + 1])
        share = np.clip((w - start) / max(end - start, 0.5), 0, 1) if a >= 0 else 0
        others = max(cells[cell] - steps(max(a, 0), w), 0)
        inside = share * others / (1 + min(max(a, 0), others) * (1 - share))
        return np.exp(-(absorbed[at < w].sum() + cells[:cell].sum() + inside))

    T = np.array([in_front(w, -1 if k else a) for w, k, a in zip(word, kept, own, strict=True)])
    return T, [in_front(w, 0) for w in asked], np.exp(-(absorbed.sum() + cells.sum()))


def each(f, large=False):
    for start, end in zip(f.offsets, f.offsets[1:], strict=False):
        depth = f.depth[start:end].astype(float)
        word = depth * 65536 if large else np.rint(depth * 65535).astype(int)
        yield slice(start, end), word, f.alpha[start:end].astype(float)


def asked_of(technique, **options):
    return dataclasses.replace(technique, warp="none", **options)


@precisions
@of_every_size
@pytest.mark.parametrize("words", [None, [0, 9, 10, 11, 40000]], ids=["apart", "at few depths"])
def test_transmittance_curve_and_image_are_as_defined(technique, dtype, words):
    technique, large = asked_of(technique), is_large(technique)
    f = rays(1, dtype, words=words, large=large)
    asked = np.array([0, 5, 20000, 65535])
    T = moit.transmittance(f, technique)
    curve = moit.transmittance(f, technique, depth=depth_of(asked, large))[0]
    total = moit.total_transmittance(f, technique)[0]
    image = moit.composite(f, technique, background=(0, 0, 0))[0]
    for p, (own, word, alpha) in enumerate(each(f, large)):
        expected, at, all_ = told(technique, word, alpha, asked)
        assert np.abs(T[own] - expected).max(initial=0) <= CLOSE[dtype]
        assert np.abs(total[p] - all_) <= CLOSE[dtype]
        assert np.abs(curve[p] - at).max() <= CLOSE[dtype]
        weight = alpha * expected
        if weight.sum() > 1e-3:
            color = f.color[own].astype(float)
            color = weight @ color * (1 - all_) / weight.sum()
            assert np.abs(image[p, :3] - color).max() <= 100 * CLOSE[dtype]


@precisions
@given(st.randoms(use_true_random=False), st.sampled_from(SIZES), st.booleans())
def test_any_order_gives_the_same_bits(dtype, random, technique, tied):
    technique = asked_of(technique)
    words = [7, 8, 30000] if tied else None
    f = rays(random.randrange(2**32), dtype, 8, words=words, large=is_large(technique))
    if tied:  # of several with the least key some have no place
        f = moit.Fragments(
            f.offsets, f.depth, np.full(len(f), random.choice([0.3, 0.9])), f.color,
            depth_range=f.depth_range, dtype=dtype,
        )  # fmt: skip
    order = np.concatenate(
        [
            random.sample(range(int(s), int(e)), int(e - s))
            for s, e in zip(f.offsets, f.offsets[1:], strict=False)
        ]
    ).astype(int)
    other = moit.Fragments(
        f.offsets, f.depth[order], f.alpha[order], f.color[order], depth_range=f.depth_range
    )
    T = moit.transmittance(f, technique)
    np.testing.assert_array_equal(moit.transmittance(other, technique), T[order])
    np.testing.assert_array_equal(
        moit.total_transmittance(other, technique), moit.total_transmittance(f, technique)
    )
    depth = [0.0, 0.3, 1.0]
    np.testing.assert_array_equal(
        moit.transmittance(other, technique, depth=depth),
        moit.transmittance(f, technique, depth=depth),
    )


@precisions
def test_as_many_as_are_kept_are_exact_but_for_their_alpha(dtype):
    f = rays(3, dtype, most=4)
    exact, found = (moit.transmittance(f, t) for t in ("sorted", asked_of(Anchors(4))))
    bright = f.alpha < 0.99  # max_alpha, and few steps
    assert np.abs(exact - found)[bright].max() < 4 * 0.5 / 1023 * 2


@precisions
def test_full_cells_are_full_in_any_order(dtype):
    """Fifty fragments of six nepers behind one that is kept, and nothing overflows beyond them."""
    alpha = np.append(np.full(50, 0.9975), [0.9, 0.2])
    depth = np.append(np.linspace(0.5, 0.6, 50), [0.1, 1.0])
    totals = []
    for order in (np.arange(52), np.arange(52)[::-1], np.random.default_rng(1).permutation(52)):
        f = moit.Fragments([0, 52], depth[order], alpha[order], depth_range=(0, 1), dtype=dtype)
        technique = Anchors(1, cells=1, warp="none")
        T = np.empty(52)
        T[order] = moit.transmittance(f, technique)
        totals.append(T)
        assert np.all(T[:-1] > 0)
    np.testing.assert_array_equal(totals[0], totals[1])
    np.testing.assert_array_equal(totals[0], totals[2])
    in_front = -np.log(1 - 0.9) + FULL + np.log(1 - 0.2)  # but itself
    assert -np.log(totals[0][-1]) == pytest.approx(in_front, abs=0.01)


@precisions
@pytest.mark.parametrize("alpha", [1e-4, 5e-4])
def test_many_layers_thinner_than_half_a_step_are_not_lost(dtype, alpha):
    depth = 21 * np.arange(3000) / 65535
    f = moit.Fragments([0, 3000], depth, np.full(3000, alpha), depth_range=(0, 1), dtype=dtype)
    absorbed = -np.log(moit.total_transmittance(f, asked_of(Anchors(4)))[0])
    assert absorbed == pytest.approx(3000 * alpha, rel=0.03)


@pytest.mark.parametrize("technique", SIZES[:3], ids=str)
def test_bounds_hold_hundreds_of_thousands_of_fragments(technique):
    technique, large = asked_of(technique), is_large(technique)
    for seed, words in ((5, None), (6, [0, 9, 10, 11, 40000])):
        f = rays(seed, "float32", pixels=4000, words=words, large=large)
        low, high = moit.bounds(f, technique)
        exact = np.ones(len(f))
        for own, word, alpha in each(f, large):
            front = word[None, :] < word[:, None]
            exact[own] = np.where(front, 1 - alpha, 1).prod(axis=1)
        assert (low <= exact).all() and (exact <= high).all()
        T = moit.transmittance(f, technique)
        assert (low <= T).all() and (T <= high).all()
        assert np.mean(high - low) < 0.5


def test_bounds_close_as_there_are_more_cells():
    f = rays(7, pixels=200)
    widths = [
        np.mean(np.subtract(*moit.bounds(f, asked_of(Anchors(k, c)))[::-1]))
        for k, c in ((1, 1), (4, 4), (16, 16))
    ]
    assert widths[0] > 2 * widths[1] > 4 * widths[2]


@precisions
@pytest.mark.parametrize("kind", [Anchors, moit.Strong])
def test_large_keys_tell_depths_within_a_word_apart(kind, dtype):
    """Four opaque sheets within a word of 16 bits: which is in front is known with 24."""
    depth = (300 + np.array([4, 0, 6, 2]) / 256) / 65536
    f = moit.Fragments([0, 4], depth, np.full(4, 0.5), depth_range=(0, 1), dtype=dtype)
    exact = moit.transmittance(f, "sorted")
    small, large = (moit.transmittance(f, kind(4, warp="none", key_bits=k)) for k in (32, 64))
    np.testing.assert_allclose(large, exact, atol=2e-3)
    assert np.abs(small - exact).max() > 0.3
    with pytest.raises(ValueError, match="key_bits: expected 32, 64, got 48"):
        kind(4, key_bits=48)


def test_nearness_counts_by_gamma():
    """With gamma 0 the most opaque is kept, wherever it is; with more a nearer one."""
    f = moit.Fragments([0, 2], [0.1, 0.9], [0.3, 0.6], depth_range=(0, 1))
    by = {g: moit.transmittance(f, Anchors(1, 1, gamma=g, warp="none")) for g in (0.0, 4.0)}
    assert by[4.0][1] == pytest.approx(0.7, abs=1e-3)  # behind what is kept, exactly
    assert by[0.0][0] == pytest.approx(1, abs=1e-6) and by[0.0][1] == pytest.approx(0.7, abs=1e-3)

    def share(own, other):
        """How much of the other is in front of one that lies half inside their cell."""
        return 0.5 / (1 + 0.5 * min(-np.log(1 - own), -np.log(1 - other)))

    many = moit.Fragments([0, 3], [0.1, 0.5, 0.9], [0.3, 0.3, 0.9], depth_range=(0, 1))
    for gamma, expected in ((0.0, 0.7 ** share(0.3, 0.3)), (4.0, 0.7 * 0.1 ** share(0.3, 0.9))):
        T = moit.transmittance(many, Anchors(1, 1, gamma=gamma, warp="none"))
        assert T[1] == pytest.approx(expected, abs=2e-3)  # it lies half inside its cell


def test_bits_per_pixel():
    assert Anchors(4).bits_per_pixel == 8 * 44
    assert Anchors(4, cells=6).bits_per_pixel == 8 * 36
    assert Anchors(4, cells=7).bits_per_pixel == 8 * 44
    assert Anchors(4, key_bits=64).bits_per_pixel == 8 * 60
    assert Anchors(4).order_independent and not Anchors(4).needs_order
    assert Anchors(4).geometry_passes == 3


@pytest.mark.parametrize("technique", SIZES[:3], ids=str)  # more take a compiler long
def test_passes_give_the_bits_of_the_core(technique):
    device = software_device()
    technique = asked_of(technique)
    for seed, words in ((8, None), (9, [0, 9, 10, 11, 40000])):
        for dtype in ("float32", "float64"):
            f = rays(seed, dtype, words=words, large=is_large(technique))
            found, expected = (
                (
                    moit.transmittance(f, technique, device=where),
                    moit.composite(f, technique, background=(1, 0, 0), device=where),
                    moit.total_transmittance(f, technique, device=where),
                    moit.transmittance(f, technique, depth=[0.2, 0.7], device=where),
                )
                for where in (device, "cpu")
            )
            for ours, cores in zip(found, expected, strict=True):
                np.testing.assert_array_equal(ours, cores)
