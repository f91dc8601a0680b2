"""The page of a report: the answer first, then pictures, curves and costs, the numbers last."""

import base64
import csv
import html
import itertools
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from reports_made import NASTY, failing, made, of_everything
from small import some_fragments

import moit
from moit.catalog.palette import technique_colours, technique_looks
from moit.comparing.answer import answer
from moit.comparing.charts import errors_chart
from moit.comparing.error_maps import error_maps, map_range
from moit.comparing.report import Report
from moit.comparing.summary import summary
from moit.reports.charts import on_page
from moit.reports.columns import plain_number
from moit.reports.pictures import data_uri, map_png
from moit.reports.svg import svg


@pytest.fixture(scope="module")
def report():
    return of_everything()


class Page(HTMLParser):
    """What a page refers to and shows, and that its elements are closed in order."""

    EMPTY = ("meta", "img", "br", "path", "circle", "link")

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.values, self.tags, self.text = [], [], set(), [], []
        self.elements = []  # (tag, attributes) in order
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.elements.append((tag, dict(attributes)))
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


def test_the_page_opens_on_the_answer_and_ends_with_the_numbers(report, page):
    said = answer(report)
    places = [page.index(f'class="{one}') for one in ("answer", "strip", "of-scene", "plots")]
    places += [page.index(f'id="{one}"') for one in ("times", "numbers")]
    assert places == sorted(places)
    sentence = re.search(r'<p class="answer">(.*?)</p>', page)[1]
    assert html.unescape(re.sub("<[^>]*>", "", sentence)) == "".join(said.sentences[0])
    assert re.findall("<strong>(.*?)</strong>", sentence) == said.shown
    strip = page[page.index('class="strip"') : page.index('class="of-scene"')]
    assert re.findall("<strong>(.*?)</strong>", strip) == ["reference", *said.shown]
    assert len(said.shown) == 3 and html.escape(said.scene) in strip


def test_times_say_on_what_and_that_those_of_a_gpu_differ(report, page):
    times = page[page.index('<h2 id="times"') : page.index('<h2 id="numbers"')]
    assert report.machine in times and moit.__version__ in report.machine
    assert " threads, " in report.machine and "Times differ there" in times
    assert page.count('id="gpu-costs"') == 1  # the place of what is known of them
    one = moit.compare(some_fragments(), "wboit", threads=1, repeat=1, progress=False)
    assert ", 1 thread, " in one.machine


