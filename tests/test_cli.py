"""The command line: what it writes, what it says, and how it exits."""

import csv
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from small import ENVIRONMENT, PATIENCE, some_fragments

import moit
from moit.__main__ import main
from moit.benching.cost_measuring import texts
from moit.benching.timing import FRAGMENTS
from moit.catalog.palette import family_title
from moit.commands.compare import DEMO_SCENES, DEMO_TECHNIQUES
from moit.commands.output import write_images
from moit.commands.values import byte_count
from moit.comparing import results_folder
from moit.experiments.catalog import EXPERIMENTS
from moit.formats.deep_bands import USUAL_MEMORY
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.frames import Frame
from moit.gpu_costs.stored import stored
from moit.numerics.columns import PRECISIONS

DEEP = Path(__file__).parent / "data" / "deep"


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    moit.save("trees.npz", some_fragments())
    moit.save("rocks.npz", some_fragments(seed=5))


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


class Asked(Exception):
    """What a command asked of a function, instead of an answer."""

    def __init__(self, *arguments, **options):
        self.arguments, self.options = arguments, options


def raises_what_it_is_asked(*arguments, **options):
    raise Asked(*arguments, **options)


# Every option of every command, given and not: the function that it calls, and with what.
UNCHOSEN = {"part": None, "layer": None}
ASKED = [
    (
        "compare trees.npz -t power4 -t wboit --reference power8 --repeat 9 --device gpu "
        "--device cpu -o d --part left --layer beauty --background 1,2,3 --threads 2 "
        "--depth-range 1,9 --no-cull-opaque --gpu rx6800 --resolution 64x32",
        "moit.comparing.comparison.compare",
        ({"trees": "trees.npz"}, ["power4", "wboit"]),
        {"devices": ["gpu", "cpu"], "reference": "power8", "repeat": 9, "out": "d/results"}
        | {"part": "left", "layer": "beauty", "background": (1, 2, 3), "threads": 2}
        | {"depth_range": (1, 9), "cull_opaque": False, "gpu": "rx6800", "resolution": (64, 32)},
    ),
    (
        "compare trees.npz",
        "moit.comparing.comparison.compare",
        ({"trees": "trees.npz"}, None),
        {"devices": ("cpu",), "reference": "sorted", "repeat": 5, "out": "report/results"}
        | {"background": (0, 0, 0), "threads": None, "depth_range": None, "cull_opaque": True}
        | {"gpu": None, "resolution": None}
        | UNCHOSEN,
    ),
    (
        "recommend trees.npz --max-error 0.5 -t power4,wboit --metric mse --by bits --max-bits 99 "
        "--no-ordered --max-passes 2 --no-exact --background 1,2,3 --threads 2 --gpu rx6800 "
        "--resolution 64x32",
        "moit.comparing.recommendation.recommend",
        ("trees.npz",),
        {
            "max_error": 0.5,
            "metric": "mse",
            "by": "bits",
            "techniques": ["power4,wboit"],
            "max_bits": 99,
            "ordered": False,
            "max_passes": 2,
            "exact": False,
            "background": (1, 2, 3),
            "threads": 2,
            "part": None,
            "layer": None,
            "gpu": "rx6800",
            "resolution": (64, 32),
        },
    ),
    (
        "recommend trees.npz --max-error 0.5",
        "moit.comparing.recommendation.recommend",
        ("trees.npz",),
        {
            "max_error": 0.5,
            "metric": "flip",
            "by": "seconds",
            "techniques": None,
            "max_bits": None,
            "ordered": True,
            "max_passes": None,
            "exact": True,
            "background": (0, 0, 0),
            "threads": None,
            "part": None,
            "layer": None,
            "gpu": None,
            "resolution": None,
        },
    ),
    (
        "composite trees.npz -t power4 -o o.exr --background 1,2,3 --device gpu",
        "moit.questions.composite",
        (None, moit.technique("power4")),
        {"background": (1, 2, 3), "device": "gpu"},
    ),
    (
        "composite trees.npz -t power4 -o o.exr",
        "moit.questions.composite",
        (None, moit.technique("power4")),
        {"background": (0, 0, 0), "device": "cpu"},
    ),
    (
        "composite DEEP -t power4 -o o.exr --background 1,2,3 --device gpu --memory 3M --part 2 "
        "--layer beauty --channel A=alpha --channel Z=depth",
        "moit.deep_composites.composite_deep",
        ("DEEP", "o.exr", moit.technique("power4")),
        {"background": (1, 2, 3), "device": "gpu", "memory": 3 << 20, "progress": True}
        | {"part": 2, "layer": "beauty", "channels": {"A": "alpha", "Z": "depth"}},
    ),
    (
        "composite DEEP -t power4 -o o.exr",
        "moit.deep_composites.composite_deep",
        ("DEEP", "o.exr", moit.technique("power4")),
        {"background": (0, 0, 0), "device": "cpu", "memory": USUAL_MEMORY, "progress": True}
        | UNCHOSEN
        | {"channels": None},
    ),
    (
        "curve trees.npz -t power4 --pixel 5,3 -o c.svg",
        "moit.deep.curve",
        ("trees.npz", "c.svg", ["power4"], (3, 5)),
        {"progress": True, "channels": None} | UNCHOSEN,
    ),
    (
        "curve trees.npz -o c.svg",
        "moit.deep.curve",
        ("trees.npz", "c.svg", None, None),
        {"progress": True, "channels": None} | UNCHOSEN,
    ),
    (
        "bench -t power4 --fragments 5 --threads 3 --repeat 4 --instructions",
        "moit.benching.report.report",
        (["power4"], 5, 3, 4, True),
        {},
    ),
    ("bench", "moit.benching.report.report", (None, FRAGMENTS, None, 3, False), {}),
    (
        "bench --gpu -t power4 --fragments 5 --fragments 6 --size 64x32 --repeat 4",
        "moit.benching.passes.report",
        (None, ["power4"], [5, 6], (64, 32), 4),
        {},
    ),
    (
        "bench --gpu",
        "moit.benching.passes.report",
        (None, None, [10_000_000, 20_000_000], (1920, 1080), 5),
        {},
    ),
    (
        "bench --gpu-cost -t power4 --family navi21 --family vega10",
        "moit.benching.cost_measuring.measured",
        (lambda: texts(["power4"]), ["navi21", "vega10"]),
        {},
    ),
    (
        "bench --gpu-cost",
        "moit.benching.cost_measuring.measured",
        (texts, ("navi21", "gfx1100", "vega10")),
        {},
    ),
    (
        "bench --gpu-cost --stored --card rx7600 --size 64x32 --fragments 9",
        "moit.benching.gpu_costs.report",
        (stored(), CARDS["rx7600"], Frame(9, 2048)),
        {},
    ),
    (
        "train neural -o m.npz --data layers --data puffs --recipe paper --fragments 5 --epochs 6 "
        "--batch 7 --rate .5 --loss color --seed 8 --checkpoint c.npz --resume --part 1 --layer b",
        "moit.neural.training.train",
        ("neural", ["layers", "puffs"]),
        {
            "checkpoint": "c.npz",
            "recipe": "paper",
            "fragments": 5,
            "epochs": 6,
            "batch": 7,
            "rate": 0.5,
            "loss": "color",
            "seed": 8,
            "resume": True,
            "part": 1,
            "layer": "b",
        },
    ),
    (
        "train dfa -o m.npz",
        "moit.neural.training.train",
        ("dfa", None),
        {"checkpoint": "m.checkpoint.npz", "recipe": "quick", "seed": 0, "resume": False}
        | dict.fromkeys(("fragments", "epochs", "batch", "rate", "loss"))
        | UNCHOSEN,
    ),
    (
        "stability -t power4 -t wboit -f ends -f clear -p float32 --rays 7 -o d",
        "moit.numerics.stability.stability",
        (["power4", "wboit"],),
        {"families": ["ends", "clear"], "precisions": ["float32"], "rays": 7, "out": "d/results"},
    ),
    (
        "stability",
        "moit.numerics.stability.stability",
        (None,),
        {"families": None, "precisions": PRECISIONS, "rays": 256, "out": "stability/results"},
    ),
    (
        "experiment mt-fig2 --size full --device gpu -o d",
        "moit.experiments.running.experiment",
        (EXPERIMENTS["mt-fig2"], "full"),
        {"device": "gpu", "out": "d/results"},
    ),
    (
        "experiment mt-fig2",
        "moit.experiments.running.experiment",
        (EXPERIMENTS["mt-fig2"], "small"),
        {"device": "cpu", "out": "experiments/mt-fig2/results"},
    ),
]


