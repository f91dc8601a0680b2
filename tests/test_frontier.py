"""The blind protocol: draws that share nothing, what is measured on them and what is said of it."""

import csv
import importlib.util
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import moit
from moit import _core
from moit.__main__ import main
from moit.catalog.technique import ACCESS
from moit.comparing.rows import Row
from moit.judging import draws, page, running
from moit.judging.bootstrap import estimate
from moit.judging.candidates import MOST_BYTES, candidates
from moit.judging.draws import SCENES, SETS, draw_named, moved, untied
from moit.judging.findings import Findings, Measured
from moit.judging.fronts import Means, best, front
from moit.judging.measuring import ON_RAYS, PreparedPan, RayUnit, SceneUnit
from moit.judging.registry import Aim, aims, registry
from moit.judging.sentences import brief, paragraphs
from moit.neural import data
from moit.reports.charts import ErrorChart, Point
from moit.system.environment import core_digest

KINDS = ("tune", "check", "final")


def pixels_with_ties(f):
    pixel = np.repeat(np.arange(f.counts.size), f.counts.ravel())
    order = np.lexsort((f.depth, pixel))
    pixel, depth = pixel[order], f.depth[order]
    return np.count_nonzero((pixel[1:] == pixel[:-1]) & (depth[1:] == depth[:-1]))


# Draws


@pytest.mark.parametrize("letter", SETS)
def test_no_two_fragments_of_a_ray_are_at_one_depth(letter):
    rays = draw_named("check").rays(letter, 200)
    for f in rays.frames(2):
        assert len(f) and not pixels_with_ties(f)
        assert f.depth.min() >= 1 and f.depth.max() <= math.e


def test_depths_that_floats_cannot_tell_apart_are_made_distinct():
    pixel = np.repeat([0, 1], 50)
    depth = untied(pixel, np.full(100, 1.0))
    assert len(set(depth[:50].tolist())) == 50 and sorted(depth[:50]) == sorted(depth[50:])
    assert depth.dtype == np.float32 and depth.max() <= math.e
    assert np.ptp(depth) < 1e-4


def test_what_leaves_the_range_is_folded_back_and_not_clipped():
    depth = untied(np.zeros(2, int), np.array([-0.25, 1.25]))
    assert np.log(depth) == pytest.approx([0.25, 0.75], abs=1e-4)


def test_draws_of_different_kinds_and_seeds_share_no_number():
    seen = [draw_named(kind).rays("A", 50) for kind in KINDS]
    seen += [draw_named("check", 1).rays("A", 50), draw_named("tune", 1).rays("A", 50)]
    alphas = [set(rays.alpha.tolist()) for rays in seen]
    alphas.append(set(data.drawn("layers", 1000, 0).alpha.astype(float).tolist()))
    for i, one in enumerate(alphas):
        for other in alphas[:i]:
            assert not one & other
    seeds = {draw_named(kind, seed).scene_seed for kind in KINDS[:2] for seed in (0, 1, 999_999)}
    assert len(seeds | {draw_named("final").scene_seed}) == 7


def test_one_draw_is_the_same_every_time():
    first, again = (draw_named("tune", 3).rays("D", 20).at() for _ in range(2))
    assert np.array_equal(first.depth, again.depth) and np.array_equal(first.color, again.color)


def test_the_final_draw_is_the_versions(monkeypatch):
    assert draw_named("final") == draw_named("final")
    with pytest.raises(ValueError, match="seed: expected none with draw='final'"):
        draw_named("final", 1)
    before = draw_named("final")
    monkeypatch.setattr(draws, "VERSION", "9.9.9")
    assert draw_named("final") != before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"draw": "best"}, "draw: expected 'tune', 'check', 'final'"),
        ({"size": "huge"}, "size: expected 'tiny', 'small', 'full'"),
        ({"seed": 1_000_000}, "seed: expected"),
        ({"seed": -1}, "seed: expected"),
    ],
)
def test_bad_arguments_are_told(arguments, message):
    with pytest.raises(ValueError, match=message):
        moit.frontier("wboit", progress=False, **arguments)


def test_the_scenes_are_all_that_every_technique_takes():
    assert len(SCENES) == 21
    for name in set(moit.scenes.names()) - set(SCENES):
        assert moit.scenes.load(name, (32, 32)).transmission is not None
    for name in SCENES:
        assert moit.scenes.load(name, (8, 8)).transmission is None


