"""What cannot be fragments is refused with words: which argument, where, what was found and what
was needed. Nothing crashes and nothing is repaired."""

import io
import os
import zipfile
from types import SimpleNamespace

import hypothesis.extra.numpy as hnp
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

import moit
from moit import _core
from moit.checks.exceptions import FragmentsTypeError

GOOD = {
    "offsets": np.array([0, 2, 2, 3]),
    "depth": np.array([1, 2, 3], np.float32),
    "alpha": np.array([0, 0.5, 1], np.float32),
    "color": np.ones((3, 3), np.float32),
    "transmission": np.ones((3, 3), np.float32),
}
NAN, INF = np.nan, np.inf


def build(**changed):
    return moit.Fragments(**{**GOOD, **changed})


def test_the_good_arguments_are_good():
    assert len(build()) == 3


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ([1, 2, 2, 3], r"offsets\[0\]: found 1; needed 0"),
        ([-1, 2, 2, 3], r"offsets\[0\]: found -1; needed 0"),
        ([0, 2, 1, 3], r"offsets\[2\]: found 1; needed at least offsets\[1\] = 2"),
        ([0, 9, 1, 3], r"offsets\[2\]: found 1; needed at least offsets\[1\] = 9"),
        ([0, 2, 2, 2], r"offsets\[3\]: found 2; needed the number of fragments, .* = 3"),
        ([0, 2, 2, 4], r"offsets\[3\]: found 4; needed the number of fragments, .* = 3"),
        ([0, 2, 2, 2**31], r"offsets\[3\]: found 2147483648; needed the number"),
        ([0, 2, 2, 2**62], r"offsets\[3\]: found 4611686018427387904; needed the number"),
        ([0, 2**63 - 1, -(2**63), 3], r"offsets\[2\]: found -9223372036854775808"),
        (np.array([0, 2, 2**63, 3], np.uint64), r"offsets\[2\]: found 9223372036854775808"),
        (np.array([0, 2, 2**64 - 1, 3], np.uint64), r"offsets\[2\]: found 18446744073709551615"),
        ([0, 2, 2, 2**70], r"offsets: expected integers, got object"),
        ([0.0, 2.0, 2.0, 3.0], r"offsets: expected integers, got float64"),
        ([], r"offsets: expected \(P\+1,\) with P >= 0, got \(0,\)"),
        (np.zeros(0), r"offsets: expected integers, got float64"),
        (np.zeros(0, int), r"offsets: expected \(P\+1,\) with P >= 0, got \(0,\)"),
        (3, r"offsets: expected \(P\+1,\) with P >= 0, got \(\)"),
        ([[0, 3]], r"offsets: expected \(P\+1,\) with P >= 0, got \(1, 2\)"),
        (None, r"offsets: expected integers, got object"),
        ([False, True], r"offsets: expected integers, got bool"),
    ],
)
def test_bad_offsets_are_named(offsets, message):
    with pytest.raises(moit.FragmentsError, match=message):
        build(offsets=offsets)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("name", "bad", "needed"),
    [
        ("depth", NAN, "a finite float"),
        ("depth", INF, "a finite float"),
        ("depth", -INF, "a finite float"),
        ("alpha", NAN, r"a number in \[0, 1\]"),
        ("alpha", 1.0000001192092896, r"a number in \[0, 1\]"),
        ("alpha", -1e-30, r"a number in \[0, 1\]"),
        ("alpha", INF, r"a number in \[0, 1\]"),
        ("color", NAN, "a finite float"),
        ("color", -INF, "a finite float"),
        ("transmission", NAN, r"a number in \[0, 1\]"),
        ("transmission", 2, r"a number in \[0, 1\]"),
        ("transmission", -0.25, r"a number in \[0, 1\]"),
    ],
)
def test_the_first_bad_number_is_named(dtype, name, bad, needed):
    n = 5003  # several blocks of the search, the last one short
    f = {
        "offsets": [0, n],
        "depth": np.ones(n, dtype),
        "alpha": np.ones(n, dtype),
        "color": np.ones((n, 3), dtype),
        "transmission": np.ones((n, 3), dtype),
    }
    for first in (0, 2047, 2048, n - 1):
        array = f[name].copy()
        array[first:] = bad if array.ndim == 1 else [0.5, bad, bad]
        place = rf"{name}\[{first}\]" if array.ndim == 1 else rf"{name}\[{first}, 1\]"
        with pytest.raises(moit.FragmentsError, match=f"^{place}: found .*; needed {needed}"):
            moit.Fragments(**{**f, name: array})


