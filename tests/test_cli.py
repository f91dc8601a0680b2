"""The command line: what it writes, what it says, and how it exits."""

import csv
import json
import os
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import moit
from moit.__main__ import main
from moit.catalog.palette import family_title
from moit.commands.compare import DEMO_SCENES
from moit.commands.output import write_images
from moit.commands.values import byte_count, pixel
from moit.comparing import results_folder

pytestmark = pytest.mark.usefixtures("trees_and_rocks")


def test_compare_writes_a_report_and_prints_its_table(capsys):
    assert main(["compare", "trees.npz", "-t", "sorted", "-t", "power4", "--repeat", "1"]) == 0
    out = capsys.readouterr().out
    assert "power4" in out
    assert out.splitlines()[-4:] == [
        "report/images/  (2 files)",
        *(f"report/report.{kind}" for kind in ("csv", "json", "html")),
    ]
    with open("report/report.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["scene"], row["technique"]) for row in rows] == [
        ("trees", "sorted"),
        ("trees", "power4"),
    ]
    assert json.loads(Path("report/report.json").read_text())["rows"][1]["technique"] == "power4"
    page = Path("report/report.html").read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert "<title>moit compare: trees.npz</title>" in page
    shown = moit.read_image("report/images/trees-power4.png")
    exact = np.clip(moit.composite("trees.npz", "power4")[..., :3], 0, 1)
    assert np.abs(shown[..., :3] - exact).max() < 0.005  # half a step of 8 bits of sRGB


def test_every_technique_is_compared_by_default():
    assert main(["compare", "trees.npz", "--repeat", "1", "-o", "out"]) == 0
    rows = json.loads(Path("out/report.json").read_text())["rows"]
    assert [row["technique"] for row in rows] == [str(t) for t in moit.techniques()]


def test_merge_makes_one_scene_of_all_inputs():
    inputs = ["trees.npz", "rocks.npz"]
    assert main(["compare", "--merge", *inputs, "-t", "sorted", "--repeat", "1"]) == 0
    image = moit.read_image("report/results/merged/sorted.exr")
    merged = moit.merge([moit.load(one) for one in inputs])
    assert np.array_equal(image, moit.composite(merged, "sorted"))


@pytest.mark.usefixtures("no_two_seconds_alike")
def test_a_second_run_measures_anew_unless_told_to_resume():
    def seconds():
        return json.loads(Path("report/report.json").read_text())["rows"][0]["seconds"]

    arguments = ["compare", "trees.npz", "-t", "sorted", "--repeat", "1"]
    assert main(arguments) == 0
    first = seconds()
    assert main([*arguments, "--resume"]) == 0
    assert seconds() == first
    assert main(arguments) == 0
    assert seconds() != first


def test_measuring_anew_removes_only_its_own_files():
    arguments = ["compare", "trees.npz", "-t", "sorted", "--repeat", "1"]
    assert main(arguments) == 0
    mine = Path("report/results/trees/mine.json")
    mine.write_text('{"notes": "keep"}')
    Path("report/results/trees/mine.exr").write_text("keep")
    assert main(["compare", "trees.npz", "-t", "power4", "--repeat", "1"]) == 0
    assert sorted(p.name for p in mine.parent.iterdir()) == [
        "mine.exr",
        "mine.json",
        "power4.exr",
        "power4.json",
    ]


def test_pictures_of_devices_are_kept_apart(tmp_path):
    report = moit.compare("trees.npz", ["sorted", "wboit"], repeat=1, progress=False)
    report.rows[1]["device"] = "gpu"
    names = [os.path.basename(one) for one in write_images(report, "d")]
    assert names == ["trees-sorted.png", "trees-wboit-gpu.png"]


@pytest.mark.filterwarnings("always")
def test_a_warning_is_a_line_of_its_own(monkeypatch, capsys):
    def warned(*_, **__):
        warnings.warn("something\n  odd", UserWarning, stacklevel=1)
        raise ValueError("and more")

    monkeypatch.setattr("moit.comparing.comparison.compare", warned)
    assert main(["compare", "trees.npz"]) == 1
    assert capsys.readouterr().err == "moit: warning: something odd\nmoit: and more\n"


@pytest.mark.parametrize(
    ("text", "count"),
    [("1", 1), ("700", 700), ("2k", 2048), ("1.5M", 3 << 19), ("2G", 2 << 30), ("1t", 1 << 40)],
)
def test_sizes_of_memory_are_read_in_powers_of_1024(text, count):
    assert byte_count(text) == count


@pytest.mark.parametrize(
    ("made", "arguments"),
    [
        (
            "stability/results/ends/power4-float32.json",
            ["stability", "-t", "power4", "-f", "ends", "-p", "float32", "--rays", "2"],
        ),
        (
            "experiments/mt-table1/results/burning-house/wboit.json",
            ["experiment", "mt-table1", "--size", "tiny"],
        ),
    ],
)
def test_results_are_kept_for_those_who_resume_and_for_no_other(made, arguments, monkeypatch):
    assert main(arguments) == 0
    text = Path(made).read_text()
    marked = text.replace('"note": ""', '"note": "kept"')
    assert marked != text
    content = json.loads(marked)
    del content["digest"]
    results_folder.keep(made, **content)
    assert main([*arguments, "--resume"]) == 0
    assert '"note": "kept"' in Path(made).read_text()
    assert main(arguments) == 0
    assert '"note": "kept"' not in Path(made).read_text()


