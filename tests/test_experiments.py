"""Experiments: each runs, says what the paper says, and judges it by what was measured."""

import csv
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import moit
from moit.__main__ import main
from moit.comparing.rows import Row
from moit.experiments import comparisons
from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.claims import Claim, Less, Near, Numbers, Of, Rising
from moit.experiments.comparisons import Comparison, Timing, drawn, front_errors, outside
from moit.experiments.description import Experiment, Published, Section
from moit.experiments.orders import Orders
from moit.experiments.rays import Curves, Ray, Sweep
from moit.experiments.shadows import Lit, Shadows, places
from moit.scenes.scene_parts import MeshScene

NAMES = list(EXPERIMENTS)


@pytest.fixture(scope="module")
def results():
    """Each experiment's result at tiny size, run once."""
    held = {}

    def of(name):
        if name not in held:
            held[name] = moit.experiment(name, "tiny", progress=False)
        return held[name]

    return of


@pytest.mark.parametrize("name", NAMES)
def test_an_experiment_runs_and_every_number_that_its_claims_need_was_measured(name, results):
    found = results(name)
    assert found.experiment.name == name and found.size == "tiny"
    assert found.claims
    for judged in found.claims:
        assert judged.checks
        missing = [check.words for check in judged.checks if check.holds is None]
        assert not missing, (judged.claim.text, missing)


@pytest.mark.parametrize("name", NAMES)
def test_no_technique_fails_and_published_numbers_stand_beside_ours(name, results):
    found = results(name)
    assert not [row for row in found.rows if "Error" in (row.get("note") or "")]
    for part, section in zip(EXPERIMENTS[name].parts, found.sections, strict=True):
        published = getattr(part, "published", None)
        for column in published.columns if published else ():
            assert column in section.columns
            given = [row[column] for row in section.rows if row[column] is not None]
            assert given, column


@pytest.mark.parametrize("name", NAMES)
def test_it_is_written_as_markdown_with_pictures_as_a_table_and_as_one_page(
    name, results, tmp_path
):
    found = results(name)
    paths = [Path(path) for path in found.write(tmp_path)]
    assert [path.name for path in paths] == [f"{name}.md", f"{name}.csv", f"{name}.html"]
    text = paths[0].read_text()
    for judged in found.claims:
        assert judged.claim.text in text and judged.verdict in text
    linked = re.findall(r"\]\((pictures/[^)]+)\)", text)
    assert len(linked) == sum(
        len(section.charts) + sum(map(len, section.gallery)) for section in found.sections
    )
    assert len(set(linked)) == len(linked)
    assert all((tmp_path / one).stat().st_size for one in linked)
    with paths[1].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(found.rows)
    page = paths[2].read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert not re.search(r'src="(?!data:)', page)
    assert found._repr_html_().startswith("<div>")
    assert str(found)


# Claims are judged by numbers alone.


def numbers(**errors):
    return Numbers([Row(technique=name, scene="s", flip=value) for name, value in errors.items()])


def flip(name):
    return Of("flip", name)


@pytest.mark.parametrize(
    ("a", "b", "verdict"),
    [(0.1, 0.2, "holds"), (0.2, 0.1, "does not hold"), (0.15, 0.16, "holds partly")],
)
def test_a_claim_holds_where_all_its_checks_do_and_partly_where_some(a, b, verdict):
    claim = Claim("", "", (Less(flip("a"), flip("b")), Less(flip("a"), flip("b"), 0.75)))
    assert claim.judged(numbers(a=a, b=b)).verdict == verdict


def test_what_was_not_measured_is_not_judged():
    assert Claim("", "", (Less(flip("a"), flip("b")),)).judged(numbers(a=1)).verdict == (
        "not measured"
    )
    failed = numbers(a=None, b=1.0)
    assert Claim("", "", (Less(flip("a"), flip("b")),)).judged(failed).verdict == "not measured"