def test_scenes_stand_before_their_own_background():
    f, background = draw_named("check").scene("chess", (16, 12))
    assert f.shape == (12, 16) and any(background)


# Measures


def test_fragments_move_by_a_thousandth_of_the_range():
    first, second = draw_named("check").rays("A", 50).frames(2)
    moved = np.log(second.depth.astype(float)) - np.log(first.depth.astype(float))
    assert np.abs(moved) == pytest.approx(1e-3, abs=1e-5)
    assert (moved > 0).any() and (moved < 0).any()


def on_rays(technique, letter="A", pixels=200, frames=4):
    unit = RayUnit(draw_named("check"), letter, pixels, frames)
    return unit.prepared().measured(moit.technique(technique))


def test_what_is_exact_has_no_errors():
    found = on_rays("sorted")
    for name in ("colour", "T", "order"):
        assert found[name].value < 1e-6
    assert found["jumps"].value == 0 and 0 < found["flicker"].value < 0.002


def test_order_tells_those_that_hang_on_arrival():
    assert on_rays("power4")["order"].value < 1e-6
    assert on_rays("unsorted")["order"].value > 0.01


def test_flicker_looks_where_the_exact_picture_is_still():
    """Noise changes everywhere, and what is smooth changes hardly."""
    noise, smooth = on_rays("stochastic8"), on_rays("power4")
    assert noise["flicker"].value > 10 * smooth["flicker"].value
    assert noise["jumps"].value > 0.2 > 0.02 > smooth["jumps"].value


def test_what_a_panning_camera_looks_at_goes_by_parts_of_a_pixel():
    camera, size = moit.Camera((1, 2, 5), (0.5, 0, 0)), (64, 36)
    x, y, _, w = np.matmul(*moved(camera, 0.25, 36).matrices(size)[::-1]) @ [*camera.target, 1]
    assert (0.5 * size[0] * x / w, 0.5 * size[1] * y / w) == pytest.approx((-0.25, 0), abs=0.01)
    first, second = draw_named("check").panned("teapots", (32, 18), 2)
    assert first.shape == second.shape == (18, 32) and not np.array_equal(first.depth, second.depth)


def test_a_pan_is_judged_where_something_is_seen_through_and_still():
    """Of three pixels one is empty, one changes exactly, and one is drawn in another order."""
    alpha, color = [0.5, 0.5, 0.5], [[1.0, 0, 0], [1, 0, 0], [0, 1, 0]]
    first = moit.Fragments([0, 0, 1, 3], [2, 2, 3], alpha, color, shape=(1, 3))
    second = moit.Fragments(
        [0, 0, 1, 3], [2, 3, 2], [0.7, 0.5, 0.5], np.array(color, float)[[0, 2, 1]], shape=(1, 3)
    )
    pan = PreparedPan([first, second])
    assert [found.value for found in pan.measured(moit.technique("sorted")).values()] == [0, 0]
    flicker, jumps = (found.value for found in pan.measured(moit.technique("unsorted")).values())
    assert jumps == 1 and flicker == pytest.approx(np.sqrt(2 * 0.25**2 / 3))


def test_colours_and_transmittance_are_root_mean_squares_over_all_rays():
    prepared = RayUnit(draw_named("check"), "C", 100, 2).prepared()
    found = prepared.measured(moit.technique("power6"))
    f = prepared.moving[0]
    off = moit.composite(f, "power6") - moit.composite(f, "sorted", dtype="f8")
    assert found["colour"].value == pytest.approx(np.sqrt((off[..., :3] ** 2).mean()), rel=1e-6)
    off = moit.transmittance(f, "power6") - moit.transmittance(f, "sorted", dtype="f8")
    assert found["T"].value == pytest.approx(np.sqrt((off**2).mean()), rel=1e-6)


def test_intervals_hold_the_mean_as_often_as_they_say():
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(200):
        found = estimate(rng.exponential(size=150))
        held += found.low <= 1 <= found.high
    assert 175 <= held <= 199  # 95 % but for skew


def test_an_interval_is_as_wide_as_that_of_a_normal_mean():
    numbers = np.random.default_rng(2).normal(size=2000)
    found = estimate(numbers)
    wide = 2 * 1.96 * numbers.std() / math.sqrt(2000)
    assert found.high - found.low == pytest.approx(wide, rel=0.1)
    assert (found.low + found.high) / 2 == pytest.approx(found.value, abs=0.1 * wide)