@pytest.mark.parametrize(("line", "asks", "arguments", "options"), ASKED)
def test_commands_pass_on_every_option(line, asks, arguments, options, monkeypatch):
    """Of arguments None stands for whatever was made of a file or a device, a function for what it
    gives: what takes seconds is not made where tests are collected."""
    deep = str(min(DEEP.glob("*.exr")))
    monkeypatch.setattr("moit.gpu.default_device", lambda: "a device")
    monkeypatch.setattr(asks, raises_what_it_is_asked)
    with pytest.raises(Asked) as asked:
        main([deep if word == "DEEP" else word for word in line.split()])
    assert asked.value.options == options
    assert len(asked.value.arguments) == len(arguments)
    for found, needed in zip(asked.value.arguments, arguments, strict=True):
        needed = needed() if callable(needed) else deep if needed == "DEEP" else needed
        assert needed is None or found == needed


def test_the_demo_compares_one_technique_of_each_idea_at_the_size_asked_for(monkeypatch):
    monkeypatch.setattr("moit.comparing.comparison.compare", raises_what_it_is_asked)
    with pytest.raises(Asked) as asked:
        main(["demo", "-o", "d", "--size", "24x16"])
    inputs, techniques = asked.value.arguments
    assert {name: f.shape for name, f in inputs.items()} == dict.fromkeys(DEMO_SCENES, (16, 24))
    assert techniques == DEMO_TECHNIQUES
    assert asked.value.options == {"repeat": 3, "out": "d/results"}


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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "nowhere.exr"], "nowhere.exr"),
        (["compare", "clowd"], "did you mean 'cloud'"),
        (["compare", "trees.npz", "-t", "powr4"], "power4"),
        (["compare", "trees.npz", "--repeat", "0"], "repeat"),
        (["compare", "bad.npz"], "bad.npz"),
        (["compare", "bad.exr"], "bad.exr"),
        (["compare", "--merge", "trees.npz", "bad.exr"], "bad.exr"),
        (["compare", "plain.npz"], "color"),
        (["compare", "trees.npz", "-o", "trees.npz"], "trees.npz"),
        (["composite", "trees.npz", "-t", "sorted", "-o", "out.tga"], "out.tga"),
        (["composite", "trees.npz", "-t", "sorted", "-o", "no/such/out.exr"], "no/such"),
        (["composite", "words.txt", "-t", "sorted", "-o", "out.exr"], "words.txt"),
        (["curve", "trees.npz", "--pixel", "99,0", "-o", "c.svg"], "pixel"),
        (["curve", "trees.npz", "-t", "wboit", "-o", "c.svg"], "wboit"),
        (["curve", "trees.npz", "-o", "no/such/c.svg"], "no/such"),
    ],
)
def test_a_users_error_is_one_line_and_exit_1(arguments, words, capsys):
    Path("bad.npz").write_bytes(b"not a zip file")
    Path("bad.exr").write_bytes(b"\x76\x2f\x31\x01 and no more")
    Path("words.txt").write_text("words")
    moit.save("plain.npz", some_fragments(color=False))
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("moit: ") and words in err
    assert err.count("\n") == 1