def test_an_order_is_judged_step_by_step():
    order = Rising((flip("a"), flip("b"), flip("c")))
    assert Claim("", "", (order,)).judged(numbers(a=1, b=2, c=3)).verdict == "holds"
    found = Claim("", "", (order,)).judged(numbers(a=1, b=3, c=2))
    assert [check.holds for check in found.checks] == [True, False]
    assert "not so: flip: b 3.000 >= c 2.000" in found.numbers


def test_near_takes_numbers_as_far_apart_as_said():
    assert Near(flip("a"), 1.0, 0.25)(numbers(a=1.25)).holds
    assert not Near(flip("a"), 1.0, 0.25)(numbers(a=1.26)).holds


def test_less_is_less_and_not_the_same():
    assert Less(flip("a"), flip("b"))(numbers(a=0.25, b=0.5)).holds
    assert Less(flip("a"), flip("b"))(numbers(a=0.5, b=0.5)).holds is False
    assert Less(flip("a"), flip("b"), 0.5)(numbers(a=0.25, b=0.5)).holds is False
    assert Less(flip("a"), flip("b"), 0.75)(numbers(a=0.25, b=0.5)).holds
    assert Less(0.25, flip("b"))(numbers(b=0.5)).holds
    assert Near(flip("a"), flip("b"), 0.0)(numbers(a=0.5, b=0.5)).holds
    assert Near(1.0, flip("b"), 0.25)(numbers(b=0.5)).holds is False


def test_a_few_checks_are_told_and_first_those_that_fail():
    names = "abcdef"
    claim = Claim("", "", tuple(Less(flip(one), 0.5) for one in names))
    judged = claim.judged(numbers(a=0.1, b=0.2, c=0.3, d=0.4, e=0.6, f=None))
    told = judged.short.split("; ")
    assert told[0] == "not so: flip: e 0.6000 >= 0.5000" and told[1] == "flip: a 0.1000 < 0.5000"
    assert len(told) == 5 and told[-1] == "and 2 more"
    assert len(judged.numbers.split("; ")) == 6 and "f ? <" in judged.numbers
    assert "more" not in Claim("", "", claim.tests[:4]).judged(numbers(a=1)).short


def test_claims_about_times_are_known():
    assert Claim("", "", (Less(Of("ms", "a"), flip("b")),)).of_times
    assert Claim("", "", (Less(1.0, Of("diff_ms", "a")),)).of_times
    assert Claim("", "", (Rising((Of("ms", "a"), Of("ms", "b"))),)).of_times
    assert not Claim("", "", (Less(flip("a"), flip("b")), Near(flip("a"), 1.0, 0.5))).of_times


def test_what_is_not_finite_was_not_measured():
    for value in (float("nan"), float("inf"), None, "0.5"):
        assert numbers(a=value).get(flip("a")) is None


def test_a_number_is_looked_up_by_scene_and_setting():
    rows = [
        Row(technique="a", scene="s", setting=1, flip=1.0),
        Row(technique="a", scene="s", setting=2, flip=2.0),
        Row(technique="a", scene="t", setting=2, flip=3.0),
    ]
    held = Numbers(rows)
    assert held.get(Of("flip", "a", "s", 2)) == 2 and held.get(Of("flip", "a", "t")) == 3
    assert held.get(Of("flip", "a", "u")) is None and held.get(Of("psnr", "a")) is None
    assert held.get(0.5) == 0.5


# What the parts measure.


def run(*parts, **how):
    return moit.experiment(Experiment("one", "", "", "", "", parts), "tiny", progress=False, **how)


def test_curves_are_held_against_the_exact_ones():
    ray = Ray((2.0, 3.0), (0.5, 0.5))
    part = Curves("c", "", {"two": ray}, ("sorted", "fourier7", "power4"), (1.0, 4.0))
    exact, series, moments = run(part).sections[0].rows
    # exact but for float32's rounding; two surfaces are exact to four moments but at their steps
    assert exact["curve_max"] == exact["curve_mean"] == exact["T_max"] == 0
    assert exact["jump"] == pytest.approx(0.5)
    assert moments["curve_max"] < 1e-3 < 0.05 < series["curve_max"]
    assert series["jump"] < 0.05 < moments["jump"]