def test_an_interval_of_a_ratio_and_of_its_root():
    total, count = np.array([1.0, 8.0, 0.0]), np.array([1, 2, 0])
    assert estimate(total, count).value == 3
    assert estimate(total, count, root=True).value == pytest.approx(math.sqrt(3))
    assert all(map(math.isnan, estimate(np.zeros(2), np.zeros(2))))


# Candidates


def test_candidates_are_found_in_the_catalog():
    found = candidates()
    assert len(set(found)) == len(found)
    names = {str(one) for one in found}
    for one in moit.techniques():
        bits = one.bits_per_pixel
        judged = bits is not None and bits <= 8 * MOST_BYTES and one.access != "lists"
        judged &= one.geometry_passes is not None and one.kind != "unsorted"
        assert (str(one) in names) == judged, one
    assert "power4(exclude_self=True,overestimation=0.4)" in names and "mlab2" in names
    assert all(moit.technique(str(one)) == one for one in found)


def test_access_is_a_fact_of_each_technique():
    access = {str(one): one.access for one in moit.techniques()}
    assert set(access.values()) == set(ACCESS)
    for name, wanted in {
        "power4": "blend",
        "hybrid4": "atomics",
        "anchors4": "atomics",
        "strong5": "atomics",
        "front2": "atomics",
        "mlab4": "ordered",
        "power4-16": "ordered",
        "sorted": "lists",
        "deep-shadow": "lists",
    }.items():
        assert access[name] == wanted
    for one in moit.techniques():
        assert (one.access == "ordered") == (one.needs_order and not one.sorts) or one.access == (
            "lists"
        )


# The whole

NAMES = ("wboit", "power4", "adaptive4", "mlab4", "stochastic8")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    kept = tmp_path_factory.mktemp("frontier")
    return moit.frontier(NAMES, size="tiny", progress=False, out=kept), kept


def test_a_row_has_facts_and_numbers_with_intervals(found):
    result, _ = found
    assert [row["technique"] for row in result.rows] == list(NAMES)
    row = result.row("power4")
    assert (row.bytes, row.passes, row.access, row.order_independent) == (20, 2, "blend", True)
    for measure in ON_RAYS:
        for letter in (*SETS, "mean"):
            low, value, high = (row[f"{letter}_{measure}{end}"] for end in ("_low", "", "_high"))
            assert low <= value <= high
    assert row.mean_colour == pytest.approx(np.mean([row[f"{one}_colour"] for one in SETS]))
    flips = result.flips("power4")
    assert flips.shape == (21,) and row.flip == pytest.approx(flips.mean())
    assert row.flip_low < row.flip < row.flip_high
    assert row.flip == row["flip_64x36"]
    assert (
        0 < row.pan_flicker < 0.1 and row.pan_flicker_low < row.pan_flicker < row.pan_flicker_high
    )
    assert 0 <= row.pan_jumps < 0.1
    with pytest.raises(LookupError):
        result.row("power8")


def test_what_is_kept_is_not_measured_again_and_what_is_damaged_is(found, monkeypatch):
    result, kept = found
    measured = []
    right = RayUnit.prepared
    monkeypatch.setattr(RayUnit, "prepared", lambda unit: measured.append(unit) or right(unit))
    monkeypatch.setattr(SceneUnit, "prepared", lambda unit: pytest.fail("measured again"))
    again = moit.frontier(NAMES, size="tiny", progress=False, out=kept)
    assert again.rows == result.rows and not measured
    (path,) = kept.glob("check-0/A-*/power4.json")
    content = json.loads(path.read_text())
    content["measured"]["colour"][0] = 0.0
    path.write_text(json.dumps(content))
    again = moit.frontier(NAMES, size="tiny", progress=False, out=kept)
    assert again.rows == result.rows and [unit.letter for unit in measured] == ["A"]