def test_a_bad_thread_variable_is_a_users_error(monkeypatch, capsys):
    monkeypatch.setenv("MOIT_THREADS", "many")
    assert main(["composite", "trees.npz", "-t", "sorted", "-o", "out.exr"]) == 1
    assert "MOIT_THREADS" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["paint"],
        ["compare"],
        ["composite", "trees.npz"],
        ["curve", "trees.npz", "--pixel", "5"],
        ["curve", "trees.npz", "--pixel", "a,b"],
        ["composite", "trees.npz", "-t", "sorted", "-o", "x.exr", "--background", "1,2"],
        ["demo", "--size", "0x4"],
        ["demo", "--size", "4"],
        ["compare", "trees.npz", "--repeat", "two"],
    ],
)
def test_wrong_usage_is_exit_2(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "usage: moit" in capsys.readouterr().err


def test_version_is_printed():
    done = subprocess.run(
        [sys.executable, "-m", "moit", "--version"],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert (done.returncode, done.stdout) == (0, f"moit {moit.__version__}\n")


def test_a_reader_that_has_enough_is_no_error():
    done = subprocess.run(
        f"'{sys.executable}' -m moit techniques | head -n 1; exit ${{PIPESTATUS[0]}}",
        shell=True,
        executable="/bin/bash",
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_ctrl_c_exits_130_and_keeps_what_was_written():
    moit.save("large.npz", some_fragments(300, 400, 8))
    process = subprocess.Popen(
        [sys.executable, "-m", "moit", "compare", "large.npz", "--repeat", "100000"],
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )
    try:
        while not Path("report/results").exists() and process.poll() is None:
            time.sleep(0.05)
        time.sleep(0.5)  # at work, and for minutes to come
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130
    assert re.fullmatch(r"(.*\n)?moit: interrupted.*\n", err, re.DOTALL)
    assert "Traceback" not in err
    assert not Path("report/report.html").exists()


def test_what_was_measured_before_ctrl_c_is_kept(monkeypatch, capsys):
    from moit.comparing import comparison

    measure, calls = comparison.measure, []

    def interrupted(job):
        if calls:
            raise KeyboardInterrupt
        calls.append(job)
        return measure(job)

    monkeypatch.setattr(comparison, "measure", interrupted)
    assert main(["compare", "trees.npz", "--repeat", "1"]) == 130
    assert "--resume" in capsys.readouterr().err
    assert os.listdir("report/results/trees")


def test_deep_images_are_merged_and_compared():
    files = sorted(str(path) for path in DEEP.glob("*.exr"))
    arguments = ["compare", "--merge", *files, "-t", "sorted", "-t", "power4", "--repeat", "1"]
    assert main(arguments) == 0
    rows = json.loads(Path("report/report.json").read_text())["rows"]
    assert [row["note"] for row in rows] == ["", ""]
    assert rows[0]["flip"] < 1e-6 and rows[1]["flip"] < 0.01


def said_by(capsys, *words):
    """The exit status and what is on stderr."""
    try:
        code = main(list(words))
    except SystemExit as error:
        code = error.code
    return code, capsys.readouterr().err


@pytest.mark.parametrize("output", ["o", "o.", ".png", "o.xyz", "o.exr", "png", ""])
def test_a_curve_needs_an_ending_and_leaves_nothing(output, capsys):
    before = sorted(os.listdir())
    code, said = said_by(capsys, "curve", "panes", "-t", "power4", "-o", output)
    assert code == 1 and "expected a name that ends in" in said
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize("ending", ["svg", "PNG", "pdf", "eps", "jpg"])
def test_a_curve_is_written_as_its_ending_says(ending):
    pytest.importorskip("matplotlib")
    before = set(os.listdir())
    assert main(["curve", "panes", "-t", "power4", "-o", f"o.{ending}"]) == 0
    start = Path(f"o.{ending}").read_bytes()[:4]
    assert start in (b"<svg", b"<?xm", b"\x89PNG", b"%PDF", b"%!PS", b"\xff\xd8\xff\xe0")
    assert set(os.listdir()) == before | {f"o.{ending}"}


LONG = "x" * 5000


@pytest.mark.parametrize(
    "words",
    [
        ["composite", "panes", "-t", LONG, "-o", "o.png"],
        ["composite", "panes", "-t", f"power4({LONG}=1)", "-o", "o.png"],
        ["composite", "panes", "-t", f"power4(bias={LONG!r})", "-o", "o.png"],
        ["composite", LONG, "-t", "power4", "-o", "o.png"],
        ["composite", f"{LONG}.npz", "-t", "power4", "-o", "o.png"],
        ["composite", "panes", "-t", "power4", "-o", f"{LONG}.png"],
        ["composite", "panes", "-t", "power4", "-o", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--background", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--memory", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--device", LONG],
        ["curve", "panes", "-t", "power4", "-o", LONG],
        ["curve", "panes", "--pixel", LONG],
        ["compare", "panes", "-t", "power4", "--reference", LONG],
        ["compare", "panes", "--repeat", LONG],
        ["experiment", LONG],
        ["train", LONG, "-o", "n.npz"],
        ["train", "neural-bounded", "-o", "n.npz", "--loss", LONG],
        ["train", "neural-bounded", "-o", "n.npz", "--recipe", LONG],
        ["train", "neural-bounded", "-o", "n.npz", "--data", LONG],
        ["stability", "-f", LONG],
        ["stability", "-t", "power4", "-p", LONG],
        ["bench", "--size", LONG],
        ["bench", "--gpu-cost", "--stored", "--card", LONG],
        ["bench", "--gpu-cost", "--family", LONG],
        ["compare", "panes", "--gpu", LONG],
        ["demo", "--size", LONG],
        [LONG],
        ["info", LONG],
    ],
)
def test_what_is_long_is_not_echoed_whole(words, capsys):
    code, said = said_by(capsys, *words)
    assert code in (1, 2)
    assert 0 < len(said) < 2500
    assert "x" * 401 not in said


def test_messages_of_functions_cut_what_is_long():
    for call in (
        lambda: moit.technique(LONG),
        lambda: moit.technique(f"power4({LONG}=1)"),
        lambda: moit.scenes.load(LONG),
        lambda: moit.scenes.meshes(LONG),
        lambda: moit.experiment(LONG),
        lambda: moit.composite(LONG, "power4"),
        lambda: moit.compare("panes", "power4", metrics=[LONG]),
    ):
        with pytest.raises(ValueError, match=r"x{40}") as caught:
            call()
        assert len(str(caught.value)) < 1500


def test_a_full_standard_output_is_said_in_one_line():
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full")
    with open("/dev/full", "w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "moit", "techniques"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=ENVIRONMENT,
        )
    assert run.returncode == 1
    assert run.stderr.startswith("moit: ") and run.stderr.count("\n") == 1


def test_names_that_are_no_text_are_shown():
    name = os.fsdecode(b"\xff.svg")
    run = subprocess.run(
        [sys.executable, "-m", "moit", "curve", "panes", "-t", "power4", "-o", name],
        capture_output=True,
        env=ENVIRONMENT,
    )
    assert (run.returncode, run.stdout, run.stderr) == (0, b"\\udcff.svg\n", b"")


# Words of every kind for every place.
WORDS = (
    *("trees.npz", "panes", "none.npz", "folder", "file", "", ".", "/", "/dev/null", "a\0b"),
    *("power4", "power4(", "power4(bias=nan)", "power0", "sorted(", "neural-bounded(network=no)"),
    *("0", "-1", "nan", "1e999", "9" * 30, "x", "\udcff", "٣", "1x1", "0x0", "0,0", "a,b,c", "-"),
    *("o.png", "o.exr", "o.svg", "folder/o.png", "file/o.png", "o", "--", "--nix", "-o", "-h"),
)
COMMAND_WORDS = {
    "composite": ["trees.npz", "-t", "power4", "-o", "o.png", "--background", "0,0,0"],
    "curve": ["trees.npz", "-t", "power4", "-o", "o.svg", "--pixel", "0,0"],
    "compare": ["trees.npz", "-t", "sorted", "-o", "out", "--repeat", "1", "--reference", "sorted"],
    "experiment": ["none", "-o", "out", "--size", "tiny"],
    "train": ["none", "-o", "n.npz", "--fragments", "9", "--epochs", "1", "--rate", "1", "--seed"],
    "bench": ["-t", "none", "--fragments", "9", "--repeat", "1", "--threads", "1"],
    "stability": ["-t", "power4", "-f", "none", "--rays", "1", "-o", "out"],
    "recommend": ["trees.npz", "-t", "sorted", "--max-error", "1", "--metric", "mse"],
    "scenes": [],
    "techniques": [],
}


@pytest.mark.parametrize("command", COMMAND_WORDS)
def test_nonsense_is_refused_in_one_line(command, capsys):
    r = random.Random(command)
    Path("file").write_text("")
    Path("folder").mkdir()
    for _ in range(40):
        words = list(COMMAND_WORDS[command])
        for _ in range(r.choice((1, 1, 2))):
            at = r.randrange(len(words) + 1)
            words[at : at + r.randrange(2)] = [r.choice(WORDS)]
        code, said = said_by(capsys, command, *words)
        assert code in (0, 1, 2), words
        assert "Traceback" not in said
        if code == 1:
            assert said.splitlines()[-1].startswith("moit: ")
        assert not [name for name in os.listdir() if name.startswith(".moit")], words


@pytest.mark.parametrize(("words", "code"), [("techniques", 0), ("export nope", 1)])
def test_a_closed_standard_output_is_no_error(words, code):
    done = subprocess.run(
        ["sh", "-c", f'"$0" -m moit {words} >&-', sys.executable],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        timeout=PATIENCE,
    )
    assert done.returncode == code and "Traceback" not in done.stderr