def test_a_sweep_tells_signs_apart():
    def rays(rng, value, count):
        depth = np.tile([1.5, 3.0], count)
        return moit.Fragments(
            np.arange(count + 1) * 2, depth, np.full(2 * count, value), depth_range=(1, 4)
        )

    high, low = "power4(overestimation=0.0)", "power4(overestimation=1.0)"
    part = Sweep("s", "", "alpha", (0.2, 0.5), rays, (high, low))
    rows = run(part).sections[0].rows
    assert [row["setting"] for row in rows] == [0.2, 0.2, 0.5, 0.5]
    # what lies at a depth counts wholly or not at all
    assert rows[0]["front"] == pytest.approx(0, abs=1e-3)
    assert rows[1]["front"] == pytest.approx(-0.2, abs=1e-3)
    assert rows[3]["front"] == pytest.approx(-0.5, abs=2e-3)


def test_the_nearest_fragment_is_seen_as_much_as_it_should_where_blending_is_exact():
    f = moit.scenes.load("panes", (24, 16))
    assert np.nanmax(np.abs(front_errors(f, "sorted"))) < 1e-7
    assert np.array_equal(np.isnan(front_errors(f, "wboit")).ravel(), f.counts < 2)
    two = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], np.zeros((2, 3)))
    # equal weights share what is covered, 3/4, evenly: 3/8 instead of 1/2
    even = moit.WeightedBlended(lambda depth, alpha, color: np.ones(len(depth)))
    assert front_errors(two, even) == pytest.approx(-0.125, abs=1e-6)


def test_colours_outside_those_of_a_pixel_are_told():
    f = moit.Fragments([0, 2, 2], [1, 2], [0.5, 0.5], [[0.2, 0, 0], [0.4, 0, 0]])
    image = np.zeros((1, 2, 4))
    image[0, :, 0] = 0.3, 0.1
    assert outside(f, image, (0.1, 0, 0)) == pytest.approx(0, abs=1e-7)
    assert outside(f, image, (0.2, 0, 0)) == pytest.approx(0.1)  # of the empty pixel
    image[0, 0, 0] = 0.9
    assert outside(f, image, (0.1, 0, 0)) == pytest.approx(0.5)


