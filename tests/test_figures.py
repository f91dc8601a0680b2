"""Figures of moit.plot are whole and legible, whatever their names and however many there are."""

import io
import itertools
import re
from functools import cache

import numpy as np
import pytest
from small import some_fragments

import moit
from moit.catalog.palette import most_different, technique_colours, technique_looks
from moit.comparing.charts import curves_chart
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row, Scene
from moit.reports.svg import svg

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.colors import to_hex  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from matplotlib.textpath import TextPath  # noqa: E402

EVERY = [str(one) for one in moit.techniques()]
WITH_CURVE = [str(one) for one in moit.techniques() if one.has_curve and str(one) != "sorted"]
LONG = ["power8(bias=1.5e-07, exclude_self=True)", "a_technique_of_ones_own_" * 3, "$x$ $"]
SHAPES = {
    "panes": (24, 32),
    "a wide one, of /some/folder/with/a/long_name.0001.exr": (11, 60),
    "tall": (48, 12),
    "square": (12, 12),
    "tiny": (1, 1),
}
STYLES = (None, "paper", "paper-double")


@pytest.fixture(autouse=True)
def no_figures_left():
    yield
    pyplot.close("all")


def report_of(count, scenes, seed=0, devices=("cpu",)):
    """A report of so many techniques, some with long names, on so many scenes, with pictures."""
    random = np.random.default_rng(seed)
    names = ["sorted", *[name for name in EVERY + LONG if name != "sorted"][-count:]][:count]
    held, results = {}, []
    for name, shape in list(SHAPES.items())[:scenes]:
        held[name] = Scene(name, shape, 1, 1, random.random((*shape, 4)))
        for technique, device in itertools.product(names, devices):
            row = {"scene": name, "device": device, "technique": technique, "note": ""}
            row |= {"bits_per_pixel": 8.0 * random.integers(1, 30)}
            row |= {"seconds": random.lognormal(-6, 1.0), "flip": random.lognormal(-4, 1.0)}
            results.append(Result(Row(row), random.random((*shape, 4))))
    return Report(results, held, ("flip",))


