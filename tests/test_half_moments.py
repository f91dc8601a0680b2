"""Moments in half floats that blending adds up: against sums in NumPy's own, and what they keep of
the same moments in floats."""

import numpy as np
import pytest

import moit
from moit import BoundedNeural, PowerMoments, TwoMoments
from moit.neural.data import drawn

HALVES = [
    TwoMoments(),
    *(
        PowerMoments(m, storage="half", depth_range=r)
        for m in (4, 6, 8)
        for r in ("image", "pixel")
    ),
    BoundedNeural("power4", storage="half"),
    BoundedNeural("power6", storage="half", depth_range="pixel"),
]


def floats_of(technique):
    return type(technique)(**{**vars(technique), "storage": None, "depth_range": "image"})


def ends_in_words(u):
    """A pixel's extent in [0, 1], rounded outwards to 65,535ths."""
    nearest, farthest = np.floor(65535 * u.min()), np.ceil(65535 * u.max())
    nearest = min(nearest, 65534.0)
    return nearest / 65535, max(farthest, nearest + 1) / 65535


@pytest.mark.parametrize("technique", HALVES, ids=str)
def test_sums_are_rounded_to_half_after_each_fragment(technique):
    f = drawn("haze", 4000, seed=3)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, depth_range=f.depth_range, dtype=float)
    b0, b = moit.moments.gather(f, technique)
    m = technique.moment_count
    a = -np.log1p(-np.minimum(f.alpha, technique.max_alpha))
    u = np.log(f.depth / f.depth_range[0]) / np.log(f.depth_range[1] / f.depth_range[0])
    chebyshev = technique.depth_range == "pixel"
    for p in range(len(f.counts)):
        own = slice(f.offsets[p], f.offsets[p + 1])
        if f.counts[p] == 0:
            assert b0[p] == 0 and not b[p].any()
            continue
        ends = ends_in_words(u[own]) if chebyshev else (0, 1)
        z = np.clip(2 * (u[own] - ends[0]) / (ends[1] - ends[0]) - 1, -1, 1)
        k = np.arange(m + 1)[:, None]
        terms = a[own] * (np.cos(k * np.arccos(z)) if chebyshev else z**k)
        held = np.zeros(m + 1)
        for i in range(f.counts[p]):
            held = (held + terms[:, i]).astype(np.float16).astype(float)
        assert b0[p] == held[0]
        mean = np.clip(held[1:] / held[0], -1, 1) if held[0] else np.zeros(m)
        if chebyshev:
            powers = [np.polynomial.chebyshev.poly2cheb([0] * n + [1]) for n in range(1, m + 1)]
            mean = np.array([c @ np.array([1.0, *mean])[: len(c)] for c in powers])
        assert abs(b[p] - mean).max() < 1e-12


@pytest.mark.parametrize("technique", HALVES, ids=str)
def test_order_of_arrival_shows_by_rounding_alone(technique):
    f = drawn("layers", 20_000, seed=5)
    order = np.concatenate(
        [np.arange(e, s, -1) - 1 for s, e in zip(f.offsets[:-1], f.offsets[1:], strict=True)]
    )
    turned = moit.Fragments(
        f.offsets, f.depth[order], f.alpha[order], f.color[order], depth_range=f.depth_range
    )
    one, other = (moit.composite(g, technique) for g in (f, turned))
    spread = np.sqrt(((one - other) ** 2).mean())
    assert 0 < spread < (0.001 if technique.depth_range == "pixel" else 0.01)


@pytest.mark.parametrize("m", [4, 6])
@pytest.mark.parametrize("set_", ["layers", "puffs", "tufts"])
def test_in_the_pixels_extent_halves_lose_next_to_nothing(m, set_):
    f = drawn(set_, 60_000, seed=8)
    exact = moit.composite(f, "sorted")
    kept = BoundedNeural(f"power{m}", storage="half", depth_range="pixel")
    error = {
        t: np.sqrt(((moit.composite(f, t) - exact) ** 2).mean())
        for t in (kept, floats_of(kept), BoundedNeural(f"power{m}", storage="half"))
    }
    assert error[kept] < 1.03 * error[floats_of(kept)]
    assert error[kept] < error[BoundedNeural(f"power{m}", storage="half")]


@pytest.mark.parametrize("storage", [None, "half"])
def test_two_moments_know_what_cantelli_knows(storage):
    """Of a mean m and a variance v, z - m in front of it: at least 1 - v / (v + (z - m)^2)."""
    technique = TwoMoments(storage=storage, exclude_self=False, overestimation=0.0, bias=0.0)
    f = drawn("layers", 5000, seed=2)
    b0, b = (x.astype(float) for x in moit.moments.gather(f, technique))
    z = np.linspace(-1, 1, 41)
    T = moit.moments.transmittance(technique, b0, b, np.tile(z, (len(b0), 1)))
    v = (b[:, 1] - b[:, 0] ** 2)[:, None]
    beside = z - b[:, :1]
    behind = np.where(beside > 0, beside**2 / (v + beside**2), 0.0)
    assert abs(T - np.exp(-b0[:, None] * behind)).max() < 1e-9


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bounds_of_two_moments_hold(dtype):
    f = drawn("veils", 20_000, seed=6)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, depth_range=f.depth_range, dtype=dtype)
    lower, upper = moit.bounds(f, TwoMoments(storage=None))
    exact = moit.transmittance(f, "sorted")
    assert (lower <= exact).all() and (exact <= upper).all()
    by_total, _ = moit.bounds(f, "wavelet8")  # which proves the total alone
    assert (lower - by_total).mean() > 0.01 and (1 - upper).mean() > 0.01


def test_a_lone_surface_is_seen_whole_wherever_it_lies():
    depth = np.concatenate([np.linspace(1, 100, 3000), 1 + 99 * np.arange(64) / 65535])
    n = len(depth)
    f = moit.Fragments(np.arange(n + 1), depth, np.full(n, 0.7), depth_range=(1.0, 100.0))
    for technique in HALVES:
        loss = 0.01 if technique.depth_range == "pixel" or technique.excludes_self else 0.35
        assert (moit.transmittance(f, technique) > 1 - loss).all() or not isinstance(
            technique, BoundedNeural
        )
        assert abs(moit.total_transmittance(f, technique) - 0.3).max() < 1e-3


@pytest.mark.parametrize(
    ("technique", "bytes_"),
    [
        (TwoMoments(), 6),
        (PowerMoments(4, storage="half"), 10),
        (PowerMoments(6, storage="half", depth_range="pixel"), 18),
        (BoundedNeural("power4", storage="half", depth_range="pixel"), 14),
        (BoundedNeural("power6", storage="half", depth_range="pixel"), 18),
    ],
    ids=str,
)
def test_bytes_of_a_pixel_are_those_of_its_targets(technique, bytes_):
    from moit.catalog.targets import targets_of, texel_bytes

    assert technique.bits_per_pixel == 8 * bytes_
    assert sum(texel_bytes(t.format) for t in targets_of(technique).held) == bytes_
    assert not technique.needs_order
    assert moit.technique(str(technique)) == technique


def test_words_are_not_half_floats():
    with pytest.raises(ValueError, match="bits=16 are words"):
        PowerMoments(4, bits=16, storage="half")
    with pytest.raises(ValueError, match="expected 32"):
        TwoMoments(bits=16, storage=None)
    with pytest.raises(ValueError, match="storage"):
        BoundedNeural(storage="words")