def test_a_comparison_has_errors_of_regions_and_of_their_light():
    def left(f):
        mask = np.zeros(f.shape, bool)
        mask[:, : f.shape[1] // 2] = True
        return mask

    part = Comparison("p", "", ("panes",), ("weighted-sum", "sorted"), regions={"left": left})
    (section,) = run(part).sections
    f = moit.scenes.load("panes", (64, 40))
    off = moit.composite(f, "weighted-sum") - moit.composite(f, "sorted", dtype="f8")
    expected = np.sqrt((off[:, :32, :3].astype(float) ** 2).mean())
    assert section.rows[0]["rmse left"] == pytest.approx(expected, rel=1e-5)
    assert section.rows[1]["rmse left"] < 1e-6
    dark = (off[:, :32, :3] @ [0.2126, 0.7152, 0.0722]).mean()
    assert section.rows[0]["light left"] == pytest.approx(dark, rel=1e-4)


def test_a_comparison_says_what_is_off_beyond_errors_of_the_image():
    f, background = drawn("panes", (64, 40))
    columns = ("coverage", "outside", "shuffle", "bytes")
    behind = (0.5, 0.25, 1.0)
    part = Comparison(
        *("p", "", ("panes",), ("weighted-sum", "unsorted", "power4")),
        columns=columns, background=behind, bytes_of="MBOIT",
    )  # fmt: skip
    (section,) = run(part).sections
    assert background == (0, 0, 0)
    for row in section.rows:
        image = moit.composite(f, row["technique"], background=behind)
        exact = moit.composite(f, "sorted", background=behind, dtype="f8")
        assert row["flip"] == moit.metrics.flip(image, exact)
        assert row["coverage"] == pytest.approx(np.abs(image - exact)[..., 3].max(), abs=1e-6)
        assert row["outside"] == outside(f, image, behind)
        other = moit.composite(f.shuffled(1), row["technique"], background=behind)
        assert row["shuffle"] == np.abs(other - image).max()
    assert [row["bytes"] for row in section.rows] == [None, None, 20]
    assert section.rows[1]["shuffle"] > 0.05 > 1e-5 > section.rows[2]["shuffle"]


def test_times_are_put_in_ratio_and_beside_published_ones(monkeypatch):
    passes = {"unsorted": (0.5, 1.5), "wboit": (1.0, 3.0), "power4": (4.0, 8.0)}
    monkeypatch.setattr(comparisons, "_cpu_times", lambda report, f, repeat: passes)
    paper = Published(
        "here",
        "a machine",
        {"paper_diff_ms": {("panes", "power4"): 5.0, (None, "power4"): 9.0, (None, "wboit"): 2.5}},
    )
    part = Comparison(
        *("p", "", ("panes",), ("unsorted", "wboit", "power4")),
        timing=Timing("power4", "diff_ms"), published=paper,
    )  # fmt: skip
    (section,) = run(part).sections
    names = ("first_ms", "second_ms", "ms", "diff_ms", "ratio", "paper_diff_ms", "paper_ratio")
    assert [tuple(row[name] for name in names) for row in section.rows] == [
        (0.5, 1.5, 2.0, 0.0, 0.0, None, None),
        (1.0, 3.0, 4.0, 2.0, 0.2, 2.5, 0.5),
        (4.0, 8.0, 12.0, 10.0, 1.0, 5.0, 1.0),
    ]
    assert section.heading("paper_diff_ms") == "diff ms, paper (a machine)"
    assert section.columns[-2:] == ("paper_diff_ms", "paper_ratio")


def test_the_first_pass_of_moments_is_what_gathering_them_takes(monkeypatch):
    f = moit.scenes.load("panes", (12, 11))
    report = moit.compare(f, ["wboit", "power4"], repeat=1, progress=False)
    report.rows[0]["seconds"], report.rows[1]["seconds"] = 0.25, 0.75
    clock = iter([0, 0.5, 1, 1.125, 2, 2.25])
    monkeypatch.setattr(comparisons, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    found = comparisons._cpu_times(report, f, 3)
    assert found == {"wboit": (None, 250.0), "power4": (250.0, 500.0)}


def test_curves_have_signs():
    ray = Ray((2.0, 3.0), (0.5, 0.5))
    high, low = "power4(overestimation=0.0)", "power4(overestimation=1.0)"
    long = Ray(tuple(np.linspace(1.5, 3.5, 9)), (0.3,) * 9)
    part = Curves("c", "", {"two": ray, "nine": long}, (high, low), (1.0, 4.0))
    rows = run(part).sections[0].rows
    assert [row["scene"] for row in rows] == ["two", "two", "nine", "nine"]
    above, below = rows[2:]
    assert above["light"] > 0.01 and above["above"] > 0.05 and above["below"] < 0.01
    assert below["light"] < -0.01 and below["below"] > 0.05 and below["above"] < 0.01
    assert above["curve_mean"] >= above["light"] and below["curve_mean"] >= -below["light"]


def test_a_sweep_is_of_the_same_rays_for_all_and_again():
    seen = []

    def rays(rng, value, count):
        f = moit.Fragments([0, 2], rng.uniform(1, 4, 2), [value, value], depth_range=(1, 4))
        seen.append((value, count, f.depth.tolist()))
        return f

    part = Sweep("s", "", "alpha", (0.2, 0.5), rays, ("power4", "wavelet8"))
    first, again = run(part).sections[0].rows, run(part).sections[0].rows
    assert first == again and len(seen) == 4
    assert {depth[0] for _, _, depth in seen} == {seen[0][2][0]} and seen[0][1] == 40


def test_shadows_are_held_against_rays_and_signs_say_too_dark_or_bright():
    glass = moit.Mesh(
        [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]], [[0, 2, 1], [0, 3, 2]], alpha=0.5
    )
    floor = moit.Mesh(
        [[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]], [[0, 2, 1], [0, 3, 2]], alpha=0.9
    )
    scene = MeshScene([floor], moit.Camera((0, 4, 0.1), (0, 0, 0)), (0, 0, 0))
    below = {"under": lambda points, exact: exact < 0.9}
    dark = "power4(overestimation=1.0)"
    part = Shadows(
        *("s", "", {"one": lambda: Lit(scene, [glass], (0, -1, 0))}, ("power4", dark, "sorted")),
        columns=("rmse", "ms"), where=below, base="power4",
    )  # fmt: skip
    rows = run(part).sections[0].rows
    f = moit.rasterize(scene.meshes, scene.camera, (64, 40))
    points = places(f, scene.camera)
    np.testing.assert_allclose(points[:, 1], 0, atol=1e-5)  # on the floor
    reached = [
        moit.ShadowMap([glass], name, light=(0, -1, 0), resolution=64).transmittance(points)
        for name in ("sorted", "power4")
    ]
    off = (reached[1] - reached[0]).astype(float)
    under = reached[0] < 0.9
    assert 0.1 < under.mean() < 0.9
    assert rows[0]["rmse"] == pytest.approx(np.sqrt((off**2).mean()), rel=1e-5)
    assert rows[0]["rmse under"] == pytest.approx(np.sqrt((off[under] ** 2).mean()), rel=1e-5)
    assert rows[0]["light under"] == pytest.approx(off[under].mean(), rel=1e-4)
    assert rows[2]["rmse"] == rows[2]["light under"] == 0
    for row in rows:
        assert row["ms"] == pytest.approx(row["first_ms"] + row["second_ms"])
        assert 0 < row["first_ms"] < 1e5 and row["ratio"] == row["ms"] / rows[0]["ms"]


def test_orders_of_drawing_are_called_by_what_they_are():
    part = Orders("o", "", ("pond",), ("wboit",))
    rows = {row["technique"]: row for row in run(part).sections[0].rows}
    scene = moit.scenes.meshes("pond")
    exact = moit.render(scene, "sorted", (64, 40))
    for words, order in (
        ("in draw order", "given"),
        ("sorted objects", "object"),
        ("sorted triangles", "triangle"),
    ):
        image = moit.render(scene, "unsorted", (64, 40), order=order)
        off = np.abs(image - exact)[..., :3].max(axis=-1)
        assert rows[words]["wrong"] == (off > 1 / 16).mean()
        assert rows[words]["flip"] == moit.metrics.flip(image, exact)
        assert rows[words]["rmse"] == moit.metrics.rmse(image, exact)
    assert rows["wboit"]["rmse"] == moit.metrics.rmse(moit.render(scene, "wboit", (64, 40)), exact)
    assert rows["in draw order"]["wrong"] != rows["sorted triangles"]["wrong"]


def test_parts_are_run_on_the_device_that_is_asked_for(monkeypatch):
    asked = []

    class Part:
        title = "t"

        def steps(self):
            return 1

        def run(self, setting):
            asked.append((setting.size, setting.device, setting.folder))
            return Section("t", "")

    monkeypatch.setattr("moit.experiments.running.gpu_of", lambda device: None)
    described = Experiment("one", "", "", "", "", (Part(),))
    moit.experiment(described, "full", device="gpu", progress=False, out="here")
    assert asked == [("full", "gpu", "here")]


def test_a_comparison_takes_back_what_a_folder_holds(tmp_path):
    part = Comparison("p", "", ("panes",), ("power4",), columns=("flip", "seconds"))
    first = run(part, out=tmp_path).sections[0].rows[0]
    again = run(part, out=tmp_path).sections[0].rows[0]
    assert first["seconds"] == again["seconds"]


def test_what_was_measured_before_an_interrupt_is_taken_back(tmp_path):
    part = Comparison("p", "", ("panes",), ("power4", "wboit"), columns=("flip", "seconds"))

    def interrupt(done, total, label):
        if label == "panes power4":
            raise KeyboardInterrupt

    described = Experiment("one", "", "", "", "", (part,))
    with pytest.raises(KeyboardInterrupt):
        moit.experiment(described, "tiny", progress=interrupt, out=tmp_path)
    kept = list(tmp_path.glob("panes/*.json"))
    assert [path.stem for path in kept] == ["power4"]
    written = kept[0].stat().st_mtime_ns
    found = moit.experiment(described, "tiny", progress=False, out=tmp_path)
    assert kept[0].stat().st_mtime_ns == written
    assert [row["technique"] for row in found.rows] == ["power4", "wboit"]


@pytest.mark.parametrize("name", ["hair", "engine"])
def test_opacities_of_a_scene_are_scaled_to_the_greatest(name):
    f, _ = drawn(name, (64, 40))
    scaled, _ = drawn(name, (64, 40), 0.2)
    clear = f.alpha < 1
    assert scaled.alpha[clear].max() == pytest.approx(0.2, rel=1e-5)
    assert (scaled.alpha[~clear] == 1).all() and np.array_equal(f.depth, scaled.depth)


# How one asks.


def test_unknown_names_and_sizes_are_told_with_what_there_is():
    with pytest.raises(ValueError, match="mt-fig2"):
        moit.experiment("mt-fig-2")
    with pytest.raises(ValueError, match="'tiny', 'small', 'full'"):
        moit.experiment("mt-fig2", "huge")
    with pytest.raises(TypeError, match="name of an experiment"):
        moit.experiment(3)


def test_progress_counts_to_the_end():
    told = []
    moit.experiment("mt-fig2", "tiny", progress=lambda *step: told.append(step))
    assert told[0][0] == 0 and told[-1][0] == told[-1][1]


def test_the_command_lists_runs_and_writes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["experiment", "--list"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in NAMES)
    assert main(["experiment", "mt-fig2", "--size", "tiny"]) == 0
    assert "For two samples" in capsys.readouterr().out
    assert (tmp_path / "experiments/mt-fig2/mt-fig2.html").exists()
    assert main(["experiment"]) == 1
    assert "mt-fig2" in capsys.readouterr().err


# The pages that are written of all of them.

DOCS = Path(__file__).parent.parent / "docs"


def test_the_gallery_shows_what_experiments_draw_and_its_files_are_there():
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\((gallery/[^)]+)\)", text))
    assert linked == {path.relative_to(DOCS).as_posix() for path in (DOCS / "gallery").rglob("*.*")}
    for name in re.findall(r"^moit experiment (\S+)$", text, re.MULTILINE):
        assert name in EXPERIMENTS