@pytest.mark.parametrize("name", ["color", "transmission"])
@pytest.mark.parametrize("shape", [(3, 4), (3, 2), (4, 3), (3,), (3, 3, 1)])
def test_the_core_looks_at_shapes_itself(name, shape):
    """Whatever it is given instead of Fragments."""
    f = moit.Fragments(**GOOD)
    names = (*GOOD, "back", "emission", "deviation", "shape", "depth_range", "origin")
    given = {one: getattr(f, one) for one in names}
    fields = moit.technique("sorted").fields_for(f)
    _core.composite(SimpleNamespace(**given), fields, True, 1, np.zeros(3))
    wrong = given | {name: np.zeros(shape, np.float32)}
    with pytest.raises(TypeError, match="do not have the types and shapes of Fragments"):
        _core.composite(SimpleNamespace(**wrong), fields, True, 1, np.zeros(3))


def test_what_overflows_the_type_held_is_not_finite():
    with pytest.raises(moit.FragmentsError, match=r"depth\[1\]: found inf; .* finite float32"):
        build(depth=[0, 1e300, 0], dtype=np.float32)


@pytest.mark.parametrize("name", ["depth", "alpha", "color", "transmission"])
@pytest.mark.parametrize(
    "values",
    [
        np.ones(3, bool),
        np.ones(3, complex),
        np.ones(3, object),
        np.array(["1", "2", "3"]),
        np.array([b"1", b"2", b"3"]),
        np.ones(3, "M8[s]"),
        np.ones(3, "m8[s]"),
        np.zeros(3, [("z", "f4")]),
        "depth",
        b"\x00" * 12,
        object(),
        {1: 2},
        [[1], [1, 2]],
        [2**70, 1, 1],
        iter([1, 2, 3]),
        np.ma.masked_array([1.0, 2.0, 3.0], [0, 1, 0]),
        np.ma.masked_array([1.0, 2.0, 3.0]),
    ],
    ids=lambda v: f"{type(v).__name__}-{getattr(v, 'dtype', '')}",
)
def test_types_that_are_not_real_numbers_are_refused(name, values):
    with pytest.raises(moit.FragmentsError, match=f"^{name}: expected .*, got ") as caught:
        build(**{name: values})
    assert isinstance(caught.value, TypeError)


def test_a_mask_is_not_dropped_silently():
    with pytest.raises(TypeError, match=r"filled"):
        build(depth=np.ma.masked_less(np.array([1.0, 2.0, 3.0]), 2))


@pytest.mark.parametrize("name", ["depth", "alpha"])
def test_depth_and_alpha_are_needed(name):
    with pytest.raises(TypeError, match=name):
        build(**{name: None})


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("depth", ()),
        ("depth", (3, 1)),
        ("alpha", ()),
        ("alpha", (2,)),
        ("alpha", (4,)),
        ("alpha", (1, 3)),
        ("color", ()),
        ("color", (3,)),
        ("color", (3, 4)),
        ("color", (2, 3)),
        ("color", (3, 3, 1)),
        ("transmission", (9,)),
        ("transmission", (1, 3)),
    ],
)
def test_shapes_that_do_not_fit_are_named(name, shape):
    with pytest.raises(moit.FragmentsError, match=rf"^{name}: .*") as caught:
        build(**{name: np.ones(shape, np.float32)})
    assert str(shape) in str(caught.value)


@pytest.mark.parametrize(
    "shape",
    [
        (1, 4),
        (2, 2),
        (3,),
        (3, 1, 1),
        3,
        "31",
        (-1, -3),
        (1.0, 3.0),
        (True, 3),
        (None, 3),
        (2**62, 2**62),
        (2**31, 0),
        (2**70, 0),
        [[1], [3]],
        np.array([[1, 3]]),
        object(),
    ],
)
def test_bad_shapes_are_named(shape):
    with pytest.raises(moit.FragmentsError, match=r"^shape: "):
        build(shape=shape)


@pytest.mark.parametrize("origin", [(1,), 5, (0.5, 1), ("1", 2), (2**31, 0), (0, -(2**40)), None])
def test_bad_origins_are_named(origin):
    with pytest.raises(moit.FragmentsError, match=r"^origin: "):
        build(origin=origin)


@pytest.mark.parametrize(
    "depth_range",
    [
        (3, 1),
        (NAN, 3),
        (1, NAN),
        (-INF, 3),
        (1, INF),
        5,
        (1, 2, 3),
        "13",
        (None, 3),
        (1j, 3),
        (1, 10**400),
        (True, False),
        {"near": 1},
        ("1", "3"),
    ],
)
def test_bad_ranges_are_named(depth_range):
    with pytest.raises(moit.FragmentsError, match=r"^depth_range: "):
        build(depth_range=depth_range)