def test_what_is_kept_of_another_core_is_measured_again(tmp_path, monkeypatch):
    drawn = draw_named("check")
    unit = RayUnit(drawn, "A", 200, 3)
    one = moit.technique("power4")
    kept = running.KeptMeasures(tmp_path)
    ((_, measured),) = running.measured_by(unit, [one], kept, print)
    assert kept.find(unit, one) == measured
    built, core = tmp_path / "core.so", Path(_core.__file__).read_bytes()
    monkeypatch.setattr(_core, "__file__", str(built))
    for content, same in ((core + b".", False), (core, True)):
        built.write_bytes(content)
        core_digest.cache_clear()
        assert (kept.find(unit, one) == measured) is same


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    labels = []

    def listener(done, total, label):
        labels.append(label)
        if done == 10:
            raise KeyboardInterrupt

    names = ["wboit", "power4"]
    with pytest.raises(KeyboardInterrupt):
        moit.frontier(names, size="tiny", progress=listener, out=tmp_path)
    assert len(labels) == 11 and len(list(tmp_path.rglob("*.json"))) == 10
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".json"]


def test_large_pictures_are_of_what_is_near_the_front(monkeypatch):
    monkeypatch.setitem(running.SIZES, "tiny", (10, 2, ((32, 18), (48, 27))))
    monkeypatch.setattr(running, "SCENES", ("panes", "cloud"))
    names = ("wboit", "power4", "fourier15", "depth-peeling8", "adaptive4")
    monkeypatch.setattr(running, "candidates", lambda: [moit.technique(name) for name in names])
    labels = []
    result = moit.frontier(size="tiny", progress=lambda done, total, _: labels.append(total))
    large = {row.technique for row in result.rows if row["flip_48x27"] is not None}
    assert large == {"wboit", "power4", "adaptive4"}  # of others passes or errors are too many
    assert all(row["flip"] == row["flip_32x18"] for row in result.rows)
    assert len(labels) == labels[-1] + 1
    given = moit.frontier(["power4", "hybrid4"], size="tiny", progress=False)
    assert given.row("hybrid4")["flip_48x27"] is not None


def test_rays_are_not_asked_of_what_blocks_of_pixels_share(monkeypatch):
    monkeypatch.setitem(running.SIZES, "tiny", (10, 2, ((32, 18),)))
    monkeypatch.setattr(running, "SCENES", ("panes",))
    names = ["moment-transparency-lr8", "moment-transparency"]
    small, own = moit.frontier(names, size="tiny", progress=False).rows
    assert small["A_colour"] is None and small["flip"] is not None and not small["note"]
    assert own["A_colour"] is not None


def test_what_fails_has_its_row_and_reason(monkeypatch):
    monkeypatch.setattr(running, "SCENES", ("panes", "teapots"))
    result = moit.frontier("power4(warp='none')", size="tiny", progress=False)
    (row,) = result.rows
    assert row["flip"] is None and row["A_colour"] is None and "warp='none'" in row["note"]
    assert "What could not be measured" in str(result)


def test_it_is_written_as_markdown_with_charts_as_a_table_and_as_one_page(found, tmp_path):
    result, _ = found
    paths = result.write(tmp_path)
    text = (tmp_path / "frontier.md").read_text()
    assert "`moit experiment frontier --draw check --size tiny`" in text
    assert "rays of seed 0" in text and "moit 0." in text
    assert f"{sum(one.variants for one in registry())} variants" in text
    linked = re.findall(r"\]\((pictures/[^)]+)\)", text)
    assert len(linked) == 3 and all((tmp_path / one).stat().st_size for one in linked)
    with open(paths[1], newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[1]["flip"]) == result.row("power4").flip
    assert not re.search(r'src="(?!data:)', (tmp_path / "frontier.html").read_text())
    assert result._repr_html_().startswith("<div>")


# Fronts and sentences, of made-up numbers


def row(name, size, passes, access, flip, **more):
    numbers = {"flip_low": 0.9 * flip, "flip_high": 1.1 * flip, "mean_order": 0.0}
    facts = {"technique": name, "bytes": size, "passes": passes, "access": access, "flip": flip}
    return Row({**facts, **numbers, "mean_jumps": 0.0, "random": False, **more})


ROWS = [
    row("small", 4.0, 1, "blend", 0.08),
    row("worse", 8.0, 1, "blend", 0.09),
    row("moments", 16.0, 2, "blend", 0.02),
    row("keys", 16.0, 3, "atomics", 0.01),
    row("nodes", 16.0, 2, "ordered", 0.005, mean_order=0.004),
    row("noise", 8.0, 3, "blend", 0.001, random=True),
]


