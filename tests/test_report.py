"""Report: the same numbers as text, CSV, JSON and on one page; the Pareto front."""

import csv
import json
import math
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest
from reports_made import NASTY, made, of_everything

import moit
from moit.catalog.palette import Look
from moit.comparing.error_maps import map_range
from moit.comparing.rows import Row, from_plain, plain
from moit.comparing.tables import best_rows, full_table
from moit.reports.charts import CurveChart, ErrorChart, Point, Series, nice_ticks
from moit.reports.columns import heading, number, plain_number, shown
from moit.reports.pictures import (
    error_palette,
    image_png,
    map_png,
    png,
    shrunk,
    size_within,
    srgb,
    srgb8,
)
from moit.reports.svg import standalone, svg
from moit.reports.tables import Cell, Table, html_table, markdown_table, text_table


@pytest.fixture(scope="module")
def report():
    return of_everything()


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
    replace(report, reference="power8").to_json(tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text())["reference"] == "power8"
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
    told = [number(value, 3) for value in (0.5, 0.12345, 1234.5, 0.00012345)]
    assert told == ["0.5", "0.123", "1.23e+03", "1.23e-4"]


def test_plain_numbers_keep_their_zeros_and_have_no_exponent():
    told = [plain_number(value) for value in (0.5, 0.12345, 1234.5, 0.00012345, 0.099996, 20.0)]
    assert told == ["0.500", "0.123", "1230", "0.000123", "0.100", "20.0"]
    assert [plain_number(value) for value in (0.0, 2e-7, -2e-7, math.inf)] == [
        *("0", "<0.0001", ">-0.0001", "inf")
    ]
    assert plain_number(0.0198, 2) == "0.020"


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


TABLE = Table(
    ["name", "n"],
    [["a|b", Cell("1", "1.25", "#123456", "why <", True)], ["c", "22"], ["d", "3"]],
    [True, False],
    groups=["x", "x", "y"],
    hints=["", "how many"],
    keys=["k1", "k2", "k3"],
)


def test_words_are_to_the_left_and_numbers_to_the_right():
    assert text_table(TABLE) == "name   n\n----  --\na|b    1\nc     22\n\nd      3"
    rows = ["| name | n |", "| :-- | --: |", r"| a\|b | **1** |", "| c | 22 |", "| d | 3 |"]
    assert markdown_table(TABLE).splitlines() == rows
    padded = [
        "| name | n     |",
        "| :--- | ----: |",
        r"| a\|b | **1** |",
        "| c    | 22    |",
        "| d    | 3     |",
    ]
    assert markdown_table(TABLE, padded=True).splitlines() == padded


def test_a_table_of_html_says_what_is_sorted_by_best_and_begins_a_group():
    left, right = ' style="text-align:left"', ' style="text-align:right"'
    written = html_table(TABLE)
    assert f'<th{right} title="how many"><button>n</button></th>' in written
    first, second, third = re.findall(r"<tr.*?</tr>", written)[1:]
    assert first == (
        f'<tr data-key="k1"><td{left}>a|b</td><td{right} data-value="1.25" title="1.25">'
        '<span class="dot" style="background:#123456"></span>1'
        '<div class="note">why &lt;</div></td></tr>'
    )
    assert second == f'<tr data-key="k2"><td{left}>c</td><td{right}>22</td></tr>'
    assert third == f'<tr class=first data-key="k3"><td{left}>d</td><td{right}>3</td></tr>'
    page = html_table(TABLE, page=True)
    assert '<td class="word">a|b</td><td class="best" data-value="1.25"' in page
    assert '<td class="word">c</td><td>22</td>' in page


def test_lines_that_are_listed_stand_for_the_table_in_a_terminal():
    assert text_table(replace(TABLE, listed=["one", "two"])) == "one\ntwo"


def test_the_short_table_leaves_out_what_a_terminal_has_no_room_for(report):
    heads = str(report).splitlines()[0].split()
    assert not {"mse", "mae", "device"} & set(heads) and {"flip", "T_max", "note"} <= set(heads)
    assert "± ms" not in str(report)


def test_notes_stand_once_below_the_techniques_that_they_are_of():
    rows = made([("a", name, 1.0, 1, 0.5) for name in "uvw"])
    for row, note in zip(rows.rows, ("one", "one", "two"), strict=True):
        row["note"] = note
    table = full_table(rows, dict.fromkeys("uvw", Look("#000000", "solid")))
    at = table.heads.index("technique")
    assert [row[at].note for row in table.cells] == ["one", "", "two"]
    seconds = table.heads.index("ms")
    assert all(row[seconds].best for row in table.cells)


