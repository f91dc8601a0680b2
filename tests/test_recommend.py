"""The cheapest technique that keeps to an error, by what was measured."""

import math
import re
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small import some_fragments

import moit
from moit import recommend
from moit.catalog.forms import better
from moit.catalog.winners import WINNERS
from moit.comparing import recommendation, trials

FEW = ("wboit", "power4", "power6", "trig3", "mlab4")


@pytest.fixture(scope="module")
def scene():
    return moit.scenes.load("mixed", (120, 90))


@pytest.mark.parametrize("metric", ["flip", "mse", "rmse", "mae"])
@pytest.mark.parametrize("by", ["seconds", "bits"])
def test_what_is_recommended_keeps_to_the_error(scene, metric, by):
    exact = moit.composite(scene, "sorted", dtype=np.float64)
    measure = getattr(moit.metrics, metric)
    limit = 1.0001 * measure(moit.composite(scene, "power6"), exact)
    chosen, report = recommend(
        scene, max_error=limit, metric=metric, by=by, techniques=FEW, progress=False
    )
    assert measure(moit.composite(scene, chosen), exact) <= limit
    assert report.rows[-1]["technique"] == str(chosen)


def brute(f, names, conditions, background, metric):
    """{name: (bits, error)} of those that keep to the conditions."""
    exact = moit.composite(f, "sorted", dtype=np.float64, background=background)
    found = {}
    for one in map(moit.technique, names):
        bits = one.bits_per_pixel
        bits = 96 * len(f) / f.counts.size if bits is None else bits
        kept = (
            bits <= conditions.get("max_bits", math.inf)
            and (conditions.get("ordered", True) or not one.needs_order)
            and (one.geometry_passes or math.inf) <= conditions.get("max_passes", math.inf)
            and (conditions.get("exact", True) or not one.sorts)
        )
        if kept:
            image = moit.composite(f, one, background=background)
            found[str(one)] = bits, float(getattr(moit.metrics, metric)(image, exact))
    return found


CONDITIONS = {
    "max_bits": (4, 40, 112, 150, 240),
    "ordered": (False,),
    "max_passes": (1, 2, 3),
    "exact": (False,),
}
CANDIDATES = [str(one) for one in moit.techniques() if not one.kind.startswith(("neural", "per"))]


def ask(seed, loaded={}):  # noqa: B006 - scenes are made once
    """A question drawn at random, and the answer to it by trying everything."""
    rng = np.random.default_rng([16, seed])
    name = rng.choice(["panes", "cloud", "mixed", "hair", "spheres", "neural-training"])
    size = [(24, 18), (60, 50)][rng.integers(2)]
    if (name, size) not in loaded:
        loaded[name, size] = moit.scenes.load(name, size)
    f = loaded[name, size]
    conditions = {
        key: values[rng.integers(len(values))]
        for key, values in CONDITIONS.items()
        if rng.random() < 0.4
    }
    background = [(0, 0, 0), (0.2, 0.9, 0.4), rng.random((*f.shape, 3))][rng.integers(3)]
    names = list(rng.choice(CANDIDATES, rng.integers(2, 9), replace=False))
    metric = str(rng.choice(["mse", "rmse", "mae"]))
    of = brute(f, names, conditions, background, metric)
    errors = [error for _, error in of.values()] or [0.01]
    limit = float(rng.choice(errors) * rng.choice([0.7, 1.0, 1.3]))
    answer = recommend(
        f,
        max_error=limit,
        metric=metric,
        by="bits",
        techniques=names,
        background=background,
        progress=False,
        **conditions,
    )
    fit = [
        (bits, error, name)
        for name, (bits, error) in of.items()
        if error <= limit or name == "sorted"
    ]
    return answer, names, of, min(fit)[:2] if fit else None


@pytest.mark.parametrize("seed", range(25))
def test_the_answer_is_that_of_trying_everything(seed):
    answer, names, of, least = ask(seed)
    assert [str(row.technique) for row in answer.rows if row.note == ""] == []
    assert {row.technique for row in answer.rows} == set(names)
    if least is None:
        assert answer.technique is None and "none of" in answer.reason
        if of:
            assert str(answer.nearest) == min(of, key=lambda name: of[name][1])
        assert str(answer).startswith("nothing fits") and str(answer.nearest) in answer.reason
    else:
        assert of[str(answer.technique)] == least


