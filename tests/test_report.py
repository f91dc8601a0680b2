"""Report: the same numbers as text, CSV, JSON and on one page; the Pareto front."""

import base64
import csv
import json
import math
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from small import some_fragments

import moit
from moit.comparing.page import map_range
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row, from_plain, plain
from moit.comparing.tables import best_rows
from moit.reports.charts import CurveChart, ErrorChart, Point, Series, nice_ticks
from moit.reports.columns import heading, number, shown
from moit.reports.pictures import error_palette, image_png, map_png, png, shrunk, srgb8
from moit.reports.svg import standalone, svg

NASTY = "<script>alert('1 & 2')</script>\"x"


def failing(depth, alpha, color):
    raise RuntimeError(NASTY)


@pytest.fixture(scope="module")
def report():
    scenes = {"one": some_fragments(), NASTY: some_fragments(20, 16, seed=2)}
    techniques = [*moit.techniques(), moit.WeightedBlended(failing)]
    return moit.compare(scenes, techniques, repeat=1, progress=False)


def made(rows):
    """A report of rows given as (scene, technique, seconds, bits, flip)."""
    names = ("scene", "technique", "seconds", "bits_per_pixel", "flip")
    filled = [
        Row(dict(zip(names, row, strict=True)), device="cpu", note="", seconds_iqr=0.0, psnr=1.0)
        for row in rows
    ]
    return Report([Result(row) for row in filled], metrics=("flip", "psnr"))


def test_csv_holds_every_field_exactly(report, tmp_path):
    report.to_csv(tmp_path / "r.csv")
    with open(tmp_path / "r.csv", newline="") as file:
        read = list(csv.DictReader(file))
    assert list(read[0]) == list(report.columns)
    for fields, row in zip(read, report.rows, strict=True):
        for name, text in fields.items():
            value = row[name]
            if value is None:
                assert text == ""
            elif isinstance(value, float):
                assert float(text) == value
            else:
                assert text == str(value)


def test_json_is_strict_and_holds_every_field_exactly(report, tmp_path):
    report.to_json(tmp_path / "r.json")

    def refuse(constant):
        raise AssertionError(constant)

    content = json.loads((tmp_path / "r.json").read_text(), parse_constant=refuse)
    assert [from_plain(row) for row in content["rows"]] == report.rows
    assert content["reference"] == "sorted"
    assert content["metrics"] == list(report.metrics)
    assert content["machine"] == report.machine


def test_infinity_and_nan_come_back_from_json():
    row = Row(scene="inf", technique="nan", note="-inf", psnr=math.inf, flip=math.nan, mse=None)
    back = from_plain(json.loads(json.dumps(plain(row), allow_nan=False)))
    assert back["psnr"] == math.inf and math.isnan(back["flip"]) and back["mse"] is None
    assert (back["scene"], back["technique"], back["note"]) == ("inf", "nan", "-inf")


def test_text_is_an_aligned_table(report):
    lines = str(report).splitlines()
    rules = lines[1]
    edges = [m.end() for m in re.finditer(r"-+", rules)][:-1]
    for line in lines:
        assert all(line[edge : edge + 2].strip() == "" for edge in edges)
    filled = [line for line in lines[2:] if line]
    assert len(filled) == len(report.rows)
    for line, row in zip(filled, report.rows, strict=True):
        assert row["technique"] in line
    assert len(lines) - 2 - len(filled) == 1  # a blank line between the two scenes


@pytest.mark.parametrize(
    ("column", "value", "text"),
    [
        ("seconds", 0.0125, "12.50"),
        ("seconds_iqr", 0.00025, "0.2500"),
        ("fragments_per_second", 2.5e7, "25.00"),
        ("bits_per_pixel", 160, "160"),
        ("bits_per_pixel", None, "-"),
        ("paper_bits_per_pixel", 12.3125, "12.3125"),
        ("dial", 1e-7, "1e-07"),
        ("first_ms", 12.5, "12.50"),
        ("nan", 3, "3"),
        ("flip", 0.123456, "0.1235"),
        ("flip", 0.00012345, "1.23e-4"),
        ("psnr", math.inf, "inf"),
        ("T_max", 0.0, "0"),
        ("note", "why", "why"),
    ],
)
def test_fields_are_shown_in_the_unit_of_their_column(column, value, text):
    assert shown(column, value) == text


