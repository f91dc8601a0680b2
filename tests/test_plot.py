"""moit.plot: figures show what was asked, and say what they need."""

import re
import subprocess
import sys

import numpy as np
import pytest
from small import ENVIRONMENT, some_fragments

import moit
from moit.comparing.measurement import curve, curve_depths, telling_pixels
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from matplotlib.transforms import Bbox  # noqa: E402

from moit.reports.charts import DialChart, Series  # noqa: E402
from moit.reports.figures import draw  # noqa: E402
from moit.reports.label_places import place  # noqa: E402
from moit.reports.labels import Labels, painted_size  # noqa: E402
from moit.reports.svg import svg  # noqa: E402


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
    ax.figure.draw_without_rendering()  # scales and labels are good enough to draw


def test_speed_error_of_one_scene(report):
    ax = moit.plot.speed_error(report, scene="two")
    assert sum(line.get_marker() != "None" for line in ax.lines) == 3


def crowded(count=40, seed=3):
    """A report of many techniques whose markers lie close together, and one without error."""
    random = np.random.default_rng(seed)
    rows = []
    for i in range(count):
        known = {"scene": "one", "device": "cpu", "technique": f"technique-{i}", "note": ""}
        known |= {"seconds": random.lognormal(-6, 0.3), "flip": random.lognormal(-4, 0.3)}
        rows.append(Row(known | {"bits_per_pixel": 32.0 * (i % 5)}))
    rows.append(Row(rows[0] | {"technique": "sorted", "flip": 1e-8, "bits_per_pixel": None}))
    return Report([Result(row) for row in rows], metrics=("flip",))


def drawn_labels(ax):
    """The boxes of an Axes' labels by name, the boxes of its markers, and its own; in pixels."""
    ax.figure.draw_without_rendering()
    renderer = ax.figure.canvas.get_renderer()
    (labels,) = (one for one in ax.get_children() if isinstance(one, Labels))
    texts = [one for one in labels.artists(renderer) if isinstance(one, Text)]
    boxes = {text.get_text(): text.get_window_extent(renderer) for text in texts}
    markers = [line for line in ax.lines if line.get_marker() != "None"]
    places = [ax.transData.transform(line.get_xydata()[0]) for line in markers]
    half = 2.9 * ax.figure.dpi / 72  # a little less than a marker's radius of 3 points
    return boxes, [Bbox([at - half, at + half]) for at in places], ax.get_window_extent(renderer)


def overlap(a, b):
    return a.x0 < b.x1 and b.x0 < a.x1 and a.y0 < b.y1 and b.y0 < a.y1


@pytest.mark.parametrize("by", ["seconds", "bits"])
@pytest.mark.parametrize("change", ["", "limits", "size"])
def test_labels_cover_neither_each_other_nor_markers(by, change):
    report = crowded()
    asked = [row["technique"] for row in report.rows]
    ax = moit.plot.speed_error(report, by=by, labels=asked)
    if change == "limits":
        ax.set(ylim=(0.01, 0.03))
    if change == "size":
        ax.figure.set_size_inches(5, 3)
    boxes, markers, frame = drawn_labels(ax)
    assert len(boxes) >= 10
    for box in boxes.values():
        assert not any(overlap(box, other) for other in boxes.values() if other is not box)
        assert not any(overlap(box, marker) for marker in markers)
        assert frame.x0 <= box.x0 and box.x1 <= frame.x1
        assert frame.y0 <= box.y0 and box.y1 <= frame.y1


def test_labels_cover_no_marker_without_a_label():
    report = crowded()
    ax = moit.plot.speed_error(report, labels=[f"technique-{i}" for i in range(10)])
    boxes, markers, _ = drawn_labels(ax)
    assert len(boxes) >= 10 and len(markers) == 41
    for box in boxes.values():
        assert not any(overlap(box, marker) for marker in markers)


@pytest.mark.parametrize("dpi", [66, 80, 100])
def test_labels_paint_what_they_measure(dpi):
    name = "power8(exclude_self=True)"
    row = {"scene": "one", "device": "cpu", "technique": name, "note": "", "bits_per_pixel": 1.0}
    ax = moit.plot.speed_error(Report([Result(Row(row | {"seconds": 1.0, "flip": 0.1}))]))
    ax.figure.set_dpi(dpi)
    (labels,) = (one for one in ax.get_children() if isinstance(one, Labels))

    def painted():
        ax.figure.canvas.draw()
        return np.asarray(ax.figure.canvas.buffer_rgba())[::-1].astype(int)

    full = painted()
    renderer = ax.figure.canvas.get_renderer()
    (text,) = labels.artists(renderer)
    left = text.get_position()[0]
    right = left + painted_size(text, renderer, dpi / 72)[0]
    labels.set_visible(False)
    x = np.flatnonzero((painted() != full).any((0, 2)))
    # The white rim is less than a point wide.
    assert left - dpi / 72 - 1 <= x[0] and x[-1] <= right + dpi / 72 + 1


@pytest.mark.parametrize("by", ["seconds", "bits"])
def test_techniques_of_the_front_keep_their_names(by):
    report = crowded()
    boxes, _, _ = drawn_labels(moit.plot.speed_error(report, by=by))
    assert {row["technique"] for row in report.pareto(by=by)} <= set(boxes)


def test_a_label_without_room_is_left_out():
    point, size = np.array([[5.0, 5.0]]), np.array([[40.0, 8.0]])
    assert place(point, size, np.array([0.0, 0, 20, 20]), np.array([74.0])) == [None]
    (corner,) = place(point, size, np.array([0.0, 0, 90, 20]), np.array([74.0]))
    assert corner[0] > 5  # to the right of what it labels


