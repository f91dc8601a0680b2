"""How volume samples of deep images become fragments: Interpreting OpenEXR Deep Pixels."""

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st

import moit
from moit import _core


def split(front, back, alpha, color=None):
    front = np.array(front, np.float32)
    back = np.maximum(front, np.array(back, np.float32))
    alpha = np.array(alpha, np.float32)
    color = None if color is None else np.array(color, np.float32)
    pieces, _ = moit.Fragments([0, len(front)], front, alpha, color, back=back)._split()
    return pieces.depth, pieces.alpha, pieces.color


def test_volumes_that_nothing_meets_stay_as_they_are():
    alpha = np.array([0.3, 1e-30, 1], np.float32)
    color = [[0.1, 0.2, 0.3], [9, 9, 9], [1e-9, 0, 1]]
    depth, split_alpha, split_color = split([1, 2, 5], [2, 4, 6], alpha, color)
    assert depth.tolist() == [1, 2, 5]
    assert np.array_equal(split_alpha, alpha)
    assert np.array_equal(split_color, np.array(color, np.float32))


def test_surfaces_come_before_what_begins_with_them():
    depth, alpha, _ = split([1, 1, 2, 2], [2, 1, 3, 2], [0.5, 0.1, 0.5, 0.2])
    behind = np.nextafter(np.float32([1, 2]), np.float32(np.inf)).tolist()
    assert depth.tolist() == [1, behind[0], 2, behind[1]]  # depth alone tells what is in front
    np.testing.assert_allclose(alpha, [0.1, 0.5, 0.2, 0.5], rtol=1e-7)


def test_equal_surfaces_are_not_mixed():
    depth, alpha, _ = split([1, 1, 0], [1, 1, 3], [0.1, 0.2, 0.5])
    assert depth.tolist() == [0, 1, 1, np.nextafter(np.float32(1), np.float32(2))]
    assert alpha[1:3].tolist() == [np.float32(0.1), np.float32(0.2)]


def test_opaque_volumes_hide_what_they_coincide_with():
    color = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    _, alpha, mixed = split([1, 1, 1], [2, 2, 2], [1, 0.9, 1], color)
    assert alpha.tolist() == [1] and mixed.tolist() == [[0.5, 0, 0.5]]
    depth, alpha, _ = split([1, 2], [3, 2], [1, 0.5])  # any part of an opaque volume is opaque
    assert np.round(depth, 6).tolist() == [1, 2, 2] and alpha.tolist() == [1, 0.5, 1]


def test_empty_volumes_are_black_where_mixed():
    _, alpha, color = split([1, 1], [2, 2], [0, 0], [[1, 1, 1], [2, 2, 2]])
    assert alpha.tolist() == [0] and color.tolist() == [[0, 0, 0]]


def test_thin_media_lose_no_precision():
    _, alpha, _ = split([0, 1], [4, 1], [4e-20, 0.5])
    # a quarter and three quarters of the absorbance; 1 - (1 - alpha)**x would be 0
    np.testing.assert_allclose(alpha, [1e-20, 0.5, 3e-20], rtol=1e-7)


samples = st.lists(
    st.tuples(st.integers(0, 8), st.integers(-1, 5), st.sampled_from([0, 0.02, 0.3, 0.7, 0.95])),
    min_size=1,
    max_size=9,
)


@given(samples)
def test_pieces_let_as_much_light_through(found):
    front, depth, alpha = np.array(found, np.float32).T
    pieces, split_alpha, _ = split(front, front + depth, alpha)
    if (depth > 0).any():
        assert (np.diff(pieces) >= 0).all()
    # Each of at most 27 alphas is rounded to float32, which moves its factor by 2**-25.
    passed = np.prod(1 - split_alpha.astype(np.float64))
    np.testing.assert_allclose(passed, np.prod(1 - alpha.astype(np.float64)), atol=1e-6)