@pytest.mark.parametrize(("depth_range", "index"), [((1.5, 9), 0), ((0, 1.5), 1), ((7, 7), 0)])
def test_fragments_outside_the_range_are_named(depth_range, index):
    message = rf"depth\[{index}\]: found {index + 1}.0; needed a depth within depth_range"
    with pytest.raises(moit.FragmentsError, match=message):
        build(depth_range=depth_range)


@pytest.mark.parametrize(
    "dtype", ["f2", "i4", bool, complex, object, "U3", "nonsense", 7, np.int64]
)
def test_only_two_types_may_be_held(dtype):
    with pytest.raises(FragmentsTypeError, match=r"^dtype: expected float32, float64 or None"):
        build(dtype=dtype)


class OnTheGpu:
    def __dlpack_device__(self):
        return (2, 0)

    def __dlpack__(self, **options):
        raise AssertionError("must not be asked")

    def __array__(self, dtype=None, copy=None):
        raise AssertionError("must not be asked")


class Raising:
    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("requires grad")


def test_memory_of_a_gpu_is_refused_with_a_hint():
    with pytest.raises(TypeError, match=r"^depth: .* on another device; .*\.cpu\(\)"):
        build(depth=OnTheGpu())


def test_what_another_library_raises_is_told():
    with pytest.raises(moit.FragmentsError, match=r"^color: .*requires grad"):
        build(color=Raising())


# -- other constructors --


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        ([0, 6, 1], r"pixel\[1\]: found 6; needed at least 0 and below 2 x 3 = 6"),
        ([0, 1, -1], r"pixel\[2\]: found -1"),
        ([0, 1, 2**62], r"pixel\[2\]: found 4611686018427387904"),
        (np.array([0, 1, 2**64 - 1], np.uint64), r"pixel\[2\]: found 18446744073709551615"),
        ([0, 1], r"pixel: with depth of shape \(3,\), .* got \(2,\)"),
        ([[0], [1], [2]], r"pixel: .* got \(3, 1\)"),
        ([0.0, 1.0, 2.0], r"pixel: expected integers, got float64"),
        (None, r"pixel: expected integers"),
    ],
)
def test_bad_pixels_are_named(pixel, message):
    with pytest.raises(moit.FragmentsError, match=message):
        moit.Fragments.from_pixels(pixel, [1, 2, 3], [0, 0, 0], shape=(2, 3))


def test_messages_give_the_index_in_the_callers_list():
    alpha = [0.5, 0.5, 2.0, 0.5]  # the third given, the first when grouped by pixel
    with pytest.raises(moit.FragmentsError, match=r"alpha\[2\]: found 2.0"):
        moit.Fragments.from_pixels([3, 2, 0, 1], np.ones(4), alpha, shape=(2, 2))
    color = np.ones((4, 3))
    color[2, 1] = NAN
    with pytest.raises(moit.FragmentsError, match=r"color\[2, 1\]: found nan"):
        moit.Fragments.from_pixels([3, 2, 0, 1], np.ones(4), np.ones(4), color, shape=(2, 2))


def test_an_image_beyond_all_memory_is_refused():
    with pytest.raises(moit.FragmentsError, match=r"^shape: expected at most"):
        moit.Fragments.from_pixels([], [], [], shape=(2**31 - 1, 2**31 - 1))


@pytest.mark.parametrize(
    ("depth", "alpha", "message"),
    [
        (np.ones((2, 3)), np.ones((2, 3)), r"depth: expected \(K, height, width\), got \(2, 3\)"),
        (np.ones((2, 3, 1)), np.ones((2, 1, 3)), r"alpha: with depth of shape \(2, 3, 1\)"),
        (np.ones((2, 1, 2)), [[[0, 1]], [[1, NAN]]], r"alpha\[1, 0, 1\]: found nan"),
        (np.ones((2, 1, 2)), [[[0, 1]], [[-0.5, 1]]], r"alpha\[1, 0, 0\]: found -0.5"),
        ([[[NAN, 1]], [[1, INF]]], [[[0, 1]], [[1, 0.5]]], r"depth\[1, 0, 1\]: found inf"),
    ],
)
def test_bad_layers_are_named(depth, alpha, message):
    with pytest.raises(moit.FragmentsError, match=message):
        moit.Fragments.from_layers(depth, alpha)


# -- parts --


