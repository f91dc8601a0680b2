"""The names that people type: aliases, any case, several with commas; and what errors suggest."""

import pytest

import moit
from moit.__main__ import main
from moit.catalog import listed
from moit.catalog.aliases import ALIASES
from moit.catalog.names import CLASSES, class_of, spelled


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("mboit4", "power4"),
        ("MBOIT", "power4"),
        ("mboit-6", "power6"),
        ("MBOIT8-16", "power8-16"),
        ("mboit-16", "power4-16"),
        ("power", "power4"),
        ("Power_6", "power6"),
        ("wboit", "wboit"),
        ("WBOIT", "wboit"),
        ("WBOIT-EQ7", "wboit-eq7"),
        ("weighted blended", "wboit"),
        ("a-buffer", "sorted"),
        ("A buffer", "sorted"),
        ("linked-list", "sorted"),
        ("Linked_Lists", "sorted"),
        ("mt", "moment-transparency"),
        ("MT-LR8", "moment-transparency-lr8"),
        ("nmt", "neural"),
        ("at", "adaptive4"),
        ("AT8", "adaptive8"),
        ("mlab", "mlab4"),
        ("MLAB2", "mlab2"),
        ("K-Buffer", "kbuffer4"),
        ("k-buffer-8", "kbuffer8"),
        ("ht6", "hybrid6"),
        ("Depth Peeling", "depth-peeling4"),
        ("depth-peeling-8", "depth-peeling8"),
        ("Trig3-16", "trig3-16"),
        ("trig-16", "trig2-16"),
        ("wavelet-16", "wavelet16"),
        ("FOM15", "fourier15"),
        (" mboit4 ( bias = 0.0 ) ", "power4(bias=0.0)"),
    ],
)
def test_what_is_typed_is_understood(typed, name):
    assert str(moit.technique(typed)) == name


@pytest.mark.parametrize("alias", ALIASES)
def test_each_alias_is_a_technique(alias):
    assert isinstance(moit.technique(alias.title()), moit.Technique)


def test_each_usual_number_is_of_one_that_is_listed():
    names = set(map(str, moit.techniques()))
    usual = {start: class_of(start).usual for start in CLASSES}
    assert {f"{start}{number}" for start, number in usual.items() if number} <= names
    for start, number in usual.items():
        if number:
            assert str(moit.technique(start)) == f"{start}{number}"
        else:
            assert not class_of(start).counted, f"{start}: which number is usual?"


def test_each_name_stands_for_itself_in_any_case():
    for one in moit.techniques():
        assert moit.technique(str(one).upper()) == one
        assert spelled(str(one)) == str(one)


@pytest.mark.parametrize(
    "given",
    [
        "power4,power6(bias=0.0,warp='linear'),mlab2",
        ["power4, power6(warp='linear',bias=0.0)", "mlab2", "MBOIT"],
        ("power4", "power6(bias=0.0, warp='linear') , MLAB2"),
    ],
)
def test_commas_separate_names_but_not_within_brackets(given):
    assert list(map(str, listed(given))) == ["power4", "power6(bias=0.0,warp='linear')", "mlab2"]


@pytest.mark.parametrize("given", ["", ",", "power4,", "power4,,power6", "power4)(,power6"])
def test_an_empty_or_torn_name_is_an_error(given):
    with pytest.raises(ValueError, match="technique: there is no"):
        listed(given)


@pytest.mark.parametrize("given", ["MBOIT,power6", ["MBOIT , power6"], ["mboit4", "power6"]])
def test_candidates_of_pixels_are_named_in_the_same_ways(given):
    assert moit.PerPixel(techniques=given).techniques == ("power4", "power6")


def test_where_one_is_needed_several_are_counted():
    with pytest.raises(ValueError, match="technique: expected one, got 2 with commas"):
        moit.technique("power4, power6(bias=0.0,warp='linear')")


def test_the_command_line_and_compare_take_commas(tmp_path, capsys):
    f = moit.scenes.load("panes", (8, 6))
    report = moit.compare(f, "MBOIT,wboit", metrics="mse", repeat=1, progress=False)
    assert [row.technique for row in report.rows] == ["power4", "wboit"]
    path = tmp_path / "f.npz"
    moit.save(path, f)
    curve = tmp_path / "c.svg"
    assert main(["curve", str(path), "-t", "mboit,at", "-o", str(curve)]) == 0
    text = curve.read_text()
    assert "power4" in text and "adaptive4" in text


@pytest.mark.parametrize(
    ("typed", "suggestion"),
    [
        ("mboti4", "'mboit'"),
        ("powr4", "'power4'"),
        ("POWR4", "'power4'"),
        ("a-bufer", "'a-buffer'"),
        ("linkedlist", "'linked-list'"),
        ("fourrier", "'fourier"),
        ("qqqqqq", "moit.techniques()"),
        ("x" * 5000, "moit.techniques()"),
    ],
)
def test_suggestions_are_the_nearest_few(typed, suggestion):
    with pytest.raises(ValueError, match="there is no") as raised:
        moit.technique(typed)
    text = str(raised.value)
    assert suggestion in text
    assert text.count("'") <= 2 + 2 * 3 and len(text) < 400
