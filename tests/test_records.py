"""Fragments from rows and columns, and from records of a renderer."""

import numpy as np
import pytest

import moit


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "<i2", ">i4", "u4", "i8", "u8"])
def test_rows_and_columns_of_any_integer_type_do_not_wrap(kind):
    # 120 * 1000 + 100 is beyond what most of these types hold.
    x, y = np.array([100, 7, 100], kind), np.array([120, 3, 120], kind)
    f = moit.Fragments.from_pixels(
        x=x, y=y, depth=[3.0, 2.0, 1.0], alpha=[0.5, 0.5, 0.25], shape=(130, 1000)
    )
    assert f[120, 100].depth.tolist() == [3, 1] and f[3, 7].depth.tolist() == [2]
    assert len(f) == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x": [0, 3], "y": [0, 0]}, r"x\[1\]: found 3; needed at least 0 and below 3"),
        ({"x": [0, 0], "y": [-1, 0]}, r"y\[0\]: found -1; needed at least 0 and below 2"),
        ({"x": [0, 2**63], "y": [0, 0]}, "x"),
        ({"x": [0.0, 1.0], "y": [0, 0]}, "x: expected integers"),
        ({"x": [0, 1]}, "pixel: expected integers, or x and y in its place; got x"),
        ({"x": [0, 1], "y": [0, 0], "pixel": [0, 0]}, "got pixel and x and y"),
        ({}, "got none of them"),
        ({"x": [0], "y": [0]}, r"x: with depth of shape \(2,\), x must have the same"),
    ],
)
def test_wrong_rows_and_columns_are_named(arguments, words):
    with pytest.raises(moit.FragmentsError, match=words):
        moit.Fragments.from_pixels(**arguments, depth=[1, 2], alpha=[0.5, 0.5], shape=(2, 3))


RECORDS = {
    "x, y, rgba": [("x", "u2"), ("y", "u2"), ("depth", "f4"), ("rgba", "f2", 4)],
    "rows first": [("y", "i8"), ("X", "u1"), ("Z", ">f8"), ("RGBA", "f8", (4,))],
    "xy": [("xy", "u4", 2), ("z", "f4"), ("r", "f4"), ("g", "f4"), ("b", "f4"), ("a", "f4")],
    "pixel": [
        ("next", "u4"),
        ("pixel", "u4"),
        ("depth", "f4"),
        ("color", "f4", 3),
        ("alpha", "f2"),
    ],
}


@pytest.mark.parametrize("fields", RECORDS.values(), ids=RECORDS)
def test_records_are_what_their_fields_say(fields):
    rows, columns = np.array([1, 0, 1]), np.array([2, 1, 2])
    rgba = np.array([[1, 2, 3, 0.5], [4, 5, 6, 0.25], [7, 8, 9, 1]])
    values = {
        "x": columns,
        "y": rows,
        "xy": np.stack([columns, rows], 1),
        "pixel": rows * 3 + columns,
    }
    values |= {
        "depth": [3, 2, 1],
        "z": [3, 2, 1],
        "rgba": rgba,
        "color": rgba[:, :3],
        "next": [9] * 3,
    }
    values |= dict(zip("rgba", rgba.T, strict=True)) | {"alpha": rgba[:, 3]}
    records = np.zeros(3, fields)
    for name in records.dtype.names:
        records[name] = values[name.lower()]
    expected = moit.Fragments.from_pixels(
        rows * 3 + columns, [3, 2, 1], rgba[:, 3], rgba[:, :3], shape=(2, 3)
    )
    buffer = records.tobytes()
    words = np.frombuffer(buffer + bytes(-len(buffer) % 4), np.uint32)
    given = [(records, None), (records[None], None), (buffer, fields), (bytearray(buffer), fields)]
    given += [(words, fields)] if len(buffer) % 4 == 0 else []
    for one, layout in given:
        f = moit.Fragments.from_records(one, layout=layout, shape=(2, 3))
        for name in ("offsets", "depth", "alpha", "color"):
            np.testing.assert_array_equal(getattr(f, name), getattr(expected, name))