@pytest.mark.parametrize(
    "index",
    [
        0,
        slice(None),
        ...,
        None,
        True,
        (0,),
        (0, 0, 0),
        (..., 0),
        (None, 0),
        (True, 0),
        (0, False),
        (0.0, 0),
        ([0], [0]),
        (np.array([0, 1]), 0),
        "ab",
        (slice("a"), 0),
        (slice(0.5), 0),
        (),
    ],
    ids=repr,
)
def test_what_is_no_window_raises_type_error(index):
    with pytest.raises(TypeError):
        build()[index]


@pytest.mark.parametrize(
    "index", [(1, 0), (-2, 0), (0, 3), (0, -4), (0, 2**70), (slice(None, None, 2), 0)]
)
def test_what_is_out_of_range_raises_index_error(index):
    with pytest.raises(IndexError, match=r"row|column"):
        build()[index]


@pytest.mark.parametrize("step", [-1, 0, 3])
def test_a_window_has_step_one(step):
    with pytest.raises(IndexError, match=r"column: a window has step 1"):
        build()[:, ::step]


@pytest.mark.parametrize("seed", [-1, 0.5, "seed", object()])
def test_bad_seeds_are_refused(seed):
    with pytest.raises((TypeError, ValueError)):
        build().shuffled(seed)


def test_only_fragments_merge():
    f = build()
    with pytest.raises(moit.FragmentsError, match=r"at least one"):
        moit.merge([])
    for wrong in (f, [f, None], "ff", 7, [[f]]):
        with pytest.raises(TypeError):
            moit.merge(wrong)


def test_some_with_color_and_some_without_do_not_merge():
    with pytest.raises(moit.FragmentsError, match=r"color .* it is at 0 and not at 2"):
        moit.merge([build(), build(), build(color=None)])


def test_windows_far_apart_do_not_take_all_memory():
    far = build(origin=(2**30, 2**30))
    with pytest.raises(moit.FragmentsError, match=r"far apart"):
        moit.merge([build(), far])
    with pytest.raises(moit.FragmentsError, match=r"far apart"):
        moit.merge([build(origin=(-(2**31) + 1, 0)), build(origin=(2**31 - 1, 0))])


# -- files --


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "f.npz"
    moit.save(path, build())
    return path.read_bytes()


def with_member(saved, name, content):
    """That file with one member replaced; None leaves it out."""
    result = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(saved)) as old, zipfile.ZipFile(result, "w") as new:
        for member in old.namelist():
            if member != f"{name}.npy":
                new.writestr(member, old.read(member))
        if content is not None:
            new.writestr(f"{name}.npy", content)
    return result.getvalue()


def as_npy(value):
    file = io.BytesIO()
    np.save(file, value, allow_pickle=True)
    return file.getvalue()


def load_bytes(tmp_path, content):
    path = tmp_path / "bad.npz"
    path.write_bytes(content)
    return moit.load(path)


@pytest.mark.parametrize("name", ["offsets", "depth", "alpha", "shape", "depth_range", "origin"])
def test_missing_members_are_named(tmp_path, saved, name):
    with pytest.raises(moit.FragmentsError, match=f"bad.npz.*there is no '{name}' in it"):
        load_bytes(tmp_path, with_member(saved, name, None))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("offsets", np.array([0, 2, 1, 3])),
        ("offsets", np.array([0, 2, 2, 2**62])),
        ("depth", np.array([1, NAN, 3])),
        ("alpha", np.array([1, 2, 3])),
        ("color", np.ones((3, 4))),
        ("transmission", np.ones(3, bool)),
        ("shape", np.array([2, 2])),
        ("shape", np.array([1.0, 3.0])),
        ("shape", np.array(3)),
        ("depth_range", np.array([2.0, 3.0])),
        ("origin", np.array([2**40, 0])),
    ],
)
def test_members_are_checked_as_arguments_are(tmp_path, saved, name, value):
    with pytest.raises(moit.FragmentsError, match=rf"bad.npz': (depth|{name})"):
        load_bytes(tmp_path, with_member(saved, name, as_npy(value)))


class Explosive:
    def __reduce__(self):
        return os.abort, ()


def test_pickled_objects_are_not_loaded(tmp_path, saved):
    content = as_npy(np.array([Explosive()], object))
    for name in ("depth", "origin"):
        with pytest.raises(moit.FragmentsError, match=r"not a readable .npz"):
            load_bytes(tmp_path, with_member(saved, name, content))