def test_errors_far_below_the_others_have_a_row_of_their_own():
    report = crowded()
    ax = moit.plot.speed_error(report)
    heights = [line.get_ydata()[0] for line in ax.lines if line.get_marker() != "None"]
    assert heights[:-1] == [row["flip"] for row in report.rows[:-1]]
    assert ax.get_ylim()[0] < heights[-1] < min(heights[:-1])
    assert heights[-1] > 1e-4  # and not seven decades below
    ticks = dict(
        zip(ax.get_yticks(), (one.get_text() for one in ax.get_yticklabels()), strict=True)
    )
    assert ticks[heights[-1]] == "<1e-7"


def test_error_maps_are_those_of_the_metrics(report):
    axes = moit.plot.error_maps(report, "two")
    shown = [ax for ax in axes.flat if ax.images]
    names = [ax.get_label().split(": ")[1].removesuffix(", FLIP") for ax in shown]
    assert names == ["sorted", "wboit", "power4"]
    results = {result.row["technique"]: result for result in report.of_scene("two")}
    reference = report.scenes["two"].reference
    for ax, name in zip(shown, names, strict=True):
        expected = moit.metrics.flip_map(results[name].image, reference)
        assert np.array_equal(ax.images[0].get_array(), expected)
    axes.flat[0].figure.draw_without_rendering()


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


def test_devices_have_fronts_of_their_own():
    import dataclasses

    report = moit.compare(some_fragments(12, 12), ["wboit", "power4"], repeat=1, progress=False)
    twice = [
        dataclasses.replace(one, row=type(one.row)({**one.row, "device": device}))
        for device in ("cpu", "gpu")
        for one in report.results
    ]
    report = dataclasses.replace(report, results=twice)
    axes = moit.plot.speed_error(report)
    lines = [line.get_label() for line in axes.lines if not line.get_label().startswith("_")]
    assert lines == ["fragments", "fragments, gpu"]


def drawn_by_both(chart):
    """Heights of a DialChart's series, as shares of the values' axis: by matplotlib, by SVG."""
    _, ax = pyplot.subplots()
    draw(chart, ax)
    (line,) = ax.lines
    ax.figure.draw_without_rendering()
    box = ax.get_window_extent()
    across = ax.transData.transform(np.c_[line.get_xdata(), line.get_ydata()])
    figure = (across[:, 1] - box.y0) / box.height
    path = re.search(r'class="series"[^>]* d="([^"]*)"', svg(chart, (420, 250))).group(1)
    down = np.array([float(point.split()[1]) for point in re.findall(r"[\d.]+ [\d.]+", path)])
    return figure, down


@pytest.mark.parametrize("linear", [False, True])
def test_figures_and_svg_show_the_same_of_a_chart(linear):
    y = np.array([1.0, 10.0, np.nan, 100.0, 1e-12])
    chart = DialChart([1, 2, 3, 4, 5], [Series("a", y, "#123456", "a")], "dial", None, 0.1, linear)
    figure, down = drawn_by_both(chart)
    assert len(figure) == len(down) == 4  # nothing for NaN
    on_axis = slice(None) if linear else slice(3)
    steps, others = np.diff(figure[on_axis]), -np.diff(down[on_axis])
    assert (
        (np.diff(figure[:3]) > 0).all() and figure[3] < figure[:3].min() and down[3] > max(down[:3])
    )
    np.testing.assert_allclose(steps / steps[0], others / others[0], rtol=0.01)
    assert steps[1] == pytest.approx(steps[0] * (10 if linear else 1))
    assert ("&lt;1e-11" in svg(chart, (420, 250))) == (not linear)


def test_numbers_that_are_better_high_have_a_linear_axis():
    report = crowded()
    for row in report.rows:
        row["ssim"] = 1 - row["flip"]
    report = Report(report.results, metrics=("ssim",))
    assert moit.plot.speed_error(report, "ssim").get_yscale() == "linear"
    assert moit.plot.speed_error(crowded(), "flip").get_yscale() == "log"


def test_figures_say_which_argument_chooses_nothing_or_is_no_axes():
    f = moit.scenes.load("panes", (16, 12))
    report = moit.compare(f, ["wboit", "power4"], metrics="flip", repeat=1, progress=False)
    for call, names in (
        (moit.plot.images, {"scenes": []}),
        (moit.plot.error_maps, {"scene": []}),
        (moit.plot.error_maps, {"techniques": []}),
        (moit.plot.speed_error, {"scene": []}),
    ):
        with pytest.raises(ValueError, match=f"^{next(iter(names))}: expected at least one, got"):
            call(report, **names)
    with pytest.raises(TypeError, match="ax: expected matplotlib's Axes or None, got int"):
        moit.plot.speed_error(report, ax=3)
    with pytest.raises(TypeError, match="ax: expected matplotlib's Axes or None, got int"):
        moit.plot.curves(f, "power4", ax=3)


def test_a_name_that_has_no_room_says_that_it_goes_on():
    from moit.plot.texts import fitted

    text, _ = fitted("a name of many words that are too many", 0.4, 8.0, 2, ends=True)
    assert text.count("\n") == 1 and text.endswith("…")
    text, _ = fitted("a name of many words that are too many", 0.4, 8.0, 2)
    assert text.count("\n") > 1 and text.endswith("many")