def test_by_seconds_all_that_was_quicker_was_measured_to_miss(scene):
    for limit in (0.05, 0.01, 0.002):
        answer = recommend(scene, max_error=limit, metric="rmse", progress=False)
        chosen = next(row for row in answer.rows if row.technique == str(answer.technique))
        assert chosen.rmse <= limit or chosen.technique == "sorted"
        assert chosen.note == "the answer"
        for row in answer.rows:
            if row.seconds < chosen.seconds:
                assert row.rmse > limit and row.note.startswith("rmse")
        assert answer.report.rows[-1].technique == str(answer.technique)
        assert answer.report.results[-1].image is not None


def test_a_window_that_misjudges_rejects_nothing(scene, monkeypatch):
    """Screening orders the work only: whatever it says, the answer is the same."""
    names = ["wboit", "power4", "power8", "mlab4", "sorted"]
    how = {"metric": "rmse", "techniques": names, "progress": False}
    of = brute(scene, names, {}, (0, 0, 0), "rmse")
    limit = 1.0001 * of["power4"][1]
    least = min((bits, name) for name, (bits, error) in of.items() if error <= limit)[1]

    def wrong(tried, one, windows, scale):
        error = 9.0 if of[str(one)][1] <= limit else 0.0
        return trials.Estimate(one, error, 1.0, trials.bits_of(None, tried.f))

    def right_bits(tried, one, windows, scale):
        found = wrong(tried, one, windows, scale)
        bits = trials.bits_of(one.bits_per_pixel, tried.f)
        return trials.Estimate(one, found.error, found.seconds, bits)

    monkeypatch.setattr(trials, "estimate_of", right_bits)
    assert str(recommend(scene, max_error=limit, by="bits", **how).technique) == least
    answer = recommend(scene, max_error=limit, **how)
    assert of[str(answer.technique)][1] <= limit


def test_each_condition_is_told_in_the_table(scene):
    names = ["sorted", "power4", "power8", "mlab4", "two-moments-pass", "wboit-eq9"]
    answer = recommend(
        scene,
        max_error=1,
        metric="mse",
        by="bits",
        techniques=",".join(names),
        max_bits=200,
        ordered=False,
        max_passes=2,
        exact=False,
        progress=False,
    )
    notes = {row.technique: row.note for row in answer.rows}
    assert str(answer.technique) == "wboit-eq9" and notes["wboit-eq9"] == "the answer"
    assert "sorts" in notes["sorted"]
    assert notes["power8"] == "keeps 288 bits of at most 200"
    assert "rasterizer-ordered" in notes["mlab4"]
    assert "3 times, at most 2" in notes["two-moments-pass"]
    assert "more bits than wboit-eq9" in notes["power4"]
    text, page = str(answer), answer._repr_html_()
    for name in names:
        assert name in text and name in page
        assert notes[name] in text
    assert {e.technique.base_name for e in answer.estimates} == {"power4", "wboit-eq9"}


def test_where_nothing_fits_the_nearest_is_told(scene):
    how = {"metric": "mse", "by": "bits", "progress": False}
    answer = recommend(scene, max_error=0, techniques=FEW, **how)
    errors = brute(scene, FEW, {}, (0, 0, 0), "mse")
    assert answer.technique is None
    assert str(answer.nearest) == min(FEW, key=lambda name: errors[name][1])
    assert answer.report.rows[-1].technique == str(answer.nearest)
    technique, report = answer
    assert technique is None and report is answer.report
    none = recommend(scene, max_error=1, techniques=["power4", "power8"], max_bits=9, **how)
    assert none.technique is None and str(none.nearest) == "power4" and not none.report.rows
    assert "keeps 160 bits of at most 9" in none.reason
    assert "nothing fits" in str(none) and "power8" in none._repr_html_()


