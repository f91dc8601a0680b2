"""Any image of fragments is cut, merged, sorted and checked alike."""

import hypothesis.extra.numpy as hnp
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from test_fragments import assert_same

import moit
from moit import _core
from moit.fragments.ranges import default_range


@st.composite
def images(draw):
    """Small images of either type, with or without color, of any allowed numbers."""
    height, width = draw(st.tuples(st.integers(0, 4), st.integers(0, 4)))
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    counts = draw(hnp.arrays(np.int64, height * width, elements=st.integers(0, 40)))
    n = int(counts.sum())
    bits = np.dtype(dtype).itemsize * 8
    any_real = st.floats(allow_nan=False, allow_infinity=False, width=bits)
    unit = st.floats(0, 1, width=bits)
    color = st.none() | hnp.arrays(dtype, (n, 3), elements=any_real)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        draw(hnp.arrays(dtype, n, elements=any_real)),
        draw(hnp.arrays(dtype, n, elements=unit)),
        draw(color),
        transmission=draw(st.none() | hnp.arrays(dtype, (n, 3), elements=unit)),
        shape=(height, width),
        origin=draw(st.tuples(st.integers(-9, 9), st.integers(-9, 9))),
    )


@given(images(), st.integers(0, 4), st.integers(0, 4))
@settings(max_examples=60)
def test_cutting_and_merging_any_image_gives_it_back(f, y, x):
    parts = [f[:y, :x], f[:y, x:], f[y:, :x], f[y:, x:]]
    m = moit.merge(parts)
    if len(f.offsets) > 1:
        assert_same(m, f)


@given(images(), st.integers(0, 9))
@settings(max_examples=60)
def test_any_order_of_any_image_sorts_to_the_same_depths(f, seed):
    first, second = f.sorted(), f.shuffled(seed).sorted()
    np.testing.assert_array_equal(first.depth, second.depth)
    for p in range(len(f.offsets) - 1):
        part = slice(f.offsets[p], f.offsets[p + 1])
        np.testing.assert_array_equal(first.depth[part], np.sort(f.depth[part]))


@given(images())
@settings(max_examples=60)
def test_any_image_is_the_list_of_its_fragments(f):
    at = np.repeat(np.arange(len(f.offsets) - 1), f.counts)
    g = moit.Fragments.from_pixels(
        at,
        f.depth,
        f.alpha,
        f.color,
        shape=f.shape,
        transmission=f.transmission,
        origin=f.origin,
    )
    assert_same(f, g)


def arrays_with(seed, options, n=70000):
    """Arrays of more fragments than one thread looks at, some opaque ones far away among them."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(2, 5, n)
    alpha = rng.uniform(0, 0.9, n)
    far = rng.choice(n, 5, replace=False)
    alpha[far], depth[far] = 1, 9
    arrays = {"depth": depth, "alpha": alpha, "transmission": None, "back": None}
    if "transmission" in options:
        arrays["transmission"] = rng.random((n, 3)) * (rng.random((n, 1)) < 0.5)
    if "back" in options:
        arrays["back"] = depth + rng.uniform(0, 1, n)
    if "opaque" in options:
        arrays["alpha"] = np.ones(n)
    dtype = np.float32 if "single" in options else np.float64
    held = (None if a is None else a.astype(dtype) for a in arrays.values())
    depth, alpha, transmission, back = held
    return depth, alpha, None, transmission, back, None, None


@pytest.mark.parametrize(
    "options", ["single", "double", "single back", "single transmission", "double opaque"]
)
def test_the_range_that_checks_find_is_that_of_all_numbers(options):
    arrays = arrays_with(1, options)
    offsets = np.array([0, 3, len(arrays[0])])
    span, transparent = default_range(arrays)
    for threads in (1, 3):
        held, fault, found = _core.check_fragments(offsets, *arrays, -np.inf, np.inf, threads)
        assert fault is None and held.tolist() == offsets.tolist()
        if "transmission" in options:  # it takes more than alpha to tell
            assert found is None
        else:
            assert found == (*span, transparent)
    none = [None if a is None else a[:0] for a in arrays]
    assert _core.check_fragments(np.array([0]), *none, 1, 2, 1)[1:] == (None, (1.0, 1.0, False))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_first_of_two_faults_is_found_by_any_threads(dtype):
    arrays = [None if a is None else a.astype(dtype) for a in arrays_with(2, "double back")]
    n = len(arrays[0])
    offsets = np.linspace(0, n, 68000).astype(np.int64)
    for name, at, wrong in [
        (0, n - 1, np.nan),
        (1, 66000, 1.5),
        (4, 65536, np.inf),
        (4, n - 2, 0),
    ]:
        kept = arrays[name][at]
        arrays[name][at] = wrong
        for threads in (1, 2):
            _, fault, span = _core.check_fragments(offsets, *arrays, -np.inf, np.inf, threads)
            assert (fault, span) == ((("depth", "alpha", "", "", "back")[name], at), None)
        arrays[name][at] = kept
    for at in (65536, 67000):  # where a thread's part begins, and within one
        wrong = offsets.copy()
        wrong[at] = wrong[at - 1] - 1
        held, fault, _ = _core.check_fragments(wrong, *arrays, -np.inf, np.inf, 2)
        assert fault == ("offsets", at) and not held.flags.writeable


@pytest.mark.parametrize("pixels", [0, 1, 65535, 65536, 65537, 131072])
def test_offsets_are_copied_whole_and_what_is_held_is_not_copied_again(pixels):
    offsets = np.arange(pixels + 1)
    held = moit.Fragments(offsets, np.ones(pixels), np.zeros(pixels)).offsets
    np.testing.assert_array_equal(held, offsets)
    assert not np.shares_memory(held, offsets)
    again = moit.Fragments(held, np.ones(pixels), np.zeros(pixels)).offsets
    assert np.shares_memory(again, held)