def test_every_claim_stands_in_the_list_of_claims():
    text = (DOCS / "claims.md").read_text(encoding="utf-8")
    for described in EXPERIMENTS.values():
        assert f"`moit experiment {described.name}`" in text
        for claim in described.claims:
            assert f"| {claim.text} | {claim.where} | **" in text, "run it: python docs/gallery.py"


def test_pages_written_of_one_experiment_keep_the_others(results, tmp_path, monkeypatch):
    """Also where nothing is kept in build/experiments, which nobody commits."""
    monkeypatch.syspath_prepend(DOCS)
    import gallery

    names = ("gallery.md", "claims.md")
    before = {name: (DOCS / name).read_text(encoding="utf-8") for name in names}
    for name in names:
        shutil.copy(DOCS / name, tmp_path)
    gallery.write_pages(tmp_path, {})
    assert {name: (tmp_path / name).read_text(encoding="utf-8") for name in names} == before
    for name in names:
        changed = before[name].replace("on moit 0.1.0", "on another one")
        (tmp_path / name).write_text(changed, encoding="utf-8")
    found = results("mt-fig2")
    gallery.write_pages(tmp_path, {"mt-fig2": found})
    for name in names:
        new = gallery.standing(tmp_path / name)
        assert list(new) == list(gallery.standing(DOCS / name))
    renewed = [one for one, part in new.items() if "on another one" not in part]
    assert renewed == ["mt-fig2"]
    assert f"`moit experiment mt-fig2` on {found.machine}." in new["mt-fig2"]