@given(samples, st.integers(0, 99))
def test_splitting_agrees_with_openimageio(found, seed):
    front, depth, alpha = np.array(found, np.float32).T
    back = np.maximum(front, front + depth)
    color = np.random.default_rng(seed).random((len(front), 3), dtype=np.float32)
    deep = oiio.DeepData()
    deep.init(1, 6, [oiio.FLOAT] * 6, ["R", "G", "B", "A", "Z", "ZBack"])
    deep.set_samples(0, len(front))
    for i in range(len(front)):
        for c, value in enumerate([*color[i] * alpha[i], alpha[i], front[i], back[i]]):
            deep.set_deep_value(0, c, i, float(value))
    for z in np.unique([front, back]):
        deep.split(0, float(z))
    deep.sort(0)
    deep.merge_overlaps(0)
    expected = np.array(
        [[deep.deep_value(0, c, i) for c in range(6)] for i in range(deep.samples(0))]
    )
    tidy = moit.Fragments([0, len(front)], front, alpha, color, back=back).tidy()
    pieces, split_alpha, split_color = tidy.depth, tidy.alpha, tidy.color
    assert np.array_equal(pieces, expected[:, 4])
    assert np.array_equal(tidy.back, expected[:, 5])
    # OpenImageIO mixes samples pair by pair in float32; up to nine coincide.
    np.testing.assert_allclose(split_alpha, expected[:, 3], atol=1e-5)
    np.testing.assert_allclose(split_color * split_alpha[:, None], expected[:, :3], atol=1e-5)


def test_a_mixture_is_what_many_thin_slices_give():
    alpha, color = np.array([0.9, 0.3]), np.array([[1.0, 0, 0], [0, 0, 1.0]])
    _, mixed_alpha, mixed = split([1, 1], [2, 2], alpha, color)
    slices, passed, expected = 20000, 1.0, np.zeros(3)
    thin = 1 - (1 - alpha) ** (1 / slices)
    for _ in range(slices):
        for a, c in zip(thin, color, strict=True):
            expected += passed * a * c
            passed *= 1 - a
    np.testing.assert_allclose(mixed_alpha, 1 - passed, rtol=1e-6)
    np.testing.assert_allclose(mixed[0] * mixed_alpha[0], expected, atol=1e-4)  # 1 / slices


def test_splitting_gives_the_same_bits_on_any_number_of_threads():
    rng = np.random.default_rng(0)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, 6, 5000))])
    n = offsets[-1]
    front = rng.integers(0, 9, n).astype(np.float32)
    back = front + rng.integers(0, 5, n).astype(np.float32)
    alpha, color = rng.random(n, np.float32), rng.random((n, 3), np.float32)
    f = moit.Fragments(offsets, front, alpha, color, back=back, emission=color[::-1])
    cuts = np.array([1.5, 4.25])
    for tidy in (False, True):
        one = _core.split_volumes(f, tidy, cuts, 1)
        for threads in (2, 4):
            several = _core.split_volumes(f, tidy, cuts, threads)
            assert all(np.array_equal(a, b) for a, b in zip(one, several, strict=True))


@pytest.mark.parametrize("depth", ([1, 2, 2, 3], [3, 2, 2, 1], [1, 2, 3, 4], [2, 2, 2, 2]))
def test_surfaces_alone_are_tidy_as_beside_volumes(depth):
    """Pixels without extents take another path, which is to give the same bits."""
    alpha, color = [0.5, 0.7, 0, 0.3], np.full((4, 3), 1.7e308)
    alone = moit.Fragments([0, 4], depth, alpha, color, dtype="float64")
    beside = moit.Fragments(
        [0, 4, 5],
        [*depth, 1],
        [*alpha, 0.5],
        [*color, [0, 0, 0]],
        back=[*depth, 2],
        dtype="float64",
    )
    found, wanted = alone.tidy(), beside.tidy()
    assert len(found) == len(wanted) - 1 == len(set(depth))
    for name in ("depth", "alpha", "color"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name)[:-1])
    assert np.isfinite(found.color).all()