def test_a_front_has_what_nothing_allowed_beats():
    def names(*means):
        return [one["technique"] for one in front(ROWS, Means(*means))]

    assert names(1, "ordered") == ["small"]
    assert names(2, "blend") == ["small", "moments"]
    assert names(3, "atomics") == ["small", "keys"]
    assert names(3, "ordered") == ["small", "nodes"]
    assert best(ROWS, Means(3, "atomics", 15.9))["technique"] == "small"
    assert best(ROWS, Means(3, "ordered", 3.9)) is None
    # as good for more bytes is beaten
    equal = [*ROWS, row("equal", 5.0, 1, "blend", 0.08)]
    assert [one["technique"] for one in front(equal, Means(1))] == ["small"]
    assert best(equal, Means(1))["technique"] == "small"


class Given:
    """Findings with FLIP of two scenes alone."""

    rows = ROWS

    def flips(self, name):
        (one,) = (row for row in ROWS if row["technique"] == name)
        return np.array([0.99, 1.01]) * one["flip"]


def test_sentences_name_the_best_by_bytes_access_and_passes():
    told = {text.split(" bytes.")[0]: text for text in paragraphs(Given())}
    assert "`small`, 4 bytes, one pass, FLIP 0.0800 (0.0720 to 0.0880)" in told["8"]
    assert "noise" not in "".join(told.values())
    at = told["16"]
    assert "Blending alone: `moments`" in at and "; `small`, 4 bytes, one pass" in at
    assert "`keys`, 16 bytes, three passes" in at and "Ordered access: `nodes`" in at
    assert at.count("`small`") == 1
    assert "order of arrival, by 0.00400" in at and "94% below" in at
    assert "Nothing that keeps more is better" in told["20"]


def test_charts_have_short_names():
    name = "adaptive8(merge='energy',normalize=True)"
    assert brief(name) == "adaptive8, merged, renormalised" and brief("wboit") == "wboit"
    assert brief("power6(resolution=4,total='full')") == "power6, 1/4, full b0"
    name = "slices36(bits=6,cells=256,resolution=2,table='tile',tile=12,total='byte')"
    assert brief(name) == "slices36, 6 bits, 256 cells, 1/2, tiles of 12, byte b0"
    names = [str(one) for one in candidates()]
    assert len(names) > 200 and len({brief(one) for one in names}) == len(names)
    assert not any("=" in brief(one) for one in names)


def test_aims_are_judged_by_what_was_found(found, monkeypatch):
    result, _ = found
    flip = result.row("power4").flip
    given = [
        Aim("power4", "flip", 0.9 * flip, None),
        Aim("power4", "flip", 1.1 * flip, None),
        Aim("power4", "flip", 1.2 * flip, 0.9 * flip),
        Aim("power4", "flip", 1.3 * flip, 1.1 * flip),
        Aim("power8", "flip", 1.0, None),
    ]
    monkeypatch.setattr(page, "aims", lambda: given)
    text = str(result)
    lines = text[text.index("What was aimed at") :].splitlines()[6:10]
    said = ["missed", "kept", "kept, not the aim", "kept"]
    assert [re.split(r" {2,}", line)[-1] for line in lines] == said
    assert "power8" not in text


def test_what_is_aimed_at_is_measured_and_tuned_by_variants():
    for one in aims():
        assert re.fullmatch(r"([A-G]|mean)_(colour|T|order|flicker|jumps)|flip|rmse", one.measure)
        assert one.aim is None or one.aim <= one.floor
    assert all(one.variants > 0 and one.what and one.draw for one in registry())


# The command


@pytest.fixture
def asked(monkeypatch):
    calls = []

    def called(*given, **options):
        calls.append((given, options))
        raise SystemExit(0)

    monkeypatch.setattr(running, "frontier", called)
    return calls


