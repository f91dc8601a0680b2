"""The cheapest technique that keeps to an error, by what was measured."""

import math
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest
from small import some_fragments

import moit
from moit import recommend
from moit.comparing import recommendation

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


def test_nothing_with_fewer_bits_would_do(scene):
    exact = moit.composite(scene, "sorted", dtype=np.float64)
    errors = {
        name: moit.metrics.rmse(moit.composite(scene, name), exact)
        for name in map(str, moit.techniques())
    }
    limit = 0.02
    answer = recommend(scene, max_error=limit, metric="rmse", by="bits", progress=False)
    bits = answer.technique.bits_per_pixel
    for one in moit.techniques():
        if one.random or one.bits_per_pixel is None or str(one) == "unsorted":
            continue
        # what misses by half in the windows is not tried
        if one.bits_per_pixel < bits and errors[str(one)] <= limit:
            estimate = next(e for e in answer.estimates if e.technique == one)
            assert estimate.error > 1.5 * limit


def test_what_nothing_can_do_is_sorted(scene):
    answer = recommend(scene, max_error=0, techniques=FEW, progress=False, metric="mse")
    assert str(answer.technique) == "sorted"
    assert "of 6 candidates" in answer.reason
    assert str(answer).startswith("sorted\n")
    assert "sorted" in answer._repr_html_()


def test_a_kept_fragment_counts_96_bits():
    f = some_fragments(16, 16, most=2)
    answer = recommend(f, max_error=1, by="bits", techniques=["power8"], progress=False)
    assert str(answer.technique) == "sorted"  # 288 bits are more than one fragment a pixel
    found = {str(e.technique): e.bits for e in answer.estimates}
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
    monkeypatch.setattr(recommendation, "time", clock)  # whatever is timed takes a second
    side = recommendation.SIDE
    f = some_fragments(5 * side, 6 * side, most=3)
    thin = f.counts.reshape(f.shape)[:, : 3 * side].sum()
    f = moit.merge([f, f[:, : 3 * side], f[:, : 3 * side]])  # the left half is the fullest
    windows = recommendation._windows(f, seed=0)
    assert len(windows) == len(set(map(str, windows))) == 24 < 30
    assert sum(columns.stop <= 3 * side for _, columns in windows) >= 12
    assert recommendation._windows(f, seed=1) != windows
    held = sum(len(f[window]) for window in windows)
    assert held < len(f) and thin < len(f)
    answer = recommend(f, max_error=1, metric="mse", techniques=["power4"], progress=False)
    assert [e.seconds for e in answer.estimates] == pytest.approx([len(f) / held] * 2)
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
    assert str(less.technique) == "sorted"
    assert "of 2 candidates 1 would be cheaper and miss it, by least power4" in less.reason
    assert less.reason.endswith("1 more did in the windows only")


def test_what_misses_by_less_than_half_in_the_windows_is_tried_on_the_whole():
    side = recommendation.SIDE
    f = some_fragments(5 * side, 6 * side, most=3)
    f = moit.merge([f, f[:, : 3 * side], f[:, : 3 * side]])  # the left half is the fullest
    exact = moit.composite(f, "sorted", dtype=np.float64)
    limit = float(moit.metrics.mse(moit.composite(f, "power4"), exact))
    answer = recommend(
        f, max_error=limit, metric="mse", by="bits", techniques=["power4"], progress=False
    )
    found = next(e for e in answer.estimates if str(e.technique) == "power4")
    assert limit < found.error < 1.5 * limit
    assert str(answer.technique) == "power4" and "no other of 2 candidates" in answer.reason


def test_costs_are_told_in_milliseconds_and_in_bits():
    f = some_fragments(16, 16)
    row = {"seconds": 0.0125, "bits_per_pixel": 160}
    assert recommendation._cost(row, f, "seconds") == "12.5 ms"
    assert recommendation._cost(row, f, "bits") == "160 bits a pixel"
    row["bits_per_pixel"] = None
    assert recommendation._cost(row, f, "bits") == f"{96 * len(f) / 256:.3g} bits a pixel"


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
        ({"f": some_fragments(5, 50)}, ValueError, "11 pixels a side"),
        ({"f": some_fragments(color=False)}, moit.FragmentsError, "color"),
    ],
)
def test_bad_arguments_are_named(options, error, words):
    with pytest.raises(error, match=words):
        recommend(**{"f": some_fragments(), "max_error": 0.1, "progress": False, **options})