@pytest.mark.parametrize("name", ["power4", "power4(bias=0.0,exclude_self=True)"])
def test_composite_writes_the_image(name, capsys):
    assert main(["composite", "trees.npz", "-t", name, "-o", "out.exr"]) == 0
    assert np.array_equal(moit.read_image("out.exr"), moit.composite("trees.npz", name))
    assert capsys.readouterr().out == "out.exr\n"


def test_composite_takes_a_background():
    arguments = ["composite", "trees.npz", "-t", "sorted", "-o", "out.exr"]
    assert main([*arguments, "--background", "0.5,0.25,1"]) == 0
    expected = moit.composite("trees.npz", "sorted", background=(0.5, 0.25, 1))
    assert np.array_equal(moit.read_image("out.exr"), expected)


def test_curve_writes_svg_without_matplotlib(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["curve", "trees.npz", "--pixel", "5,3", "-o", "c.svg"]) == 0
    text = Path("c.svg").read_text()
    assert "power4" in text and text.startswith("<?xml")


def test_six_curves_are_drawn_unless_more_are_named():
    def drawn(*arguments):
        assert main(["curve", "trees.npz", "--pixel", "5,3", *arguments, "-o", "c.svg"]) == 0
        text = Path("c.svg").read_text()
        titles = re.findall(r'class="series"[^>]*><title>([^<]*)', text)
        assert len(re.findall("<text[^>]*>exact<", text)) == 1
        assert all(len(re.findall(f"<text[^>]*>{re.escape(one)}<", text)) == 1 for one in titles)
        return titles

    families = {family_title(name) for name in drawn()}
    assert len(drawn()) == 6 == len(families)
    every = [str(one) for one in moit.techniques() if one.has_curve]
    assert drawn("-t", ",".join(every)) == every
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    for arguments, count in (([], 6), (["-t", ",".join(every)], len(every))):
        pyplot.close("all")
        assert main(["curve", "trees.npz", *arguments, "-o", "c.png"]) == 0
        (ax,) = pyplot.gcf().axes
        assert len(ax.lines) == count + 1
    pyplot.close("all")


def test_curve_writes_png_with_matplotlib():
    pytest.importorskip("matplotlib").use("Agg")
    assert main(["curve", "trees.npz", "--pixel", "5,3", "-t", "power4", "-o", "c.png"]) == 0
    assert Path("c.png").read_bytes()[:4] == b"\x89PNG"
    assert min(moit.read_image("c.png").shape[:2]) >= 500  # to be read on any screen


def test_png_without_matplotlib_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["curve", "trees.npz", "-o", "c.png"]) == 1
    assert "pip install 'moit[plot]'" in capsys.readouterr().err