def test_what_nothing_else_can_do_is_sorted(scene):
    answer = recommend(
        scene, max_error=0, techniques=[*FEW, "sorted"], progress=False, metric="mse"
    )
    assert str(answer.technique) == "sorted"
    assert "of 6 candidates" in answer.reason
    assert str(answer).startswith("sorted\n")
    assert "sorted" in answer._repr_html_()


def test_a_kept_fragment_counts_96_bits():
    f = some_fragments(16, 16, most=2)
    names = ["power8", "a-buffer"]
    answer = recommend(f, max_error=1, by="bits", techniques=names, progress=False)
    assert str(answer.technique) == "sorted"  # 288 bits are more than one fragment a pixel
    found = {row.technique: row.bits for row in answer.rows}
    assert found == {"sorted": 96 * len(f) / 256, "power8": 288}


def test_a_technique_that_cannot_is_passed_over():
    f = some_fragments(16, 16)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, transmission=f.color, shape=f.shape)
    answer = recommend(f, max_error=10, techniques=["mlab4", "power4"], progress=False)
    failed = next(e for e in answer.estimates if str(e.technique) == "mlab4")
    assert math.isinf(failed.error)
    assert "transmission" in failed.note
    assert str(answer.technique) != "mlab4"


def test_estimates_are_of_the_whole_image_by_what_the_fullest_windows_took(monkeypatch):
    ticks = count()
    clock = SimpleNamespace(perf_counter=lambda: float(next(ticks)))
    monkeypatch.setattr(trials, "time", clock)  # whatever is timed takes a second
    side = trials.SIDE
    f = some_fragments(5 * side, 6 * side, most=3)
    thin = f.counts.reshape(f.shape)[:, : 3 * side].sum()
    f = moit.merge([f, f[:, : 3 * side], f[:, : 3 * side]])  # the left half is the fullest
    windows = trials.windows_of(f, seed=0)
    assert len(windows) == len(set(map(str, windows))) == 24 < 30
    assert sum(columns.stop <= 3 * side for _, columns in windows) >= 12
    assert trials.windows_of(f, seed=1) != windows
    held = sum(len(f[window]) for window in windows)
    assert held < len(f) and thin < len(f)
    answer = recommend(f, max_error=1, metric="mse", techniques=["power4"], progress=False)
    assert [e.seconds for e in answer.estimates] == pytest.approx([24 * len(f) / held])
    exact = moit.composite(f, "sorted", dtype=np.float64)
    whole = moit.metrics.mse(moit.composite(f, "power4"), exact)
    found = next(e for e in answer.estimates if str(e.technique) == "power4")
    assert found.error == pytest.approx(whole, rel=0.3)  # most of the image is in the windows


@pytest.mark.parametrize("metric", recommendation.METRICS)
def test_of_an_image_of_one_window_the_estimate_is_the_error(metric):
    f = some_fragments(48, 44)
    answer = recommend(f, max_error=9, metric=metric, techniques=["power4"], progress=False)
    exact = moit.composite(f, "sorted", dtype=np.float64)
    error = getattr(moit.metrics, metric)(moit.composite(f, "power4"), exact)
    found = next(e for e in answer.estimates if str(e.technique) == "power4")
    assert found.error == pytest.approx(error, rel=1e-6)


def test_an_error_of_exactly_so_much_is_small_enough():
    f = some_fragments(48, 44)
    exact = moit.composite(f, "sorted", dtype=np.float64)
    limit = float(moit.metrics.mse(moit.composite(f, "power4"), exact))
    options = {"metric": "mse", "by": "bits", "techniques": ["power4"], "progress": False}
    assert str(recommend(f, max_error=limit, **options).technique) == "power4"
    less = recommend(f, max_error=0.999 * limit, **options)
    assert less.technique is None and less.nearest == moit.technique("power4")
    assert "none of 1 candidates keeps to mse" in less.reason
    options["techniques"] = ["power4", "power8"]
    more = recommend(f, max_error=0.999 * limit, **options)
    assert str(more.technique) == "power8"
    assert "of 2 candidates 1 would be cheaper and miss it, by least power4" in more.reason