def texts_of(figure, is_laid_out=False):
    """The texts that are seen, with their boxes in pixels."""
    if not is_laid_out:
        figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    beyond = {
        tick.label1
        for ax in figure.axes
        for axis in (ax.xaxis, ax.yaxis)
        for tick in axis.get_major_ticks()
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    found = [one for one in figure.findobj(Text) if one not in beyond and one.get_visible()]
    seen = [one for one in found if one.get_text().strip()]
    return [(one, one.get_window_extent(renderer)) for one in seen]


def overlap(a, b, spare=0.5):
    across = min(a.x1, b.x1) - max(a.x0, b.x0)
    return across > spare and min(a.y1, b.y1) - max(a.y0, b.y0) > spare


def assert_whole(figure):
    """Nothing is beyond the figure."""
    figure.draw_without_rendering()
    box = figure.get_tightbbox(figure.canvas.get_renderer())
    width, height = figure.get_size_inches()
    assert box.x0 > -0.01 and box.x1 < width + 0.01, box
    assert box.y0 > -0.01 and box.y1 < height + 0.01, box


def assert_legible(figure):
    """It is whole, and no text covers another one or, of titles and legends, what they tell of."""
    assert_whole(figure)
    boxes = texts_of(figure, is_laid_out=True)
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        assert not overlap(a, b), f"{one.get_text()!r} covers {other.get_text()!r}"
    for ax in figure.axes:
        legend = ax.get_legend()
        frame = ax.get_window_extent()
        if legend is not None:
            assert not overlap(legend.get_window_extent(), frame)
        if ax.images:
            assert not any(overlap(box, frame) for one, box in boxes if one.axes is not ax)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(("count", "scenes"), [(2, 1), (6, 5), (20, 1)])
def test_pictures_are_whole(count, scenes, style):
    report = report_of(count, scenes)
    crops = {"panes": [(2, 3, 10, 8), (0, 0, 5, 30), (23, 31, 1, 1)]}
    figure = moit.plot.images(report, crops=crops, style=style)
    assert_legible(figure)
    if style:
        assert figure.get_figwidth() == {"paper": 3.33, "paper-double": 7.0}[style]
    pictures = [ax for ax in figure.axes if ax.images and re.search(": [^,]*$", ax.get_label())]
    lines = -(-(count - 1) // {"paper": 3}.get(style, 6))
    named = [ax for ax in pictures if "the reference" not in ax.get_label()]
    assert len(pictures) - len(named) == lines * scenes
    assert len(named) >= (count - 1 - len(LONG)) * scenes
    for ax in pictures:  # pixels are square
        height, width = ax.images[0].get_array().shape[:2]
        box = ax.get_window_extent()
        assert box.width / box.height == pytest.approx(width / height, rel=1e-6)


def ended(figure, end):
    (found,) = (ax for ax in figure.axes if ax.get_label().endswith(end))
    return found


def test_pictures_crops_and_maps_are_the_reports():
    report = report_of(3, 2)
    wide = next(name for name in SHAPES if "wide" in name)
    crops = {"panes": [(2, 3, 10, 8), (20, 0, 4, 32)], wide: (1, 2, 3, 4)}
    figure = moit.plot.images(report, crops=crops)
    for scene in ("panes", wide):
        exact = report.scenes[scene].reference
        for result in [None, *report.of_scene(scene)[1:]]:
            image = exact if result is None else result.image
            name = "the reference" if result is None else result.row["technique"]
            pixels = moit.show(image[..., :3]).pixels[0]
            picture = ended(figure, f"{scene}: {name}")
            assert np.array_equal(picture.images[0].get_array(), pixels)
            given = crops[scene] if scene == "panes" else [crops[scene]]
            colours = set()
            for i, (y, x, height, width) in enumerate(given):
                inset = ended(figure, f"{scene}: {name}, crop {i + 1}")
                shown = inset.images[0].get_array()
                assert np.array_equal(shown, pixels[y : y + height, x : x + width])
                frame = picture.patches[i]
                assert frame.get_xy() == (x - 0.5, y - 0.5)
                assert (frame.get_width(), frame.get_height()) == (width, height)
                colour = to_hex(frame.get_edgecolor())
                assert to_hex(inset.spines["left"].get_edgecolor()) == colour
                box = inset.get_window_extent()
                assert box.width / box.height == pytest.approx(width / height, rel=1e-6)
                colours.add(colour)
            assert len(colours) == len(given)
            if result is not None:
                shown = ended(figure, f"{scene}: {name}, FLIP").images[0]
                assert np.array_equal(shown.get_array(), moit.metrics.flip_map(image, exact))
                assert shown.get_clim() == (0, 1)
                words = [one.get_text() for one, _ in texts_of(figure)]
                assert f"FLIP {result.row['flip']:.4f}" in words


def test_pictures_are_as_bright_as_is_asked_for():
    report = report_of(2, 1)
    figure = moit.plot.images(report, errors=False, exposure=2, tone="reinhard")
    exact = report.scenes["panes"].reference
    expected = moit.show(exact[..., :3], exposure=2, tone="reinhard").pixels[0]
    assert np.array_equal(figure.axes[0].images[0].get_array(), expected)


def test_errors_that_the_report_lacks_are_measured():
    report = report_of(2, 1)
    figure = moit.plot.images(report, metric="rmse", errors=False)
    result = report.of_scene("panes")[1]
    error = moit.metrics.rmse(result.image, report.scenes["panes"].reference)
    assert f"RMSE {error:.4f}" in [one.get_text() for one, _ in texts_of(figure)]
    assert not any("RMSE" in ax.get_label() for ax in figure.axes)


def test_scenes_and_techniques_stand_in_the_order_that_is_asked_for():
    report = report_of(50, 3)
    asked = ["mboit4", "wboit-eq8", moit.technique("power6")]
    figure = moit.plot.images(report, ["tall", "panes"], asked, errors=False)
    labels = [ax.get_label() for ax in figure.axes]
    names = ("the reference", "power4", "wboit-eq8", "power6")
    assert labels == [f"{scene}: {name}" for scene in ("tall", "panes") for name in names]
    left = [ax.get_window_extent().x0 for ax in figure.axes[:4]]
    assert left == sorted(left)
    assert figure.axes[0].get_window_extent().y0 > figure.axes[4].get_window_extent().y1


def test_fifty_pictures_are_whole():
    assert_whole(moit.plot.images(report_of(50, 1), style="paper-double", columns=8))


def test_what_has_no_picture_says_so():
    report = report_of(3, 2)
    report.results[4] = Result(report.results[4].row)
    figure = moit.plot.images(report)
    assert_legible(figure)
    assert "no picture" in [one.get_text() for one, _ in texts_of(figure)]


def test_small_pictures_have_no_errors():
    report = report_of(2, 5)
    figure = moit.plot.images(report, "tiny")
    assert_legible(figure)
    words = " ".join(one.get_text() for one, _ in texts_of(figure))
    assert "too small for FLIP" in words.replace("\n", " ")


def test_devices_have_pictures_of_their_own():
    report = report_of(2, 1, devices=("cpu", "gpu"))
    name = report.results[-1].row["technique"]
    figure = moit.plot.images(report, errors=False)
    shown = ended(figure, f": {name}, gpu").images[0].get_array()
    assert np.array_equal(shown, moit.show(report.results[-1].image[..., :3]).pixels[0])


@pytest.mark.parametrize(
    ("crops", "error"),
    [
        ((0, 0, 25, 4), ValueError),
        ((0, 29, 4, 4), ValueError),
        ((-1, 0, 4, 4), ValueError),
        ((0, 0, 0, 4), ValueError),
        ([(0, 0, 2, 2)] * 5, ValueError),
        ({"three": (0, 0, 2, 2)}, ValueError),
        ((0, 0, 4), TypeError),
        ((0, 0, 4.0, 4), TypeError),
        ([(0, 0, 2, 2), 3], TypeError),
        ("panes", TypeError),
        (3, TypeError),
    ],
)
def test_bad_crops_are_named(crops, error):
    with pytest.raises(error, match="crops"):
        moit.plot.images(report_of(2, 1), crops=crops)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"scenes": "three"}, "scenes"),
        ({"scenes": 3}, "scenes"),
        ({"techniques": ["power5"]}, "techniques"),
        ({"techniques": 3}, "techniques"),
        ({"metric": "ssim"}, "metric"),
        ({"errors": 1}, "errors"),
        ({"columns": 0}, "columns"),
        ({"exposure": "bright"}, "exposure"),
        ({"tone": "dark"}, "tone"),
        ({"style": "poster"}, "style"),
    ],
)
def test_bad_arguments_are_named(arguments, word):
    with pytest.raises((TypeError, ValueError), match=rf"^{word}"):
        moit.plot.images(report_of(2, 1), **arguments)
    if word == "style":
        for draw in (moit.plot.speed_error, moit.plot.error_maps):
            with pytest.raises(ValueError, match="style"):
                draw(report_of(2, 1), **arguments)


