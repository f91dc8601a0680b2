"""The nearest fragments exactly, over moments of all others: against these by themselves."""

import gpu
import numpy as np
import pytest

import moit
from moit import BoundedNeural, FrontLayers, PowerMoments, TrigonometricMoments
from moit.neural.data import drawn

TAILS = ["neural-bounded", "neural-bounded6", "power4", "power8(exclude_self=True)", "trig3"]
by_tail = pytest.mark.parametrize("tail", TAILS)


def rays(name: str, dtype=np.float64, count: int = 6000) -> moit.Fragments:
    f = drawn(name, count, seed=21)
    arrays = (f.offsets, f.depth, f.alpha, f.color)
    return moit.Fragments(*arrays, depth_range=f.depth_range, dtype=dtype)


def ranks(f: moit.Fragments) -> np.ndarray:
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    order = np.lexsort((np.arange(len(f)), f.depth, pixel))
    rank = np.empty(len(f), int)
    rank[order] = np.arange(len(f)) - f.offsets[pixel]
    return rank


def behind(f: moit.Fragments, layers: int) -> tuple[moit.Fragments, np.ndarray]:
    """The fragments that are not among the nearest, and which these are."""
    tail = ranks(f) >= layers
    offsets = np.concatenate([[0], np.cumsum(tail)])[f.offsets]
    arrays = (f.depth[tail], f.alpha[tail], f.color[tail])
    return moit.Fragments(offsets, *arrays, depth_range=f.depth_range, dtype=f.depth.dtype), tail


def through_nearest(f: moit.Fragments, layers: int) -> np.ndarray:
    """Of each pixel."""
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    near = np.log1p(-f.alpha) * (ranks(f) < layers)
    return np.exp(np.bincount(pixel, near, len(f.counts)))


@by_tail
@pytest.mark.parametrize("layers", [1, 2, 5])
def test_what_is_not_kept_is_seen_as_by_itself(tail, layers):
    f = rays("haze")
    T = moit.transmittance(f, FrontLayers(layers, tail=tail))
    others, is_tail = behind(f, layers)
    exact = moit.transmittance(f, "sorted")
    np.testing.assert_allclose(T[~is_tail], exact[~is_tail], rtol=1e-12)
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)[is_tail]
    alone = moit.transmittance(others, tail) * through_nearest(f, layers)[pixel]
    # where few are left, close together, the rounding of all and more bias for it show
    assert np.median(abs(T[is_tail] - alone)) < 1e-7
    assert abs(T[is_tail] - alone).mean() < 2e-3


def test_in_floats_the_tail_is_nearly_that():
    f = rays("puffs", np.float32, 60_000)
    T = moit.transmittance(f, FrontLayers(2, tail="power4"))
    others, is_tail = behind(f, 2)
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)[is_tail]
    alone = moit.transmittance(others, "power4") * through_nearest(f, 2)[pixel]
    assert np.sqrt(((T[is_tail] - alone) ** 2).mean()) < 2e-3


@by_tail
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_up_to_as_many_as_are_kept_all_is_exact(tail, dtype):
    f = rays("surfaces", dtype)
    found = moit.composite(f, FrontLayers(4, tail=tail), background=(0.2, 0.4, 0.8))
    exact = moit.composite(f, "sorted", background=(0.2, 0.4, 0.8))
    np.testing.assert_allclose(found, exact, atol=1e-6 if dtype is np.float32 else 1e-12)


@by_tail
def test_the_nearest_count_as_they_are_and_the_tail_as_it_covers(tail):
    f = rays("veils")
    is_tail = behind(f, 2)[1]
    marked = np.stack([~is_tail, is_tail, is_tail], 1).astype(float)
    g = moit.Fragments(f.offsets, f.depth, f.alpha, marked, depth_range=f.depth_range, dtype=float)
    image = moit.composite(g, FrontLayers(2, tail=tail))[0]
    through, total = through_nearest(f, 2), np.asarray(moit.total_transmittance(f, "sorted"))[0]
    np.testing.assert_allclose(image[:, 0], 1 - through, atol=1e-9)
    np.testing.assert_allclose(image[:, 1], through - total, atol=1e-9)
    raw = moit.composite(g, FrontLayers(2, tail=tail, normalize=False))[0]
    np.testing.assert_allclose(raw[:, 0], 1 - through, atol=1e-9)
    assert abs(raw[:, 1] - (through - total)).max() > 1e-3


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bounds_hold_and_are_exact_of_the_nearest(dtype):
    f = rays("veils", dtype)
    exact = moit.transmittance(f, "sorted")
    lower, upper = moit.bounds(f, "front2")
    assert (lower <= exact).all() and (exact <= upper).all()
    near = ranks(f) < 2
    assert (upper - lower)[near].max() < 1e-6
    assert (upper[~near] < 1).all()
    depths = np.linspace(*f.depth_range, 9)
    lower, upper = moit.bounds(f, "front2", depth=depths)
    curve = moit.transmittance(f, "sorted", depth=depths)
    assert (lower <= curve).all() and (curve <= upper).all()