def test_techniques_scenes_and_info_are_listed(capsys):
    assert main(["techniques"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split("  ")[0] == "name" and len(lines) == 1 + len(moit.techniques())
    for line, one in zip(lines[1:], moit.techniques(), strict=True):
        name, bits, passes, access, order, source = re.split(r" {2,}", line, maxsplit=5)
        assert (name, access, source) == (str(one), one.access, one.source)
        assert passes == str("varies" if one.geometry_passes is None else one.geometry_passes)
        assert bits == ("grows" if one.bits_per_pixel is None else f"{one.bits_per_pixel:g}")
        assert order == ("yes" if one.order_independent else "no")
    assert main(["scenes"]) == 0
    told = dict(re.split(r" {2,}", line) for line in capsys.readouterr().out.splitlines())
    assert list(told) == moit.scenes.names()
    assert told == moit.scenes.descriptions() and all(told.values())
    assert main(["info"]) == 0
    assert f"moit                    {moit.__version__}".split() == (
        capsys.readouterr().out.splitlines()[0].split()
    )


def test_the_demo_writes_images_curves_and_a_report(capsys):
    assert main(["demo", "-o", "d", "--size", "24x16"]) == 0
    out = capsys.readouterr().out
    for scene in DEMO_SCENES:
        assert Path(f"d/curves/{scene}.svg").exists()
        assert Path(f"d/images/{scene}-power4.png").exists()
        assert scene in out
    for kind in ("html", "csv", "json"):
        assert f"d/report.{kind}" in out
        assert Path(f"d/report.{kind}").exists()
    assert "<title>moit demo</title>" in Path("d/report.html").read_text()
    curve = Path("d/curves/panes.svg").read_text()
    assert "power4" in curve and ">sorted<" not in curve  # which is there as the exact one
    assert "d/images/  (90 files)" in out.replace(os.sep, "/") and "d/curves/  (6 files)" in out
    # All that there is is listed, each with what it is; the page comes first.
    listed = [re.split(" {2,}(?![(])", line) for line in out.split("\n\n")[-1].splitlines()]
    names = [path.partition("  (")[0].rstrip("/") for path, _ in listed]
    assert {str(one) for one in Path("d").iterdir()} == set(names) and names[0] == "d/report.html"
    assert all(words for _, words in listed)
    kept = sum(one.is_file() for one in Path("d/results").rglob("*"))
    assert f"d/results/  ({kept} files)" in out


def test_alone_it_prints_help_with_what_one_does_first(capsys):
    assert main([]) == 0
    text = capsys.readouterr().out
    assert text.startswith("usage: moit")
    # Each command stands in one line with what it does.
    listed = text.split("COMMAND\n")[1].split("\n\n")[0].splitlines()
    assert len(listed) > 10 and all(re.match(r" +[a-z-]+ {2,}\S", line) for line in listed)
    first = text.split("what one does first:\n")[1].splitlines()
    assert len(first) == 6 and all(len(line) <= 100 for line in first)
    for line in first:  # each is a command line that is understood
        words = re.split(r" {2,}", line.strip())[0].split()
        assert words[0] == "moit"
        moit.__main__._parser().parse_args(words[1:])


def test_recommend_takes_what_the_function_takes(tmp_path, capsys):
    f = moit.scenes.load("mixed", (40, 30))
    moit.save(tmp_path / "f.npz", f)
    behind = np.random.default_rng(3).random((30, 40, 3), np.float32)
    moit.write_image(tmp_path / "sky.exr", behind)
    words = ["recommend", str(tmp_path / "f.npz"), "--metric", "mse", "--by", "bits"]
    words += ["-t", "MBOIT,mlab", "-t", "a-buffer", "--background", str(tmp_path / "sky.exr")]
    assert main([*words, "--max-error", "1", "--max-passes", "2", "--threads", "1"]) == 0
    expected = moit.recommend(
        f,
        max_error=1,
        metric="mse",
        by="bits",
        techniques="power4,mlab4,sorted",
        background=behind,
        max_passes=2,
        progress=False,
    )
    said = capsys.readouterr().out.splitlines()
    assert said[:2] == str(expected).splitlines()[:2]
    assert main([*words, "--max-error", "1", "--max-bits", "9", "--no-exact", "--no-ordered"]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("nothing fits\n") and "sorts" in said.out
    assert "rasterizer-ordered" in said.out and "nearest is" in said.err
    assert main([*words, "--max-error", "-1"]) == 1
    assert "max_error" in capsys.readouterr().err


def test_backgrounds_are_colours_or_images(tmp_path, capsys):
    f = moit.scenes.load("panes", (20, 14))
    moit.save(tmp_path / "f.npz", f)
    behind = np.random.default_rng(3).random((14, 20, 4), np.float32)
    moit.write_image(tmp_path / "sky.exr", behind)
    given = [str(tmp_path / "f.npz"), "--background", str(tmp_path / "sky.exr")]
    out = str(tmp_path / "o.exr")
    assert main(["composite", *given, "-t", "power4", "-o", out]) == 0
    picture = moit.composite(f, "power4", background=behind[..., :3])
    np.testing.assert_allclose(moit.read_image(out), picture, atol=1e-6)
    words = ["compare", *given, "-t", "power4", "-o", str(tmp_path / "r"), "--repeat", "1"]
    assert main([*words, "--threads", "1", "--depth-range", "0.01,99", "--no-cull-opaque"]) == 0
    row = json.loads((tmp_path / "r" / "report.json").read_text())["rows"][0]
    how = {"background": behind[..., :3], "threads": 1, "depth_range": (0.01, 99)}
    report = moit.compare(f, "power4", cull_opaque=False, repeat=1, progress=False, **how)
    assert row["mse"] == report.rows[0].mse and row["T_max"] == report.rows[0].T_max
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["composite", given[0], "-t", "power4", "-o", out, "--background", "no.exr"])
    assert "R,G,B or the path of an image" in capsys.readouterr().err


def test_a_pixel_is_asked_by_column_and_row():
    assert pixel("3,5") == (5, 3)


def test_a_picture_has_the_place_of_what_it_shows(tmp_path):
    f = moit.scenes.load("panes", (8, 6))
    more = {"shape": f.shape, "depth_range": f.depth_range, "origin": (2, -3)}
    moit.write_deep(
        tmp_path / "panes.exr", moit.Fragments(f.offsets, f.depth, f.alpha, f.color, **more)
    )
    path = tmp_path / "picture.exr"
    given = [
        "composite",
        str(tmp_path / "panes.exr"),
        "-t",
        "power4(resolution=2)",
        "-o",
        str(path),
    ]
    assert main(given) == 0
    with OpenEXR.File(str(path)) as file:
        box = file.header()["dataWindow"]
    assert tuple(map(int, box[0])) == (-3, 2)