def test_a_report_without_pictures_is_told():
    report = report_of(2, 1)
    with pytest.raises(ValueError, match="no images of 'panes'"):
        moit.plot.images(Report([Result(one.row) for one in report.results], report.scenes))
    with pytest.raises(ValueError, match="no rows"):
        moit.plot.images(Report([]))
    with pytest.raises(TypeError, match="report"):
        moit.plot.images("report.json")


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("count", [2, 20])
def test_maps_are_whole_and_beside_their_pictures(count, style):
    report = report_of(count, 1)
    axes = moit.plot.error_maps(report, columns=3, style=style)
    assert axes.shape == (-(-count // 3), min(count, 3))
    figure = axes[0, 0].figure
    assert_legible(figure)
    for ax in axes.flat[:count]:
        picture = ended(figure, ax.get_label().removesuffix(", FLIP"))
        above, below = picture.get_window_extent(), ax.get_window_extent()
        assert (above.x0, above.x1) == pytest.approx((below.x0, below.x1))
        assert above.y0 > below.y1


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("count", [1, 2, 6, 12, 20])
def test_curves_have_a_legend_beside_them(count, style):
    names = WITH_CURVE[:count]
    ax = moit.plot.curves(some_fragments(), names, style=style)
    assert_legible(ax.figure)
    shown = names[:12]
    assert [line.get_label() for line in ax.lines] == [*shown, "exact"]
    looks = technique_looks(shown)
    assert [to_hex(line.get_color()) for line in ax.lines[:-1]] == [look.colour for look in looks]
    patterns = {line.get_linestyle() + str(line._dash_pattern) for line in ax.lines[:-1]}
    assert len(patterns) == len({look.line for look in looks})
    told = [one.get_text().replace("\n", "") for one in ax.get_legend().get_texts()]
    assert told == [*shown, "exact", *(["and 8 more, not drawn"] if count == 20 else [])]


def test_more_curves_are_drawn_where_they_are_asked_for():
    ax = moit.plot.curves(some_fragments(), WITH_CURVE, most=99)
    assert len(ax.lines) == len(WITH_CURVE) + 1
    assert_legible(ax.figure)
    with pytest.raises(ValueError, match="most"):
        moit.plot.curves(some_fragments(), "power4", most=0)


@pytest.mark.parametrize("layout", ["constrained", "tight"])
def test_panels_of_a_figure_keep_their_legends_apart(layout):
    figure, axes = pyplot.subplots(1, 3, figsize=(10, 3), layout=layout)
    for ax in axes:
        moit.plot.curves(some_fragments(), ["power4", "trig3", LONG[0]], ax=ax)
    assert_legible(figure)
    assert figure.get_size_inches() == pytest.approx((10, 3))


def test_a_legend_can_be_left_to_another_figure():
    report = report_of(4, 1)
    assert moit.plot.curves(some_fragments(), "power4", legend=False).get_legend() is None
    assert moit.plot.speed_error(report, legend=False).get_legend() is None
    with pytest.raises(TypeError, match="legend"):
        moit.plot.speed_error(report, legend="below")


def test_without_a_layout_the_legend_is_within_the_axes():
    figure, ax = pyplot.subplots(figsize=(4, 3))
    moit.plot.curves(some_fragments(), ["power4", "trig3"], ax=ax)
    legend, frame = ax.get_legend().get_window_extent(), ax.get_window_extent()
    assert frame.x0 < legend.x0 and legend.x1 < frame.x1
    assert frame.y0 < legend.y0 and legend.y1 < frame.y1
    assert figure.get_size_inches() == pytest.approx((4, 3))


@pytest.mark.parametrize("by", ["seconds", "bits"])
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(("count", "scenes"), [(2, 1), (50, 1), (20, 5)])
def test_errors_over_costs_are_legible(count, scenes, style, by):
    report = report_of(count, scenes)
    ax = moit.plot.speed_error(report, by=by, style=style)
    assert_legible(ax.figure)
    marked = [line for line in ax.lines if line.get_marker() != "None"]
    assert len(marked) == count * scenes
    names = list(dict.fromkeys(row["technique"] for row in report.rows))
    colours = dict(zip(names, technique_colours(names), strict=True))
    found = [to_hex(line.get_markeredgecolor()) for line in marked]
    assert found == [colours[row["technique"]] for row in report.rows]


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("spread", [0.0, 0.1, 1.0, 3.0, 9.0])
def test_times_have_ticks_with_room_between_them(spread, style):
    report = report_of(6, 1)
    for i, row in enumerate(report.rows):
        row["seconds"] = 0.01 * 10 ** (spread * (i - 2.5) / 5)
    ax = moit.plot.speed_error(report, style=style)
    assert_legible(ax.figure)
    low, high = ax.get_xlim()
    seen = [tick for tick in ax.get_xticks() if low <= tick <= high]
    assert len(seen) >= (2 if spread else 1)
    if spread == 1:
        assert "10 ms" in [one.get_text() for one in ax.get_xticklabels()]


def labelled(ax):
    from moit.reports.labels import Labels

    (labels,) = (one for one in ax.get_children() if isinstance(one, Labels))
    return {name for name, _, _ in labels.labels}


def test_many_names_are_those_of_the_front_and_what_is_asked_for():
    report = report_of(50, 1)
    front = {row["technique"] for row in report.pareto()}
    assert labelled(moit.plot.speed_error(report)) == front
    asked = ["mboit4", "hashed-alpha"]
    shown = labelled(moit.plot.speed_error(report, labels=asked))
    assert shown == front | {"power4", "hashed-alpha"}
    assert len(labelled(moit.plot.speed_error(report_of(6, 1)))) == 6
    with pytest.raises(ValueError, match=r"^labels"):
        moit.plot.speed_error(report, labels="power5")


def test_the_legend_names_families_and_scenes():
    ax = moit.plot.speed_error(report_of(50, 2))
    told = [one.get_text().replace("\n", "") for one in ax.get_legend().get_texts()]
    assert told[:2] == list(SHAPES)[:2]
    assert {"exact", "power, neural", "layers"} <= set(told[2:])
    assert len(told) == len(set(told))


@cache
def stability():
    return moit.stability(["power4", "power8(exclude_self=True)"], rays=1, progress=False)


@pytest.mark.parametrize("style", STYLES)
def test_dials_are_whole(style):
    axes = moit.plot.stability(stability(), style=style)
    assert axes.shape[1] == (1 if style == "paper" else 3)
    assert_legible(axes[0, 0].figure)


DRAWN = {
    "images": lambda: moit.plot.images(report_of(4, 1), style="paper"),
    "error_maps": lambda: moit.plot.error_maps(report_of(4, 1))[0, 0].figure,
    "speed_error": lambda: moit.plot.speed_error(report_of(4, 1)).figure,
    "curves": lambda: moit.plot.curves(some_fragments(), "power4", style="paper").figure,
}


@pytest.mark.parametrize("figure", DRAWN)
def test_files_hold_texts_and_their_fonts(figure):
    drawn = DRAWN[figure]()
    pdf, vectors, png = io.BytesIO(), io.StringIO(), io.BytesIO()
    drawn.savefig(pdf, format="pdf")
    drawn.savefig(vectors, format="svg")
    drawn.savefig(png, format="png")
    assert b"/Type3" not in pdf.getvalue() and b"/FontFile2" in pdf.getvalue()
    texts = re.findall("<text[^>]*>([^<]*)", vectors.getvalue())
    for one, _ in texts_of(drawn):
        for line in one.get_text().split("\n"):
            assert line in texts
    if figure == "speed_error":
        assert {"sorted", LONG[0]} <= {one.replace("&lt;", "<") for one in texts}
    paper = DRAWN["images"]()
    assert matplotlib.rcParams["pdf.fonttype"] == 3  # what others set is theirs
    assert paper.get_figwidth() == 3.33


def test_files_have_the_names_and_formats_that_matplotlib_gives_them(tmp_path):
    drawn = DRAWN["curves"]()
    drawn.savefig(tmp_path / "a.svg")
    drawn.savefig(str(tmp_path / "b"))
    drawn.savefig(tmp_path / "c.d", format="pdf")
    begins = {one.name: one.read_bytes()[:5] for one in tmp_path.iterdir()}
    assert begins == {"a.svg": b"<?xml", "b.png": b"\x89PNG\r", "c.d": b"%PDF-"}
    with pytest.raises(ValueError, match="nothing"):
        drawn.savefig(tmp_path / "a.nothing")
    assert len(list(tmp_path.iterdir())) == 3


def test_settings_that_others_make_stay():
    """The first figure of a session lets Jupyter set matplotlib up, and that must not be undone."""
    from moit.plot.style import STYLES, settings

    before = matplotlib.rcParams["font.size"], matplotlib.is_interactive()
    try:
        with settings(STYLES["paper"]):
            assert matplotlib.rcParams["font.size"] == 8
            matplotlib.interactive(not before[1])
        assert (matplotlib.rcParams["font.size"], matplotlib.is_interactive()) == (
            before[0],
            not before[1],
        )
    finally:
        matplotlib.interactive(before[1])


def test_pictures_stand_where_they_should_whatever_layout_others_set():
    with matplotlib.rc_context({"figure.constrained_layout.use": True}):
        figure = moit.plot.images(report_of(2, 1))
        assert figure.get_layout_engine() is None
        assert_legible(figure)


def test_one_of_each_family_comes_before_a_second_one():
    names = ["power4", "power6", "power8", "trig2", "trig3", "mlab4"]
    assert most_different(names, 3) == ["power4", "trig2", "mlab4"]
    assert most_different(names, 4) == ["power4", "power6", "trig2", "mlab4"]
    assert most_different(names, 9) == names


@pytest.mark.parametrize("names", [WITH_CURVE[:6], WITH_CURVE, LONG, ["m" * 200]])
def test_vectors_of_curves_are_as_large_as_their_legend(names):
    depth = np.linspace(1, 10, 20)
    text = svg(curves_chart(depth, depth, [(name, depth) for name in names]), (760, 360), True)
    width, height = map(float, re.search(r'viewBox="0 0 (\d+) (\d+)"', text).groups())
    seen = re.findall(r'<text x="([\d.]+)" y="([\d.]+)"([^>]*)>([^<]*)<', text)
    assert len(seen) > len(names)
    for x, y, more, words in seen:
        long = TextPath((0, 0), words.replace("$", r"\$"), size=10).get_extents().width
        ends = float(x) + (long if "anchor" not in more else long / 2 if "middle" in more else 0)
        assert ends <= width and float(y) <= height - 2, words