@pytest.mark.parametrize(
    ("line", "given"),
    [
        ("frontier", (None, "check", "small", 0)),
        (
            "frontier -t power4 -t wboit --draw tune --seed 3",
            (["power4", "wboit"], "tune", "small", 3),
        ),
        ("frontier --draw final --size full", (None, "final", "full", 0)),
        ("frontier --quick", (None, "check", "tiny", 0)),
    ],
)
def test_the_command_says_what_is_judged(line, given, asked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        main(["experiment", *line.split()])
    ((found, options),) = asked
    assert (*found, options["seed"]) == given
    assert options["out"] == "experiments/frontier/results"


@pytest.mark.parametrize("option", ["-t power4", "--draw check", "--seed 1"])
def test_its_options_are_its_own(option, capsys):
    assert main(["experiment", "mt-fig2", *option.split()]) != 0
    assert "frontier alone" in capsys.readouterr().err


def test_rows_of_nothing_measured_are_none():
    one = moit.technique("wboit")
    unit = RayUnit(draw_named("check"), "A", 1, 1)
    (row,) = Findings(draw_named("check"), "tiny", [one], [unit], {one: {unit: Measured({})}}).rows
    assert row["A_colour"] is None and row["mean_colour"] is None


def page_script():
    place = Path(__file__).parents[1] / "docs" / "frontier.py"
    pytest.importorskip("matplotlib", reason="the script draws, too")
    spec = importlib.util.spec_from_file_location("frontier_script", place)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


def test_its_picture_names_the_best_and_what_gains_enough():
    def point(name, x, y, on_front=True, front="a"):
        return Point(name, x, y, "#000000", name, on_front, front)

    given = [point(*one) for one in [("d", 8, 0.7), ("a", 1, 1.0), ("b", 2, 0.9), ("e", 9, 0.69)]]
    given += [point("c", 4, 0.1, False), point("f", 1, 0.5, True, "b")]
    script = page_script()
    shown = script.with_fewer_names(ErrorChart(given, "", "", groups=("a", "b", "c")))
    assert [p.name for p in shown.points] == ["a", "", "", "d", "e", "f"]
    assert [p.x for p in shown.points] == [1, 2, 4, 8, 9, 1]

    from matplotlib.figure import Figure

    figure = Figure()
    script.draw(shown, figure.add_subplot(), named=())
    (labels,) = (one for one in figure.axes[0].artists if hasattr(one, "labels"))
    assert [name for name, _, _ in labels.labels] == ["a", "d", "e", "f"]


def test_times_of_frames_are_written_anew_and_nothing_else():
    """What docs/frontier.py --gpu makes of a page, at the costs that are stored now."""
    script = page_script()
    written = (
        "| technique | bytes | GPU ms | FLIP |\n| :-- | --: | --: | --: |\n"
        "| `power4` * | 20 | 99 | 1 |\n"
        "| `sorted` | 6 | 7 | 1 |\n\n| technique | mean |\n| `power4` | 99 |\n"
    )
    found = script.with_gpu_times(written)
    expected = page.gpu_time(moit.technique("power4"))
    assert 0 < float(expected) < 99
    assert found == written.replace("20 | 99", f"20 | {expected}").replace("6 | 7", "6 | -")
    assert script.with_gpu_times(found) == found


def test_rows_that_are_measured_later_come_to_their_places():
    """What docs/frontier.py --rows makes of a page: stars and counts are as they are due then."""
    script = page_script()
    head = (
        "| technique | bytes | passes | access | FLIP 320x180 |\n| :-- | --: | --: | :-- | --: |\n"
    )
    page_before = (
        "3 techniques. 7 variants were tried.\n\n## Pictures\n\n" + head
        + "| `wboit` * | 1 | 1 | blend | 0.08 (0 to 1) |\n"
        + "| `power4` * | 20 | 2 | blend | 0.02 (0 to 1) |\n"
        + "| `anchors4` * | 44 | 3 | atomics | 0.003 (0 to 1) |\n\nlast\n"
    )  # fmt: skip
    later = "## Pictures\n\n" + head.replace("| FLIP", "| jumps | FLIP").replace(
        "--: |\n", "--: | --: |\n"
    )
    later += "| `neural-slices8` | 12 | 3 | atomics | 5 | 0.007 (0 to 1) |\n"
    later += "| `power4` | 20 | 2 | blend | 6 | 0.03 (0 to 1) |\n"
    found = script.with_rows(page_before, later).splitlines()
    variants = sum(one.variants for one in registry())
    assert found[0] == f"4 techniques. {variants} variants were tried."
    assert found[6:10] == [
        "| `wboit` * | 1 | 1 | blend | 0.08 (0 to 1) |",
        "| `power4` | 20 | 2 | blend | 0.03 (0 to 1) |",
        "| `neural-slices8` * | 12 | 3 | atomics | 0.007 (0 to 1) |",
        "| `anchors4` * | 44 | 3 | atomics | 0.003 (0 to 1) |",
    ]
    assert found[10:] == ["", "last"]