@pytest.mark.parametrize("name", ["transmission", "back", "emission", "deviation"])
def test_records_have_what_else_fragments_have(name):
    shape = () if name in ("back", "deviation") else (3,)
    fields = [("pixel", "u2"), ("z", "f4"), ("a", "f4"), ("rgb", "f4", 3), (name, "f4", shape)]
    records = np.zeros(2, fields)
    records["z"], records["a"], records[name] = 1.0, 0.5, (2.0 if name == "back" else 0.25)
    f = moit.Fragments.from_records(records, shape=(1, 1))
    assert (getattr(f, name) == records[name]).all()


def test_sixteen_bytes_are_a_record_without_being_told():
    records = np.zeros(5, RECORDS["x, y, rgba"])
    records["x"], records["depth"], records["rgba"] = np.arange(5), 1 + np.arange(5), 0.5
    f = moit.Fragments.from_records(records.tobytes(), shape=(1, 5))
    assert f.depth.tolist() == [1, 2, 3, 4, 5] and (f.counts == 1).all()


@pytest.mark.parametrize(
    ("records", "layout", "words"),
    [
        (bytes(15), None, "found 15 bytes; needed a multiple of 16"),
        (bytes(16), "f4", "layout: expected a structured dtype of numbers, got float32"),
        (bytes(16), "nonsense", "layout"),
        (np.zeros(2, RECORDS["pixel"]), RECORDS["pixel"], "layout: expected None"),
        (
            np.zeros(2, [("x", "u2"), ("depth", "f4"), ("rgba", "f4", 4)]),
            None,
            "needed pixel, or x",
        ),
        (
            np.zeros(2, [("pixel", "u2"), ("rgba", "f4", 4)]),
            None,
            "needed depth; found the fields pixel",
        ),
        (np.zeros(2, [("pixel", "u2"), ("z", "f4")]), None, "needed alpha or rgba"),
        (np.zeros(2, [("pixel", "u2"), ("z", "f4"), ("a", "f4"), ("r", "f4")]), None, "r, g and b"),
        (
            np.zeros(2, [("pixel", "u2"), ("z", "f4"), ("depth", "f4")]),
            None,
            "two fields for depth",
        ),
        (np.zeros(2, [("pixel", "u2"), ("z", "f4"), ("rgba", "f4", 3)]), None, "'rgba' must be"),
        (
            np.zeros(1, [("pixel", "u2"), ("z", "f4"), ("rgba", "f4", 4), ("color", "f4", 3)]),
            None,
            "needed one of rgba",
        ),
        (np.zeros(1, [("pixel", "u2"), ("z", "f4"), ("rgba", "u1", 4)]), None, "expected floats"),
        (np.zeros(2, object), None, "records: expected a structured array"),
        ("text", None, "records: expected a structured array"),
        (np.zeros(0, [("a", "f4")]), None, "needed pixel"),
    ],
)
def test_records_without_what_is_needed_are_named(records, layout, words):
    with pytest.raises(moit.FragmentsError, match=words):
        moit.Fragments.from_records(records, layout=layout, shape=(1, 1))


@pytest.mark.parametrize("kind", ["u1", "i2", "u2", "i8", "u4"])
@pytest.mark.parametrize("name", ["alpha", "color", "transmission"])
def test_arrays_of_integers_are_no_opacity_and_no_radiance(name, kind):
    given = {"depth": [1.0], "alpha": [0.5], "color": [[1, 0, 0]], "transmission": [[1, 0, 0]]}
    assert moit.Fragments([0, 1], **given).color.tolist() == [[1, 0, 0]]  # lists say what they mean
    given[name] = np.ones_like(given[name], kind)
    with pytest.raises(
        TypeError, match=f"{name}: expected floats, got .*; .*255|{name} / "
    ) as error:
        moit.Fragments([0, 1], **given)
    assert isinstance(error.value, moit.FragmentsError)
    given["depth"] = np.array([1], kind)  # of depth any number is one
    given[name] = given[name].astype(np.float32)
    assert moit.Fragments([0, 1], **given).depth.tolist() == [1]