@pytest.mark.parametrize("shape", ["(4611686018427387904,)", "(1099511627776,)", "(4,)", "(-3,)"])
def test_a_header_that_claims_too_much_allocates_nothing(tmp_path, saved, shape):
    good = as_npy(GOOD["depth"])
    bad = good.replace(b"(3,), }" + b" " * len(shape), f"{shape}, }}    ".encode(), 1)
    assert bad != good and len(bad) == len(good)
    with pytest.raises(moit.FragmentsError, match=r"not a readable .npz"):
        load_bytes(tmp_path, with_member(saved, "depth", bad))


def test_a_truncated_file_is_refused_at_every_length(tmp_path, saved):
    for length in range(0, len(saved), 17):
        with pytest.raises(moit.FragmentsError, match=r"bad.npz"):
            load_bytes(tmp_path, saved[:length])


@given(at=st.integers(0), bits=st.integers(1, 255))
@settings(max_examples=300)
def test_a_damaged_file_gives_an_error_or_valid_fragments(tmp_path_factory, saved, at, bits):
    content = bytearray(saved)
    content[at % len(content)] ^= bits
    try:
        f = load_bytes(tmp_path_factory.getbasetemp(), bytes(content))
    except moit.FragmentsError:
        return
    assert len(f) == 3  # a byte that nothing depends on, or a field of little weight


@pytest.mark.parametrize("content", [b"", b"PK", b"\x93NUMPY\x01\x00", b"fragments" * 100])
def test_other_files_are_refused(tmp_path, content):
    with pytest.raises(moit.FragmentsError, match=r"not a readable .npz of Fragments"):
        load_bytes(tmp_path, content)


def test_a_single_array_is_not_fragments(tmp_path):
    with pytest.raises(moit.FragmentsError, match=r"not a readable .npz"):
        load_bytes(tmp_path, as_npy(np.ones(3)))


def test_paths_that_lead_nowhere_raise_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        moit.load(tmp_path / "none.npz")
    with pytest.raises(FileNotFoundError, match=r"no such folder"):
        moit.save(tmp_path / "none" / "f.npz", build())
    with pytest.raises(IsADirectoryError):
        moit.save(tmp_path, build())
    with pytest.raises(OSError):
        moit.load(tmp_path)
    with pytest.raises(OSError, match=r"nothing but a regular file"):
        moit.save(os.devnull, build())
    for wrong in (None, 3.5, [tmp_path]):
        with pytest.raises(TypeError):
            moit.load(wrong)
        with pytest.raises(TypeError):
            moit.save(wrong, build())
    with pytest.raises(TypeError, match=r"f: expected Fragments, got ndarray"):
        moit.save(tmp_path / "f.npz", np.ones(3))
    assert os.listdir(tmp_path) == []


# -- anything at all --

ANYTHING = (
    hnp.arrays(
        hnp.scalar_dtypes()
        | hnp.integer_dtypes(endianness="?")
        | hnp.floating_dtypes(endianness="?"),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    )
    | st.lists(st.floats() | st.integers() | st.none() | st.text(max_size=2), max_size=4)
    | st.none()
    | st.booleans()
    | st.integers()
    | st.text(max_size=3)
    | st.binary(max_size=8)
)


@given(
    arguments=st.fixed_dictionaries(
        {},
        optional={
            **{name: st.just(array) | ANYTHING for name, array in GOOD.items()},
            "shape": st.tuples(st.integers(-1, 4), st.integers(-1, 4)) | ANYTHING,
            "depth_range": st.tuples(st.floats(), st.floats()) | ANYTHING,
            "origin": st.tuples(st.integers(), st.integers()) | ANYTHING,
        },
    )
)
@settings(max_examples=400)
def test_anything_is_fragments_or_a_fragments_error(arguments):
    try:
        f = build(**arguments)
    except moit.FragmentsError as error:
        name = str(error).replace("[", ":").split(":")[0]
        assert name in {*GOOD, "shape", "depth_range", "origin"}, error
        return
    assert f.offsets[-1] == len(f) == len(f.depth) == len(f.alpha)
    assert np.isfinite(f.depth).all() and ((f.alpha >= 0) & (f.alpha <= 1)).all()
    assert f.shape[0] * f.shape[1] == len(f.offsets) - 1
    assert len(f.sorted()) == len(f)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_ends_where_it_begins_is_not_at_fault(dtype):
    """The first of what is wrong is named, and that is no such thing."""
    depth, back = np.array([[1, 2], [1, 1.5]], dtype)
    with pytest.raises(moit.FragmentsError, match=r"back\[1\]: found 1\.5"):
        moit.Fragments([0, 2], depth, np.full(2, 0.5, dtype), back=back)