def test_numbers_have_four_digits_or_three():
    values = (0.99996, 9.9996, 99999.6, 123456.0, 0.001, 0.00099999, -2.5, 1e-300)
    assert [number(value) for value in values] == [
        *("1.000", "10.00", "1.00e5", "1.23e5", "0.001000", "0.001000", "-2.500", "1.00e-300")
    ]
    assert [number(value, 3) for value in (0.5, 0.12345, 1234.5)] == ["0.5", "0.123", "1.23e+03"]


def test_headings_say_units():
    assert heading("seconds") == "ms" and heading("seconds", as_field=True) == "ms"
    assert heading("fragments_per_second") == "Mfrag/s"
    assert heading("T_mae") == "T mae" and heading("T_mae", as_field=True) == "T_mae"
    assert heading("flip") == "flip"


def test_the_best_of_a_column_is_the_least_or_the_greatest_and_not_the_reference():
    rows = [
        Row(technique="sorted", flip=0.0, psnr=math.inf, seconds=1.0),
        Row(technique="a", flip=0.1, psnr=30.0, seconds=2.0),
        Row(technique="b", flip=0.1, psnr=40.0, seconds=3.0),
        Row(technique="c", flip=None, psnr=math.nan, seconds=4.0),
    ]
    assert best_rows(rows, "flip", "sorted") == {1, 2}
    assert best_rows(rows, "psnr", "sorted") == {2}
    assert best_rows(rows, "seconds", "sorted") == {0}
    assert best_rows(rows[3:], "flip", "sorted") == set()


def test_maps_have_a_round_range_that_few_pixels_exceed():
    def most(value):
        return map_range([np.full(10, value / 3), np.full(10, value)])

    assert [most(x) for x in (0.0, 0.3, 0.011, 0.05, 0.9, 3.0)] == [
        *(1.0, 0.5, pytest.approx(0.02), pytest.approx(0.05), 1.0, 1.0)
    ]
    one = np.zeros(10000)
    one[0] = 0.9
    assert map_range([one]) == 1.0  # of the error that all but a thousandth stay below, none


def test_notes_are_in_the_text(report):
    assert "RuntimeError" in str(report)
    assert "note" not in str(made([("a", "x", 1.0, 1, 0.1)])).splitlines()[0]


def test_repr_is_one_line(report):
    count = len(moit.techniques()) + 1
    assert repr(report) == f"Report({2 * count} rows: 2 scenes, {count} techniques)"


def test_notebooks_show_a_table_without_markup_of_others(report):
    html = report._repr_html_()
    assert html.count("<tr>") == len(report.rows) + 1
    assert "<script" not in html


def test_fields_read_as_attributes(report):
    row = report.rows[0]
    assert row.technique == row["technique"] == "sorted"
    with pytest.raises(AttributeError, match="flap"):
        row.flap  # noqa: B018


def test_nothing_beats_a_row_of_the_front_and_something_beats_all_others(report):
    for metric in (*report.metrics, "T_mae", "T_p99", "T_max"):
        sign = -1 if metric in ("psnr", "ssim") else 1
        for by, cost in (("seconds", "seconds"), ("bits", "bits_per_pixel")):
            front = report.pareto(metric, by)
            assert front
            for row in report.rows:
                if row[cost] is None or row[metric] is None:
                    assert not any(row is one for one in front)
                    continue
                beaten = any(
                    other[cost] <= row[cost]
                    and sign * other[metric] <= sign * row[metric]
                    and (other[cost] < row[cost] or sign * other[metric] < sign * row[metric])
                    for other in report.rows
                    if other["scene"] == row["scene"]
                    and other[cost] is not None
                    and other[metric] is not None
                )
                # Of rows equal in both the first stands for all.
                assert not beaten if any(row is one for one in front) else True
                if not any(row is one for one in front):
                    assert beaten or any(
                        one[cost] == row[cost] and one[metric] == row[metric] for one in front
                    )