def test_notes_are_in_the_text(report):
    assert "RuntimeError" in str(report)
    assert "note" not in str(made([("a", "x", 1.0, 1, 0.1)])).splitlines()[0]


def test_repr_is_one_line(report):
    count = len(moit.techniques()) + 1
    assert repr(report) == f"Report({2 * count} rows: 2 scenes, {count} techniques)"


def test_notebooks_show_a_table_without_markup_of_others(report):
    shown = report._repr_html_()
    assert shown.count("<tr>") == len(report.rows) + 1
    assert "<script" not in shown


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


def test_the_front_is_per_device():
    report = made([("a", "slow", 2.0, 1, 0.5), ("a", "fast", 1.0, 1, 0.25)])
    report.rows[1]["device"] = "gpu"
    assert [row["technique"] for row in report.pareto()] == ["slow", "fast"]


def test_flip_is_what_is_shown_where_there_is_one():
    report = made([("a", "x", 1.0, 1, 0.5)])
    assert replace(report, metrics=("psnr", "flip")).main_metric() == "flip"
    report.rows[0]["flip"] = None
    assert replace(report, metrics=("flip", "psnr")).main_metric() == "psnr"
    report.rows[0].update(psnr=None, T_mae=0.5)
    assert report.main_metric() == "T_mae"


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
    ("arguments", "words"), [({"metric": "flop"}, "flip"), ({"by": "watts"}, "'bits' or 'gpu'")]
)
def test_unknown_errors_and_costs_are_named(report, arguments, words):
    with pytest.raises(ValueError, match=words):
        report.pareto(**arguments)


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


def test_srgb_is_that_of_the_standard():
    # IEC 61966-2-1: a straight part up to .0031308, and 12.92 there
    values = np.array([0, 0.001, 0.0031308, 0.0032, 0.01, 0.18, 0.5, 1])
    encoded = [0, 0.01292, 0.0404499, 0.0413234, 0.0998528, 0.4613561, 0.7353569, 1]
    np.testing.assert_allclose(srgb(values), encoded, atol=2e-6)


def test_pictures_keep_their_shape_when_they_are_shrunk():
    assert size_within((30, 90), 30) == (10, 30) and size_within((30, 90), 90) == (30, 90)
    assert size_within((1, 900), 30) == (1, 30)
    read, _ = unfiltered(map_png(np.full((2, 2), 0.5), 9))
    assert (read == 128).all()


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


def test_names_in_plots_cover_neither_each_other_nor_marks_and_those_of_the_front_are_there():
    random = np.random.default_rng(3)
    at = 10 ** random.uniform(-2, 0, (60, 2))
    points = [
        Point(f"technique-{i}", x, y, "#123456", str(i), i >= 52) for i, (x, y) in enumerate(at)
    ]
    drawn = svg(ErrorChart(points, "x", "y"), (520, 320))
    found = re.findall(
        r'<circle cx="([^"]*)" cy="([^"]*)".*?'
        r'(?:<text x="([^"]*)" y="([^"]*)"[^>]*>([^<]*)</text>)?</g>',
        drawn,
    )
    assert len(found) == 60
    names = [one[4] for one in found if one[4]]
    assert {f"technique-{i}" for i in range(52, 60)} <= set(names) and 10 < len(names) < 60
    boxes = [
        (float(x), float(y) - 8, float(x) + 5.5 * len(name), float(y) + 1)
        for _, _, x, y, name in found
        if name
    ]
    for i, (x0, y0, x1, y1) in enumerate(boxes):
        assert 0 <= x0 and x1 <= 520 and 0 <= y0 and y1 <= 320
        for a0, b0, a1, b1 in boxes[:i]:
            assert a1 <= x0 or x1 <= a0 or b1 <= y0 or y1 <= b0
        for x, y in ((float(one[0]), float(one[1])) for one in found):
            assert not (x0 < x < x1 and y0 < y < y1)
    # Marks of the front are drawn above all others.
    assert drawn.rindex('fill-opacity=".25"') < drawn.index("<title>technique-52:")


@pytest.mark.parametrize(("low", "high"), [(0, 1), (0.0021, 0.0043), (-3e7, 5e9), (5, 5)])
def test_ticks_are_few_round_and_inside(low, high):
    ticks = nice_ticks(low, high)
    assert 1 <= len(ticks) <= 8
    assert all(low - 1e-9 * abs(low) <= tick <= high * (1 + 1e-9) for tick in ticks)