def test_costs_are_told_in_milliseconds_and_in_bits():
    row = {"seconds": 0.0125, "bits": 160}
    assert recommendation._cost(row, "seconds") == "12.5 ms"
    assert recommendation._cost(row, "bits") == "160 bits a pixel"


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"max_error": -1}, ValueError, "max_error"),
        ({"max_error": np.nan}, ValueError, "max_error"),
        ({"max_error": "small"}, TypeError, "max_error"),
        ({"metric": "psnr"}, ValueError, "metric: expected 'flip'"),
        ({"by": "money"}, ValueError, "by: expected 'seconds', 'bits'"),
        ({"techniques": []}, ValueError, "at least one"),
        ({"techniques": 3}, TypeError, "techniques"),
        ({"techniques": ["powr4"]}, ValueError, "power4"),
        ({"max_bits": -1}, ValueError, "max_bits"),
        ({"max_bits": "few"}, TypeError, "max_bits"),
        ({"max_passes": 0}, ValueError, "max_passes"),
        ({"max_passes": 1.5}, TypeError, "max_passes"),
        ({"ordered": 1}, TypeError, "ordered"),
        ({"exact": None}, TypeError, "exact"),
        ({"background": (1, 2)}, ValueError, "background"),
        ({"background": np.zeros((3, 3, 3))}, ValueError, "background"),
        ({"threads": 0}, ValueError, "threads"),
        ({"f": some_fragments(5, 50)}, ValueError, "11 pixels a side"),
        ({"f": some_fragments(color=False)}, moit.FragmentsError, "color"),
    ],
)
def test_bad_arguments_are_named(options, error, words):
    with pytest.raises(error, match=words):
        recommend(**{"f": some_fragments(), "max_error": 0.1, "progress": False, **options})


def test_better_forms_are_candidates_of_their_own(scene):
    answer = recommend(scene, max_error=1, metric="mse", by="bits", ordered=False, progress=False)
    names = [str(row.technique) for row in answer.rows]
    assert len(set(names)) == len(names)
    usual = [one for one in moit.techniques() if not one.random and one.engine == "core"]
    wanted = {str(form) for one in usual for form in (one, better(one))} - {"unsorted"}
    wanted |= set(WINNERS)
    assert set(names) == wanted and "power4(exclude_self=True,overestimation=0.4)" in wanted
    for row in answer.rows:
        if moit.technique(row.technique).needs_order:
            assert "needs rasterizer-ordered access" in row.note


PAGE = Path(__file__).parents[1] / "docs" / "frontier.md"


def to_take():
    """What the page of the frontier names as best, by bytes."""
    chapter = PAGE.read_text().split("\n## ")[1]
    assert chapter.startswith("What to take")
    found = {}
    for line in chapter.splitlines():
        if bytes_of := re.match(r"(\d+) bytes\. ", line):
            found[int(bytes_of[1])] = re.findall("`([^`]+)`", line)
    return found


def test_what_the_frontier_names_is_looked_at():
    named = to_take()
    assert set(named) == {8, 16, 20, 32, 44, 64}
    every = set().union(*named.values())
    assert set(map(str, recommendation._candidates(None))) >= every
    usual = {str(one) for one in moit.techniques()}
    assert set(WINNERS) <= every and not set(WINNERS) & usual  # and no more than these


def test_budgets_are_answered_by_what_the_frontier_names():
    f, named = moit.scenes.load("mixed", (96, 54)), to_take()
    for most, ordered in ((8, False), (32, True), (44, False)):
        answer = recommend(
            f,
            max_error=0,
            by="bits",
            max_bits=8 * most,
            ordered=ordered,
            exact=False,
            progress=False,
        )
        assert str(answer.nearest) in named[most], (most, ordered, answer.nearest)


def test_what_keeps_as_many_bits_as_allowed_is_allowed_and_unknown_passes_are_not():
    f, how = (
        moit.scenes.load("panes", (16, 12)),
        {"max_error": 1.0, "by": "bits", "progress": False},
    )
    bits = moit.technique("power4").bits_per_pixel
    assert moit.recommend(f, techniques=["power4"], max_bits=bits, **how).technique is not None
    assert moit.technique("per-pixel").geometry_passes is None
    refused = moit.recommend(f, techniques=["per-pixel"], max_passes=9, **how)
    assert refused.technique is None