def test_who_hears_the_page_or_has_no_script_misses_nothing(page):
    found = Page(page)
    levels = [int(tag[1]) for tag in found.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    ids = [one["id"] for _, one in found.elements if "id" in one]
    assert len(ids) == len(set(ids))
    assert {one["href"][1:] for tag, one in found.elements if tag == "a"} <= set(ids)
    for tag, one in found.elements:
        if tag == "img" and "hidden" not in one:
            assert one["src"] and one["alt"]
        if tag == "svg":
            assert one.get("aria-label") or one.get("aria-hidden") == "true"
    # What does nothing without a script is not shown, nor said to be a button.
    assert not any(one.get("role") == "button" for _, one in found.elements)
    assert re.search(r"(?m)^\.controls {[^}]*display: none", page)
    body = page[: page.index("<script>")]
    for button in re.finditer("<button", body):
        before = body[: button.start()]
        within = before.rfind('<div class="controls">') > before.rfind("</div>")
        assert within or before.endswith(("<th>", ">"))  # heads of tables, which are text, too


def test_a_technique_has_one_colour_in_the_table_the_curves_and_the_plots(report, page):
    names = [str(one) for one in moit.techniques()]
    for name, look in zip(names, technique_looks(names), strict=True):
        colour = on_page(look.colour)
        dots = re.findall(rf'background:([^"]*)"></span>(?:<strong>)?{re.escape(name)}<', page)
        assert dots and set(dots) == {colour}
        marks = re.findall(
            rf"<title>{re.escape(name)}: [^<]*</title>.*?<circle [^>]*stroke=\"([^\"]*)\"", page
        )
        assert set(marks) == {colour}
        curves = re.findall(rf'stroke="([^"]*)"[^>]*><title>{re.escape(name)}</title>', page)
        assert set(curves) <= {colour}


def test_the_table_is_sorted_and_short_and_has_failures_last(report):
    looks = technique_looks([row["technique"] for row in report.rows])
    palette = {row["technique"]: look for row, look in zip(report.rows, looks, strict=True)}
    table = summary(report, palette)
    assert len(table.heads) == 6 and table.heads[-2:] == ["one", NASTY]
    errors = [row[3].exact for row in table.cells]
    known = [float(one) for one in errors if one]
    assert errors[-2:-1] == [""] and table.cells[-1][0].text == "sorted"
    assert "RuntimeError" in table.cells[-2][0].note
    assert known[:-1] == sorted(known[:-1]) and len(known) == len(table.cells) - 1
    for cells in table.cells[:-2]:
        flips = [r["flip"] for r in report.rows if r["technique"] == cells[0].text]
        assert float(cells[3].exact) == pytest.approx(np.mean(flips))
        assert [float(cell.exact) for cell in cells[4:]] == flips
    assert sum(row[3].best for row in table.cells) >= 1
    many = made([(f"s{k}", "x", 1.0, 8, 0.1) for k in range(5)])
    assert summary(many, palette | {"x": looks[0]}).heads == [
        "technique",
        "bits",
        "ms",
        "FLIP, mean",
    ]


def test_only_so_many_curves_and_pictures_are_shown_as_one_can_tell_apart(page):
    found = Page(page)
    scenes = page.split('class="of-scene"')[1:]
    for scene in scenes:
        seen = scene.split("<details")[0]
        assert seen.count('class="card"') == 6
        curves = re.findall(r'<svg xmlns(?:(?!</svg>).)*class="exact".*?</svg>', scene)
        assert curves and all(one.count('class="series"') == 6 for one in curves)
        assert all(one.count('class="series more"') > 20 for one in curves)
    assert found.tags.count("details") == 2 * len(scenes) + 1


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
    names = re.findall(r"https?://[^\"'<\s]*", page)
    assert names == ["http://www.w3.org/2000/svg"] * page.count("<svg xmlns=")


def test_the_page_escapes_what_it_is_given(page):
    assert Page(page).tags.count("script") == 1  # its own
    assert NASTY not in page
    assert "alert('1 & 2')" in "".join(Page(page).text)


def test_the_page_says_of_a_scene_what_it_is(report, page):
    text = "".join(Page(page).text)
    for scene in report.scenes.values():
        height, width = scene.shape
        mean = plain_number(scene.fragments / (height * width), 2)
        assert (
            f"{width} x {height} pixels, {scene.fragments:,} fragments: {mean} a pixel, "
            f"at most {scene.most_layers}"
        ) in text
        for y, x in scene.pixels:
            assert f"Transmittance at x {x}, y {y}" in text
    assert "Reference: sorted, composited in float64." in text


def test_the_page_begins_with_the_best_technique_that_is_not_the_reference(report, page):
    for scene in report.scenes:
        rows = [r.row for r in report.of_scene(scene) if r.row["flip"] is not None]
        best = min((r for r in rows if r["technique"] != "sorted"), key=lambda r: r["flip"])
        section = page.split(f">{html.escape(scene)}</h2>")[1].split("</section>")[0]
        (name,) = re.findall(r'data-name="([^"]*)" data-first', section)
        assert html.unescape(name) == best["technique"]


def test_maps_are_of_the_range_that_is_written_beside_them_and_plots_of_milliseconds(tmp_path):
    close = moit.compare(some_fragments(), ["power6", "power8"], repeat=1, progress=False)
    close.to_html(tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    (scene,) = close.scenes.values()
    maps, _ = error_maps(scene.reference, close.results)
    most = map_range(maps)
    assert 0 < most < 1 and page.count(f"> {most:g}</p>") == 2  # of the opening and the scene
    for one in maps:
        assert data_uri(map_png(one / most, scene.shape[1])) in page
    names = ["power6", "power8"]
    palette = dict(zip(names, technique_colours(names), strict=True))
    keys = {id(row): f"0-{k}" for k, row in enumerate(close.rows)}
    for by, field, factor, words in (
        ("seconds", "seconds", 1e3, "milliseconds"),
        ("bits", "bits_per_pixel", 1.0, "bits per pixel"),
    ):
        chart = errors_chart(close, close.rows, "flip", by, palette, keys, factor, words)
        assert svg(chart, (520, 320)) in page
        assert {p.x for p in chart.points} == {row[field] * factor for row in close.rows}


def test_maps_are_scaled_by_the_nearest_half_so_that_the_worst_hides_none(report, page):
    for name, section in zip(report.scenes, page.split('class="of-scene"')[1:], strict=True):
        scene = report.scenes[name]
        results = [r for r in report.of_scene(name) if r.image is not None]
        results.sort(key=lambda r: (r.row["technique"] == "sorted", r.row["flip"]))
        maps, _ = error_maps(scene.reference, results)
        most = map_range(maps[: (len(maps) + 1) // 2])
        assert most < map_range(maps) and f"> {most:g} or more</p>" in section
        assert data_uri(map_png(maps[0] / most, scene.shape[1])) in section


def test_the_page_has_images_maps_curves_and_plots(report, page):
    images = sum(result.image is not None for result in report.results)
    # Each technique's image and map; each scene's reference, and the scale of its maps; and those
    # of the opening: the reference, three techniques, their maps and the scale of these.
    assert page.count("data:image/png") == 2 * images + 2 * len(report.scenes) + 1 + 2 * 3 + 1
    assert page.count('class="exact"') == sum(len(s.pixels) for s in report.scenes.values())
    # against bits, time, and a GPU's time as it is predicted
    assert page.count("FLIP against") == 3 * len(report.scenes)


def test_the_reference_alone_and_others_that_failed_have_a_page(tmp_path):
    for techniques in (["sorted"], ["sorted", moit.WeightedBlended(failing)]):
        report = moit.compare(some_fragments(), techniques, repeat=1, progress=False)
        report.to_html(tmp_path / "r.html")
        page = (tmp_path / "r.html").read_text()
        Page(page)
        assert page.count('<div class="strip"><figure>') == 1
        assert "Below each picture" not in page


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


def test_page_pictures_are_readable_by_others(page, tmp_path):
    first = re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)", page)[1]
    (tmp_path / "x.png").write_bytes(base64.b64decode(first))
    assert moit.read_image(tmp_path / "x.png").shape == (24, 32, 3)
