"""Fragments hold what they were given, and move it without changing it."""

import array
import copy
import os
import pickle
import re
import sys

import numpy as np
import pytest
from small import out_of_a_message

import moit
from moit import _core
from moit.fragments.squares import squares_of


def random_fragments(seed=0, shape=(5, 7), most=6, dtype=np.float32, **options):
    """Pixels with 0 to `most` fragments and few different depths, so that depths tie."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, shape[0] * shape[1])
    n = counts.sum()
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.integers(1, 9, n).astype(dtype),
        rng.random(n).astype(dtype),
        rng.random((n, 3)).astype(dtype),
        shape=shape,
        **options,
    )


def pixel(f, y, x):
    """The fragments of a pixel as rows of depth, alpha and color."""
    p = y * f.shape[1] + x
    part = slice(f.offsets[p], f.offsets[p + 1])
    return np.column_stack([f.depth[part], f.alpha[part], f.color[part]])


def assert_same(a, b):
    assert (a.shape, a.depth_range, a.origin, a.dtype) == (
        b.shape,
        b.depth_range,
        b.origin,
        b.dtype,
    )
    for name in ("offsets", "depth", "alpha", "color", "transmission"):
        first, second = getattr(a, name), getattr(b, name)
        assert (first is None) == (second is None), name
        if first is not None:
            np.testing.assert_array_equal(first, second, strict=True)


# -- construction --


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_arrays_of_the_right_type_are_not_copied(dtype):
    depth, alpha = np.ones(3, dtype), np.full(3, 0.5, dtype)
    color, transmission = np.ones((3, 3), dtype), np.ones((3, 3), dtype)
    f = moit.Fragments([0, 1, 3], depth, alpha, color, transmission=transmission)
    assert f.dtype == dtype
    for held, given_array in (
        (f.depth, depth),
        (f.alpha, alpha),
        (f.color, color),
        (f.transmission, transmission),
    ):
        assert np.shares_memory(held, given_array)
        assert not held.flags.writeable and given_array.flags.writeable


def test_offsets_are_a_copy_that_cannot_be_changed():
    offsets = np.array([0, 1, 3])
    f = moit.Fragments(offsets, [1, 2, 3], [0.5, 0.5, 0.5])
    offsets[1] = 2**40
    assert f.offsets.tolist() == [0, 1, 3]
    for held in (f.offsets, f.sorted().offsets, _core.frozen(offsets)):
        with pytest.raises(ValueError):
            held.flags.writeable = True


def test_an_array_changed_later_shows_and_sorts_without_harm():
    depth = np.arange(100, dtype=np.float32)
    f = moit.Fragments([0, 100], depth, np.full(100, 0.5, np.float32))
    depth[::3] = np.nan
    depth[::7] = -np.inf
    assert np.isnan(f.depth[3])
    order = f.sorted()
    np.testing.assert_array_equal(np.sort(order.depth), np.sort(depth))  # a permutation still


@pytest.mark.parametrize(
    ("given_type", "held"),
    [
        ("<f4", np.float32),
        (">f4", np.float32),
        ("<f8", np.float64),
        (">f8", np.float64),
        ("f2", np.float32),
        ("g", np.float32),
        ("i1", np.float32),
        ("u8", np.float32),
        ("i8", np.float32),
    ],
)
def test_real_types_become_float32_and_float64_stays(given_type, held):
    values = np.array([0, 1, 1], given_type)
    alpha = values if values.dtype.kind == "f" else [0, 1, 1]  # integers are no opacity
    f = moit.Fragments([0, 3], values, alpha)
    assert f.dtype == held and f.dtype.isnative
    assert f.depth.tolist() == [0, 1, 1]


def test_one_float64_array_makes_all_float64_and_dtype_decides_over_that():
    single, double = np.ones(2, np.float32), np.ones(2)
    assert moit.Fragments([0, 2], single, double).dtype == np.float64
    assert moit.Fragments([0, 2], single, double, dtype="float32").dtype == np.float32
    assert moit.Fragments([0, 2], single, single, dtype=np.float64).dtype == np.float64
    assert moit.Fragments([0, 2], single, single, np.ones((2, 3))).dtype == np.float64


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int32, np.uint64, ">i4", ">u8"])
def test_offsets_of_any_integer_type_become_int64(kind):
    f = moit.Fragments(np.array([0, 1, 3], kind), [1, 2, 3], [0, 0, 0])
    assert f.offsets.dtype == np.int64 and f.counts.tolist() == [1, 2]


def test_memory_in_any_order_gives_the_same_fragments():
    rng = np.random.default_rng(0)
    depth, color = rng.random(6, np.float32), rng.random((6, 3), np.float32)
    straight = moit.Fragments([0, 2, 6], depth, depth, color)
    unaligned = np.zeros(25, np.uint8)[1:].view(np.float32)
    unaligned[:] = depth
    read_only = depth.copy()
    read_only.flags.writeable = False
    others = [
        (np.repeat(depth, 2)[::2], np.asfortranarray(color)),
        (depth[::-1].copy()[::-1], color[:, ::-1].copy()[:, ::-1]),
        (unaligned, np.repeat(color, 2, axis=1)[:, ::2]),
        (depth.astype(">f4"), color.astype(">f4")),
        (read_only, color.view(np.recarray)),
        (memoryview(depth), memoryview(color)),
        (array.array("f", depth), color.tolist()),
        (depth.tolist(), color),
    ]
    for z, c in others:
        f = moit.Fragments([0, 2, 6], z, depth, c, dtype=np.float32)
        assert_same(f, straight)
        assert f.depth.flags.c_contiguous and f.depth.flags.aligned


class WithArray:
    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return self.values


class WithDlpack:
    def __init__(self, values, device=None):
        self.values, self.device = values, device

    def __dlpack__(self, **options):
        assert self.device is None, "must not be asked for data of another device"
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.device or self.values.__dlpack_device__()


@pytest.mark.parametrize("wrapped", [WithArray, WithDlpack, memoryview])
def test_other_libraries_arrays_are_taken_without_a_copy(wrapped):
    depth = np.ones(2, np.float32)
    f = moit.Fragments([0, 2], wrapped(depth), wrapped(depth))
    assert np.shares_memory(f.depth, depth)


def test_shape_is_one_row_by_default():
    assert moit.Fragments([0, 1, 1, 1], [1], [1]).shape == (1, 3)


def test_nothing_is_a_valid_image():
    no_pixels = moit.Fragments([0], [], [])
    assert len(no_pixels) == 0 and no_pixels.shape == (1, 0)
    assert no_pixels.depth_range == (1.0, 1.0) and no_pixels.counts.tolist() == []
    no_fragments = moit.Fragments([0, 0, 0], [], [], np.zeros((0, 3)), shape=(2, 1))
    assert no_fragments.depth_range == (1.0, 1.0) and no_fragments.counts.tolist() == [0, 0]
    for f in (no_pixels, no_fragments, moit.Fragments([0], [], [], shape=(0, 9))):
        assert len(f.sorted()) == len(f.shuffled(0)) == len(f[:, :]) == len(moit.merge([f])) == 0
        assert repr(f).count("\n") == 0


def test_extreme_numbers_that_are_allowed_are_kept():
    most = np.finfo(np.float32).max
    f = moit.Fragments(
        [0, 3],
        np.array([-most, most, 0], np.float32),
        np.array([-0.0, 1.0, 1e-45], np.float32),
        np.array([[most, -most, 0]] * 3, np.float32),
    )
    assert f.depth.tolist() == [-most, most, 0]
    assert f.depth_range == (-float(most), 0)  # the second is opaque
    assert f.alpha[2] > 0


def test_range_is_that_of_the_depths_unless_given():
    assert moit.Fragments([0, 2], [3, -1], [0, 0]).depth_range == (-1.0, 3.0)
    assert moit.Fragments([0, 2], [3, -1], [0, 0], depth_range=[-2, 8]).depth_range == (-2.0, 8.0)
    assert moit.Fragments([0], [], [], depth_range=np.array([2, 5])).depth_range == (2.0, 5.0)


def test_a_range_is_compared_in_the_type_held():
    # 0.3 rounds up and 0.1 rounds up: the first depth lies beyond 0.3, if not in float32.
    depth = np.array([0.3, 0.1], np.float32)
    assert float(depth[0]) > 0.3
    f = moit.Fragments([0, 2], depth, depth, depth_range=(0.1, 0.3))
    assert f.depth_range == (0.1, 0.3)
    with pytest.raises(moit.FragmentsError):
        moit.Fragments([0, 2], depth, depth, depth_range=(0.1, 0.3), dtype=np.float64)
    colored = moit.Fragments([0, 2], depth, depth, np.eye(2, 3), depth_range=(0.1, 0.3), dtype="f4")
    for technique in ("sorted", "power4", "per-pixel"):
        asked = moit.composite(colored, technique, dtype=np.float64)
        np.testing.assert_allclose(asked, moit.composite(colored, technique), atol=1e-3)


def test_ten_million_fragments_are_taken_as_they_are():
    n = 10_000_000
    depth, alpha = np.ones(n, np.float32), np.full(n, 0.5, np.float32)
    f = moit.Fragments(np.arange(0, n + 1, 10), depth, alpha)
    assert np.shares_memory(f.depth, depth) and len(f) == n
    alpha[-1] = 1.5
    with pytest.raises(moit.FragmentsError, match=r"alpha\[9999999\]: found 1.5"):
        moit.Fragments(f.offsets, depth, alpha)


# -- from other layouts --


def test_fragments_from_pixels_keep_their_order():
    rng = np.random.default_rng(0)
    at, depth = rng.integers(0, 12, 50), rng.random(50)
    f = moit.Fragments.from_pixels(at, depth, depth, np.ones((50, 3)), shape=(3, 4))
    for p in range(12):
        part = slice(f.offsets[p], f.offsets[p + 1])
        assert f.depth[part].tolist() == depth[at == p].tolist()


def test_fragments_from_pixels_undo_any_order_of_arrival_between_pixels():
    f = random_fragments(transmission=None)
    at = np.repeat(np.arange(35), f.counts)
    mixed = np.lexsort((at * 7919 % 35,))  # another order of pixels, each pixel's own kept
    g = moit.Fragments.from_pixels(
        at[mixed], f.depth[mixed], f.alpha[mixed], f.color[mixed], shape=f.shape
    )
    assert_same(f, g)


def test_fragments_from_pixels_may_be_none():
    f = moit.Fragments.from_pixels([], [], [], shape=(3, 4))
    assert f.shape == (3, 4) and f.counts.tolist() == [0] * 12


def test_layers_skip_empty_slots_whatever_they_hold():
    depth = np.array([[[5, np.inf]], [[np.nan, 7]], [[4, 6]]])
    alpha = np.array([[[0.5, 0]], [[-0.0, 0.25]], [[1, 0.75]]])
    color = np.where(alpha[..., None] == 0, np.nan, [1, 2, 3])
    f = moit.Fragments.from_layers(depth, alpha, color)
    assert f.shape == (1, 2) and f.offsets.tolist() == [0, 2, 4]
    assert f.depth.tolist() == [5, 4, 7, 6] and f.alpha.tolist() == [0.5, 1, 0.25, 0.75]
    assert f.depth_range == (5.0, 7.0)  # without what is opaque


@pytest.mark.parametrize("shape", [(0, 2, 3), (2, 0, 3), (2, 3, 0), (1, 1, 1)])
def test_layers_may_be_empty(shape):
    f = moit.Fragments.from_layers(np.ones(shape), np.zeros(shape), np.ones((*shape, 3)))
    assert f.shape == shape[1:] and len(f) == 0


# -- parts and orders --


@pytest.mark.parametrize("rows", [slice(None), slice(1, 4), slice(-2, None), slice(4, 2), 3, -1])
@pytest.mark.parametrize("columns", [slice(None), slice(2, 5), slice(-3, 99), slice(0, 0), 0, -7])
def test_a_window_holds_what_was_there(rows, columns):
    f = random_fragments(origin=(10, -20))
    grid = np.arange(35).reshape(5, 7)
    wanted = np.atleast_2d(grid[rows, columns])
    if isinstance(columns, int) and not isinstance(rows, int):
        wanted = wanted.T
    g = f[rows, columns]
    assert g.shape == wanted.shape
    assert g.depth_range == f.depth_range
    for (y, x), p in np.ndenumerate(wanted):
        np.testing.assert_array_equal(pixel(g, y, x), pixel(f, p // 7, p % 7))
    if wanted.size:
        y, x = divmod(int(wanted[0, 0]), 7)
        assert g.origin == (10 + y, -20 + x)


def test_whole_rows_are_not_copied():
    f = random_fragments()
    assert np.shares_memory(f[1:3, :].color, f.color)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("most", [1, 6, 30, 200])
def test_sorting_is_stable_and_changes_nothing_else(dtype, most):
    f = random_fragments(most=most, dtype=dtype, origin=(1, 2), depth_range=(0, 20))
    g = f.sorted()
    order = np.lexsort((np.arange(len(f)), f.depth, np.repeat(np.arange(35), f.counts)))
    wanted = moit.Fragments(
        f.offsets,
        f.depth[order],
        f.alpha[order],
        f.color[order],
        shape=f.shape,
        depth_range=f.depth_range,
        origin=f.origin,
    )
    assert_same(g, wanted)


def test_long_pixels_sort_as_numpy_does():
    depth = np.random.default_rng(0).integers(0, 1000, 100_003).astype(np.float32)
    index = np.arange(len(depth)) / 2**17  # exact
    g = moit.Fragments([0, len(depth)], depth, index).sorted()
    np.testing.assert_array_equal(g.alpha * 2**17, np.argsort(depth, kind="stable"))


@pytest.mark.parametrize("threads", ["1", "2", "5"])
def test_threads_do_not_change_an_order(threads, monkeypatch):
    f = random_fragments(shape=(100, 100))
    monkeypatch.setenv("MOIT_THREADS", "3")
    wanted = f.sorted()
    monkeypatch.setenv("MOIT_THREADS", threads)
    assert_same(f.sorted(), wanted)


def test_shuffling_moves_fragments_within_their_pixel_only():
    f = random_fragments(most=20)
    g = f.shuffled(3)
    assert not np.array_equal(g.alpha, f.alpha)
    assert_same(g, f.shuffled(3))
    assert not np.array_equal(g.alpha, f.shuffled(4).alpha)
    for y, x in np.ndindex(f.shape):
        rows, shuffled = pixel(f, y, x).tolist(), pixel(g, y, x).tolist()
        assert sorted(rows) == sorted(shuffled)
    assert g.depth_range == f.depth_range and g.shape == f.shape


def test_every_arrangement_is_equally_likely_when_shuffled():
    n = 6000
    f = moit.Fragments(np.arange(0, 3 * n + 1, 3), np.tile([1.0, 2.0, 3.0], n), np.zeros(3 * n))
    rows = f.shuffled(0).depth.reshape(n, 3)
    _, counts = np.unique(rows, axis=0, return_counts=True)
    assert len(counts) == 6
    assert abs(counts - n / 6).max() < 5 * np.sqrt(n / 6)  # five standard deviations


# -- merging --


def test_merging_the_parts_gives_the_whole():
    f = random_fragments(origin=(3, -4))
    parts = [f[:2, :3], f[2:, :3], f[:2, 3:], f[2:, 3:]]
    assert_same(moit.merge(parts), f)
    assert_same(moit.merge(reversed(parts)), f)
    assert_same(moit.merge([f]), f)


def test_merged_pixels_hold_the_first_ones_fragments_first():
    f, g = random_fragments(1), random_fragments(2, shape=(4, 4), origin=(3, 5))
    m = moit.merge([f, g])
    assert m.shape == (7, 9) and m.origin == (0, 0)
    none = np.zeros((0, 5))
    for y, x in np.ndindex(m.shape):
        first = pixel(f, y, x) if y < 5 and x < 7 else none
        second = pixel(g, y - 3, x - 5) if y >= 3 and x >= 5 else none
        np.testing.assert_array_equal(pixel(m, y, x), np.concatenate([first, second]))


def test_merging_takes_the_union_of_ranges():
    near, far = (moit.Fragments([0, 1], [z], [0.5]) for z in (2, 9))
    wide = moit.Fragments([0, 1], [5], [0.5], depth_range=(3, 50))
    assert moit.merge([near, far]).depth_range == (2.0, 9.0)
    assert moit.merge([near, wide]).depth_range == (2.0, 50.0)
    empty = moit.Fragments([0, 0], [], [])
    assert moit.merge([near, empty]).depth_range == (2.0, 2.0)
    assert moit.merge([empty, empty]).depth_range == (1.0, 1.0)
    ranged = moit.Fragments([0, 0], [], [], depth_range=(0.5, 20))  # a range of its own
    assert moit.merge([near, ranged]).depth_range == (0.5, 20.0)
    assert moit.merge([ranged, empty]).depth_range == (0.5, 20.0)


def test_merging_types_keeps_every_depth_in_range():
    single = moit.Fragments([0, 1], np.float32([0.3]), np.float32([0.5]), depth_range=(0.1, 0.3))
    double = moit.Fragments([0, 1], [0.2], [0.5])
    m = moit.merge([single, double])
    assert m.dtype == np.float64
    near, far = m.depth_range
    assert near <= m.depth.min() and m.depth.max() <= far
    assert_same(pickle.loads(pickle.dumps(m)), m)  # and so passes the check again


def test_transmission_that_some_lack_is_black_there():
    plain = moit.Fragments([0, 1], [1], [0.5])
    coloured = moit.Fragments([0, 1], [2], [0.5], transmission=[[0.25, 0.5, 1]])
    m = moit.merge([plain, coloured])
    assert m.transmission.tolist() == [[0, 0, 0], [0.25, 0.5, 1]]


def test_what_has_no_pixels_does_not_widen_the_window():
    f = random_fragments()
    assert_same(moit.merge([f, f[:0, :]]), f)
    far = moit.Fragments([0], [], [], np.zeros((0, 3)), shape=(0, 3), origin=(2**30, 2**30))
    assert moit.merge([far, f]).shape == f.shape


# -- objects --


def test_fragments_do_not_change():
    f = random_fragments()
    for name in ("depth", "offsets", "shape", "anything"):
        with pytest.raises(AttributeError, match=name):
            setattr(f, name, 1)
    with pytest.raises(AttributeError):
        del f.depth
    with pytest.raises(ValueError):
        f.depth[0] = 1


def test_fragments_compare_by_identity():
    f = random_fragments()
    assert f == f and f != random_fragments() and len({f, f}) == 1


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda f: pickle.loads(pickle.dumps(f))]
)
def test_copies_hold_the_same(copied):
    f = random_fragments(origin=(1, -2), depth_range=(0, 99))
    assert_same(copied(f), f)


@pytest.mark.parametrize("by", [1, 4])
def test_a_pickle_whose_arrays_begin_anywhere_is_read(by):
    f = random_fragments()
    assert_same(out_of_a_message(f, by), f)


def test_a_deep_copy_does_not_follow_the_callers_array():
    depth = np.ones(1, np.float32)
    f = moit.Fragments([0, 1], depth, depth)
    g = copy.deepcopy(f)
    depth[0] = 0.5
    assert f.depth[0] == 0.5 and g.depth[0] == 1


def test_pickles_keep_a_subclass():
    assert type(pickle.loads(pickle.dumps(Special([0], [], [])))) is Special


class Special(moit.Fragments):
    pass


def test_repr_is_one_line_of_facts():
    f = moit.Fragments(
        [0, 2, 2, 3],
        np.float32([72.1, 954, 80]),
        np.float32([1, 1, 1]),
        np.zeros((3, 3), np.float32),
        shape=(3, 1),
    )
    assert repr(f) == (
        "Fragments(3x1, 3 fragments, at most 2 a pixel, float32, depth 72.1 to 954, color)"
    )
    assert "origin (2, -3)" in repr(random_fragments(origin=(2, -3)))


def test_no_reference_is_lost():
    depth = np.ones(3, np.float32)
    before = sys.getrefcount(depth)
    for _ in range(100):
        moit.Fragments([0, 3], depth, depth).sorted()
        with pytest.raises(moit.FragmentsError):
            moit.Fragments([0, 4], depth, depth)
    assert sys.getrefcount(depth) == before


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (300, 2), (1, 5000), (200, 200)])
@pytest.mark.parametrize("kind", ["color", "transmission", "alpha only"])
def test_notebooks_show_a_small_page(shape, kind):
    f = random_fragments(shape=shape)
    rng = np.random.default_rng(0)
    f = moit.Fragments(
        f.offsets,
        f.depth,
        f.alpha,
        f.color if kind == "color" else None,
        transmission=rng.random((len(f), 3)) if kind == "transmission" else None,
        shape=shape,
    )
    page = f._repr_html_()
    assert len(page) < 100_000
    assert "<svg" in page
    assert "data:image/png;base64," in page
    assert ("exact composite" in page) == (kind == "color")


@pytest.mark.parametrize("most", [0, 39, 40, 41, 400])
def test_bars_of_counts_are_no_more_than_have_room_and_end_with_the_most(most):
    counts = np.array([0, 0, most])
    f = moit.Fragments(np.cumsum([0, *counts]), np.ones(most), np.full(most, 0.5))
    said = re.findall(r"<title>(\d+)(?: to (\d+))? fragments: (\d) pixels", f._repr_html_())
    assert len(said) == min(most + 1, -(-(most + 1) // -(-(most + 1) // 40))) <= 40
    assert int(said[0][0]) == 0 and int(said[-1][1] or said[-1][0]) == most
    assert int(said[0][2]) == (3 if most == 0 else 2) and sum(int(one[2]) for one in said) == 3


def test_notebooks_show_fragments_without_pixels():
    assert "0 fragments" in moit.Fragments([0], [], [])._repr_html_()


# -- files --


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_files_give_back_what_was_saved(tmp_path, dtype):
    f = random_fragments(dtype=dtype, origin=(7, -8), depth_range=(0.5, 1e3))
    path = tmp_path / "fragments.npz"
    moit.save(path, f)
    assert_same(moit.load(path), f)
    uncoloured = moit.Fragments(f.offsets, f.depth, f.alpha, transmission=f.color, shape=f.shape)
    moit.save(str(path), uncoloured)
    assert_same(moit.load(os.fsencode(path)), uncoloured)
    assert os.listdir(tmp_path) == ["fragments.npz"]  # nothing else is left


def test_compressed_files_are_read(tmp_path):
    f = random_fragments()
    moit.save(tmp_path / "a.npz", f)
    with np.load(tmp_path / "a.npz") as members:
        np.savez_compressed(tmp_path / "b.npz", **members)
    assert_same(moit.load(tmp_path / "b.npz"), f)


def test_a_failed_save_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "fragments.npz"
    f = random_fragments()
    moit.save(path, f)

    def fail_midway(file, **arrays):
        file.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez", fail_midway)
    with pytest.raises(OSError, match="disk full"):
        moit.save(path, random_fragments(1))
    assert_same(moit.load(path), f)
    assert os.listdir(tmp_path) == ["fragments.npz"]


def test_saving_follows_a_link(tmp_path):
    (tmp_path / "link.npz").symlink_to(tmp_path / "real.npz")
    moit.save(tmp_path / "link.npz", random_fragments())
    assert (tmp_path / "link.npz").is_symlink() and (tmp_path / "real.npz").is_file()


# -- squares --


def test_squares_of_an_image_begin_at_multiples_in_its_display():
    found = squares_of(random_fragments(origin=(7, -8)), 5)
    assert (found.top, found.left) == (2, 2)
    found = squares_of(random_fragments(origin=(3, 4)), 8)
    assert (found.top, found.left) == (3, 4)