def test_the_front_is_per_scene_and_cheapest_first():
    report = made(
        [
            ("a", "slow", 3.0, 1, 0.1),
            ("a", "fast", 1.0, 2, 0.5),
            ("a", "bad", 2.0, 3, 0.6),
            ("b", "only", 9.0, 1, 0.9),
            ("b", "unknown", None, 1, None),
        ]
    )
    assert [row["technique"] for row in report.pareto()] == ["fast", "slow", "only"]
    assert [row["technique"] for row in report.pareto(by="bits")] == ["slow", "only"]


@pytest.mark.parametrize(
    ("arguments", "words"), [({"metric": "flop"}, "flip"), ({"by": "watts"}, "'seconds' or 'bits'")]
)
def test_unknown_errors_and_costs_are_named(report, arguments, words):
    with pytest.raises(ValueError, match=words):
        report.pareto(**arguments)


class Page(HTMLParser):
    """What a page refers to and shows, and that its elements are closed in order."""

    EMPTY = ("meta", "img", "br", "path", "circle", "link")

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.values, self.tags, self.text = [], [], set(), [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in self.EMPTY:
            self.open.append(tag)
        for name, value in attributes:
            if name in ("src", "href"):
                self.sources.append(value)
            if name == "data-value":
                self.values.add(value)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.EMPTY:
            assert self.open.pop() == tag

    def handle_data(self, text):
        self.text.append(text)


@pytest.fixture(scope="module")
def page(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "r.html"
    report.to_html(path, title=NASTY)
    return path.read_text(encoding="utf-8")


def test_the_page_has_the_numbers_of_the_csv(report, page, tmp_path):
    report.to_csv(tmp_path / "r.csv")
    values = Page(page).values
    with open(tmp_path / "r.csv", newline="") as file:
        for fields in csv.DictReader(file):
            for name, text in fields.items():
                if name not in ("device", "note"):
                    assert text in values, (name, text)


def test_the_page_needs_no_other_file(page):
    found = Page(page)
    assert found.sources
    for source in found.sources:
        assert source.startswith(("data:image/png;base64,", "#"))
    assert "@import" not in page and "url(" not in page
    assert re.findall(r"https?://[^\"'<\s]*", page) == ["http://www.w3.org/2000/svg"] * page.count(
        "<svg "
    )


def test_the_page_escapes_what_it_is_given(page):
    assert Page(page).tags.count("script") == 1  # its own
    assert NASTY not in page
    assert "alert('1 & 2')" in "".join(Page(page).text)


def test_the_page_has_images_maps_curves_and_plots(report, page):
    images = sum(result.image is not None for result in report.results)
    # Each technique's image and map; each scene's reference, and the scale of its maps.
    assert page.count("data:image/png") == 2 * images + 2 * len(report.scenes)
    assert page.count('class="exact"') == sum(len(s.pixels) for s in report.scenes.values())
    assert page.count("flip against") == 2 * len(report.scenes)  # time and bits


def test_a_page_without_images_or_scenes_is_a_page(tmp_path):
    made([("a", "x", 1.0, 8, 0.1), ("a", "y", None, None, None)]).to_html(tmp_path / "r.html")
    Page((tmp_path / "r.html").read_text())
    Report([]).to_html(tmp_path / "none.html")
    Page((tmp_path / "none.html").read_text())


@pytest.mark.parametrize("size", [(0, 5), (1, 1), (3, 40)])
def test_small_images_have_a_page(size, tmp_path):
    report = moit.compare(some_fragments(*size), ["sorted", "power4"], repeat=1, progress=False)
    report.to_html(tmp_path / "r.html")
    Page((tmp_path / "r.html").read_text())


def test_a_failed_write_leaves_the_old_file(report, tmp_path, monkeypatch):
    path = tmp_path / "r.json"
    path.write_text("old")
    with monkeypatch.context() as patch:
        patch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
        with pytest.raises(OSError, match="disk full"):
            report.to_json(path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["r.json"]


# Pictures


def unfiltered(file):
    """The bytes of a PNG's rows, by the standard and not by how the file was written."""
    assert file[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, {}
    while at < len(file):
        length = int.from_bytes(file[at : at + 4], "big")
        name, content = file[at + 4 : at + 8], file[at + 8 : at + 8 + length]
        crc = int.from_bytes(file[at + 8 + length : at + 12 + length], "big")
        assert crc == zlib.crc32(name + content)
        chunks[name] = content
        at += 12 + length
    width, height = (int.from_bytes(chunks[b"IHDR"][i : i + 4], "big") for i in (0, 4))
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, -1)
    above = np.zeros(rows.shape[1] - 1, np.uint8)
    result = []
    for row in rows:
        assert row[0] in (0, 2)
        above = row[1:] + above if row[0] == 2 else row[1:]
        result.append(above)
    return np.array(result).reshape(height, width, -1), chunks


def test_png_keeps_every_byte():
    pixels = np.random.default_rng(0).integers(0, 256, (7, 5, 3), np.uint8)
    read, _ = unfiltered(png(pixels))
    assert np.array_equal(read, pixels)
    indices = pixels[..., 0]
    read, chunks = unfiltered(png(indices, error_palette()))
    assert np.array_equal(read[..., 0], indices)
    assert chunks[b"PLTE"] == error_palette().tobytes()


def test_page_images_are_srgb_and_no_wider_than_asked():
    linear = np.full((10, 30, 4), 0.2140411)  # the linear value of sRGB 0.5
    read, _ = unfiltered(image_png(linear, 15))
    assert read.shape == (5, 15, 3)
    assert set(np.unique(read)) <= {127, 128}
    read, _ = unfiltered(map_png(np.ones((4, 6)), 99))
    assert read.shape == (4, 6, 1) and (read == 255).all()


def test_shrinking_keeps_the_mean():
    values = np.random.default_rng(1).random((12, 20, 3))
    assert shrunk(values, 4, 5).mean() == pytest.approx(values.mean())
    assert np.array_equal(shrunk(values, 12, 20), values)
    assert shrunk(values, 5, 7).shape == (5, 7, 3)


def test_error_colours_get_lighter_step_by_step():
    palette = error_palette() / 255.0
    linear = np.where(palette <= 0.04045, palette / 12.92, ((palette + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > -1e-3).all()  # but for rounding to bytes
    assert luminance[0] < 0.01 and luminance[-1] > 0.85


def test_srgb_is_clipped():
    assert srgb8(np.array([[[-1.0, 0.0, 7.0]]])).tolist() == [[[0, 0, 255]]]


# Charts


def test_charts_escape_names_and_are_files_of_their_own():
    depth = np.linspace(1, 2, 9)
    series = [Series(NASTY, np.full(9, np.nan), "#123456", "0")]
    chart = svg(CurveChart(depth, series, depth * 0), (600, 260), legend=True)
    points = [Point(NASTY, 1.0, 0.5, "#123456", "0", True)]
    other = svg(ErrorChart(points, "s", "flip"), (600, 320))
    import xml.etree.ElementTree

    for one in (standalone(chart), standalone(other)):
        xml.etree.ElementTree.fromstring(one)
        assert NASTY not in one


@pytest.mark.parametrize(
    "points",
    [
        [],
        [(0.0, 0.0)],
        [(1e-6, 1e-300), (1e6, 1.0)],
        [(1.0, 0.5)] * 30,
        [(math.inf, 1.0), (1.0, math.nan), (2.0, 0.1)],
    ],
)
def test_charts_take_whatever_was_measured(points):
    import xml.etree.ElementTree

    given = [Point(f"t{i}", x, y, "#000000", str(i), i % 2 == 0) for i, (x, y) in enumerate(points)]
    root = xml.etree.ElementTree.fromstring(svg(ErrorChart(given, "x", "y"), (600, 320)))
    numbers = re.findall(r"-?\d+\.\d+", xml.etree.ElementTree.tostring(root, encoding="unicode"))
    assert all(-50 < float(number) < 1000 for number in numbers)


@pytest.mark.parametrize(("low", "high"), [(0, 1), (0.0021, 0.0043), (-3e7, 5e9), (5, 5)])
def test_ticks_are_few_round_and_inside(low, high):
    ticks = nice_ticks(low, high)
    assert 1 <= len(ticks) <= 8
    assert all(low - 1e-9 * abs(low) <= tick <= high * (1 + 1e-9) for tick in ticks)


def test_page_pictures_are_readable_by_others(page, tmp_path):
    first = re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)", page)[1]
    (tmp_path / "x.png").write_bytes(base64.b64decode(first))
    assert moit.read_image(tmp_path / "x.png").shape == (24, 32, 3)