@pytest.mark.parametrize("technique", ["front2", "front3(key_bits=32,tail='neural-bounded6')"])
def test_bounds_hold_of_what_is_nearer_and_of_what_came_before_at_one_depth(technique):
    f = rays("veils", count=900)
    coarse = np.round(f.depth * 4) / 4
    g = moit.Fragments(
        f.offsets, coarse, f.alpha, f.color, depth_range=(coarse.min(), coarse.max())
    )
    arrived = np.asarray(moit.transmittance(g, "sorted"))
    lower, upper = moit.bounds(g, technique)
    assert (lower <= arrived).all() and (arrived <= upper).all()
    tied = 0
    for own in (slice(*pair) for pair in zip(g.offsets[:-1], g.offsets[1:], strict=True)):
        nearer = g.depth[own][None, :] < g.depth[own][:, None]
        strictly = np.prod(np.where(nearer, 1 - g.alpha[own][None, :], 1), axis=1)
        assert (lower[own] <= strictly * (1 + 1e-12)).all()
        assert (strictly <= upper[own] * (1 + 1e-12)).all()
        tied += len(np.unique(g.depth[own])) < len(g.depth[own])
    assert tied > len(g.offsets) // 4


def test_the_curve_is_what_fragments_see():
    f = rays("layers")
    technique = FrontLayers(2, tail="power4")
    T = moit.transmittance(f, technique)
    for p in range(20):
        own = slice(f.offsets[p], f.offsets[p + 1])
        one = f[0, p]
        curve = moit.transmittance(one, technique, depth=f.depth[own])
        np.testing.assert_allclose(np.ravel(curve), T[own], atol=1e-9)


def in_front_of(tail_alpha: np.ndarray, dtype) -> tuple[moit.Fragments, moit.Fragments]:
    """Two surfaces that let through little in front of others, and the others alone."""
    depth = np.linspace(1.5, 2.5, len(tail_alpha))
    alpha = np.concatenate([[0.998, 0.998], tail_alpha])
    return (
        moit.Fragments(
            [0, len(alpha)], np.append([1.1, 1.2], depth), alpha, depth_range=(1, 3), dtype=dtype
        ),
        moit.Fragments([0, len(depth)], depth, tail_alpha, depth_range=(1, 3), dtype=dtype),
    )


def test_bias_for_what_rounding_leaves_of_a_tail_ends_at_a_fifth():
    """By how many times more all absorb than this tail it would be two and a half."""
    f, others = in_front_of(np.array([8, 1, 4, 2, 9, 1]) * 1e-5, np.float32)
    through = np.prod(1 - f.alpha[:2].astype(float))
    seen = moit.transmittance(f, FrontLayers(2, tail="power8"))[2:] / through
    alone = moit.transmittance(others, PowerMoments(8, bias=0.2))
    np.testing.assert_allclose(seen, alone, atol=1e-5)
    assert np.abs(alone - moit.transmittance(others, PowerMoments(8, bias=0.5))).max() > 2e-5


@pytest.mark.parametrize("dtype, least", [(np.float32, 2.0**-20), (np.float64, 2.0**-43)])
def test_a_tail_that_is_next_to_nothing_of_all_is_none(dtype, least):
    all_absorb = -2 * np.log(1 - 0.998)
    none, some = (
        moit.total_transmittance(in_front_of(np.array([alpha]), dtype)[0], "front2")[0]
        for alpha in (all_absorb * least * 0.5, all_absorb * least * 2)
    )
    through = moit.total_transmittance(in_front_of(np.zeros(1), dtype)[0], "front2")[0]
    assert none == through
    assert some < through


def test_names_and_bytes():
    assert moit.technique("front2").bits_per_pixel == 8 * 44
    assert moit.technique("front") == FrontLayers(2)
    named = moit.technique("front3(tail='power4(exclude_self=True)')")
    assert named == FrontLayers(3, tail=PowerMoments(4, exclude_self=True))
    assert moit.technique(str(named)) == named
    # each pixel's own extent is drawn first
    own = FrontLayers(2, tail=PowerMoments(4, depth_range="pixel"))
    assert own.geometry_passes == named.geometry_passes + 1
    assert FrontLayers(2, tail=TrigonometricMoments(3)).bits_per_pixel == 2 * 64 + 64 + 7 * 32


@pytest.mark.parametrize(
    ("tail", "said"),
    [
        ("wboit", "expected power or trigonometric moments"),
        ("power4-16", "rounded these after each"),
        (BoundedNeural(storage="half"), "rounded these after each"),
        ("power2", "rounded these after each"),
        ("power4(resolution=2)", "a state of each pixel"),
        ("power4(normalize=False)", "no 'normalize' of its own"),
    ],
    ids=str,
)
def test_other_tails_are_refused(tail, said):
    with pytest.raises(ValueError, match=f"tail: .*{said}"):
        FrontLayers(2, tail=tail)


@pytest.mark.parametrize("tail", ["neural-bounded", "power6(exclude_self=True)", "trig3"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_passes_give_the_cores_bits(tail, dtype):
    device = gpu.device()
    f = rays("haze", dtype, 1500)
    technique = FrontLayers(2, tail=tail)
    for question in (moit.transmittance, moit.composite):
        core = question(f, technique)
        assert np.array_equal(core, question(f, technique, device=device))
    asked = np.linspace(*f.depth_range, 5)
    core = moit.transmittance(f, technique, depth=asked)
    assert np.array_equal(core, moit.transmittance(f, technique, depth=asked, device=device))
