"""moit.plot: figures show what was asked, and say what they need."""

import subprocess
import sys

import numpy as np
import pytest
from small import ENVIRONMENT, some_fragments

import moit
from moit.measurement import curve, curve_depths, telling_pixels

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


@pytest.fixture(autouse=True)
def no_figures_left():
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def report():
    scenes = {"one": some_fragments(), "two": some_fragments(seed=2)}
    return moit.compare(scenes, ["sorted", "wboit", "power4"], repeat=1, progress=False)


def test_curves_are_those_of_the_questions():
    f = some_fragments()
    ax = moit.plot.curves(f, ["power4", "power6"], pixel=(3, 5))
    lines = {line.get_label(): line for line in ax.lines}
    assert list(lines) == ["power4", "power6", "exact"]
    for name, line in lines.items():
        depth = line.get_xdata()
        technique = "sorted" if name == "exact" else name
        assert np.array_equal(line.get_ydata(), moit.transmittance(f[3, 5], technique, depth)[0, 0])


def test_curves_begin_before_and_end_behind_all_fragments_and_show_each_step():
    f = some_fragments()
    for pixel in telling_pixels(f):
        depth, held = curve_depths(f, pixel), f[pixel]
        assert (np.diff(depth) > 0).all()
        assert depth[0] < held.depth.min() and held.depth.max() < depth[-1]
        exact = curve(f, "sorted", pixel, depth)
        assert exact[0] == 1
        # One step for each fragment: each is sampled at its depth and just behind it.
        assert (np.diff(exact) < 0).sum() == len(np.unique(held.depth))


def test_curves_take_a_scene_a_technique_and_axes():
    _, ax = pyplot.subplots()
    assert moit.plot.curves(some_fragments(), "power4", ax=ax) is ax
    assert len(pyplot.get_fignums()) == 1
    assert len(moit.plot.curves(some_fragments()).lines) == 4


def test_without_a_pixel_the_deepest_is_shown():
    f = some_fragments()
    ax = moit.plot.curves(f, "power4")
    assert f"{f.counts.max()} fragments" in ax.get_title()


def test_an_empty_pixel_has_a_curve_of_one():
    f = moit.Fragments([0, 0, 1], [2.0], [0.5], [[1.0, 1, 1]])
    ax = moit.plot.curves(f, "power4", pixel=(0, 0))
    assert all((line.get_ydata() == 1).all() for line in ax.lines)


@pytest.mark.parametrize(
    ("pixel", "error"),
    [((0, 99), IndexError), ((24, 0), IndexError), ((0,), TypeError), ((0.5, 1), TypeError)],
)
def test_bad_pixels_are_named(pixel, error):
    with pytest.raises(error, match="pixel"):
        moit.plot.curves(some_fragments(), "power4", pixel=pixel)


def test_a_technique_without_curve_is_named():
    with pytest.raises(TypeError, match="wboit"):
        moit.plot.curves(some_fragments(), "wboit")


@pytest.mark.parametrize("by", ["seconds", "bits"])
@pytest.mark.parametrize("metric", [None, "rmse", "ssim", "T_max"])
def test_speed_error_has_a_marker_for_each_row(report, metric, by):
    ax = moit.plot.speed_error(report, metric, by)
    known = [row for row in report.rows if by == "seconds" or row["bits_per_pixel"] is not None]
    markers = [line for line in ax.lines if line.get_marker() != "None"]
    assert len(markers) == len(known)
    assert ax.get_ylabel() == (metric or "flip")
    ax.figure.canvas.draw()  # scales and labels are good enough to draw


def test_speed_error_of_one_scene(report):
    ax = moit.plot.speed_error(report, scene="two")
    assert sum(line.get_marker() != "None" for line in ax.lines) == 3


def test_error_maps_are_those_of_the_metrics(report):
    axes = moit.plot.error_maps(report, "two")
    shown = [ax for ax in axes.flat if ax.images]
    assert [ax.get_title() for ax in shown] == ["sorted", "wboit", "power4"]
    results = {result.row["technique"]: result for result in report.of_scene("two")}
    reference = report.scenes["two"].reference
    for ax in shown:
        expected = moit.metrics.flip_map(results[ax.get_title()].image, reference)
        assert np.array_equal(ax.images[0].get_array(), expected)
    axes.flat[0].figure.canvas.draw()


def test_more_maps_than_columns_go_in_rows(report):
    assert moit.plot.error_maps(report, metric="mae", columns=2).shape == (2, 2)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: moit.plot.speed_error(r, "flop"), "metric"),
        (lambda r: moit.plot.speed_error(r, by="watts"), "by"),
        (lambda r: moit.plot.speed_error(r, scene="three"), "scene"),
        (lambda r: moit.plot.error_maps(r, "three"), "scene"),
        (lambda r: moit.plot.error_maps(r, metric="ssim"), "metric"),
    ],
)
def test_unknown_names_are_named(report, call, words):
    with pytest.raises(ValueError, match=words):
        call(report)


def test_without_matplotlib_the_error_says_what_to_install():
    code = (
        "import sys, moit; sys.modules['matplotlib'] = None\n"
        "f = moit.Fragments([0, 1], [2.0], [0.5], [[1.0, 1, 1]])\n"
        "try: moit.plot.curves(f, 'power4')\n"
        "except ImportError as error: print(error)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=ENVIRONMENT
    )
    assert "pip install 'moit[plot]'" in run.stdout
