"""compare: what its rows say, how it goes on after failures and interruptions."""

import json
import math
import os
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from itertools import accumulate
from multiprocessing import get_context
from types import SimpleNamespace

import numpy as np
import pytest
from small import some_fragments

import moit
from moit.catalog import WeightedBlended
from moit.comparing import measurement
from moit.comparing.comparison import named_scenes
from moit.comparing.measurement import curve_depths, telling_pixels
from moit.comparing.results_folder import fingerprint, question
from moit.metrics import NAMES

FIELDS = (
    "scene device technique bits_per_pixel seconds seconds_iqr fragments_per_second "
    "mse rmse mae psnr ssim flip hdr_flip T_mae T_p99 T_max T_alpha note"
).split()
MEASURED = ("seconds", "seconds_iqr", "fragments_per_second")
CHOSEN = ["sorted", "unsorted", "wboit", "power4"]


def processes(count):
    """An executor of new processes: a forked one may inherit locks that threads hold."""
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def compare(f, techniques=CHOSEN, **options):
    return moit.compare(f, techniques, **{"repeat": 2, "progress": False, **options})


def unmeasured(report):
    """The rows without what a clock says."""
    return [{k: v for k, v in row.items() if k not in MEASURED} for row in report.rows]


def failing_weight(depth, alpha, color):
    raise RuntimeError("no weight <today>\nand a second line")


def ones(depth, alpha, color):
    return np.ones_like(depth)


def test_a_row_has_the_promised_fields_in_order():
    report = compare(some_fragments())
    assert [list(row) for row in report.rows] == [FIELDS] * len(CHOSEN)
    assert [row["technique"] for row in report.rows] == CHOSEN
    assert report.columns == tuple(FIELDS)


def test_all_techniques_are_compared_by_default():
    report = compare(some_fragments(12, 12), None, repeat=1)
    assert [row["technique"] for row in report.rows] == [str(t) for t in moit.techniques()]
    as_published = "as published, not renormalised"
    for row, technique in zip(report.rows, moit.techniques(), strict=True):
        conserves = getattr(technique, "normalize", True)
        assert row["note"].partition(";")[0] == ("" if conserves else as_published)
        assert row["bits_per_pixel"] == technique.bits_per_pixel


def test_image_errors_are_those_of_the_float64_reference():
    f = some_fragments()
    reference = moit.composite(f, "sorted", dtype=np.float64)
    for row in compare(f).rows:
        # The image is kept as float32 only after it was measured.
        expected = moit.errors(moit.composite(f, row["technique"]), reference)
        assert {name: row[name] for name in NAMES} == expected


def test_transmittance_errors_are_those_of_the_exact_transmittance():
    f = some_fragments(dtype=np.float64)
    exact = moit.transmittance(f, "sorted")
    for row in compare(f).rows:
        off = np.abs(moit.transmittance(f, row["technique"]) - exact)
        assert row["T_mae"] == off.mean()
        assert row["T_p99"] == np.percentile(off, 99)
        assert row["T_max"] == off.max()


def test_equal_depths_may_count_as_nearer_or_not():
    """`sorted` has the earlier one in front, a lower bound from moments nothing at its depth."""
    f = moit.Fragments([0, 3], [2.0, 2.0, 2.0], [0.5, 0.25, 0.5], np.ones((3, 3)))
    rows = compare(f, ["sorted", "power4(overestimation=0.0)", "unsorted"]).rows
    assert rows[0]["T_max"] == 0
    assert rows[1]["T_max"] < 1e-9  # rounding, in float64
    assert rows[2]["T_max"] > 0.1  # the last one in front of all is neither


def test_any_technique_may_be_the_reference():
    f = some_fragments()
    report = compare(f, reference="power4")
    assert report.reference == "power4"
    reference = moit.composite(f, "power4", dtype=np.float64)
    assert report.rows[0]["flip"] == moit.metrics.flip(moit.composite(f, "sorted"), reference)


def test_pixels_that_tell_most_are_those_with_the_most_many_and_the_usual_number():
    counts = np.arange(1, 12)  # a row of pixels with 1 to 11 fragments, all seen through
    f = moit.Fragments(np.append(0, np.cumsum(counts)), np.ones(66), np.full(66, 0.5))
    # of the ten with two or more: the last, and those at .8 and .4 of the way
    assert telling_pixels(f) == ((0, 10), (0, 8), (0, 5))
    one = moit.Fragments([0, 0, 1, 1], [1.0], [0.5], shape=(3, 1))
    assert telling_pixels(one) == ((1, 0),)
    assert telling_pixels(moit.Fragments([0, 0], [], [])) == ()


def test_pixels_are_told_by_what_is_seen_through():
    """Neither what is opaque, nor what that hides, nor what is not there."""
    offsets = [0, 3, 7, 9, 12]
    depth = [1.0, 2, 3, 1, 2, 3, 4, 1, 2, 1, 2, 3]
    alpha = [0.5, 1, 0.5, 1, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0, 0.5]
    f = moit.Fragments(offsets, depth, alpha, shape=(2, 2))
    assert measurement._seen_through(f).tolist() == [1, 0, 2, 2]
    coloured = np.zeros((12, 3))
    coloured[3] = 0.5  # the opaque one of the second pixel lets light through
    g = moit.Fragments(offsets, depth, alpha, transmission=coloured, shape=(2, 2))
    assert measurement._seen_through(g).tolist() == [1, 4, 2, 2]
    tie = moit.Fragments([0, 3], [1.0, 1, 2], [0.5, 1, 0.5])
    assert measurement._seen_through(tie).tolist() == [1]


def test_a_curve_is_asked_for_around_each_fragment_and_evenly_between():
    f = moit.Fragments([0, 3, 3], [2.0, 4.0, 7.0], [0.5] * 3, shape=(2, 1), depth_range=(1, 9))
    depth = curve_depths(f, (0, 0))
    assert (np.diff(depth) > 0).all()
    for at in f.depth:
        i = int(np.flatnonzero(depth == at)[0])
        assert depth[i + 1] == np.nextafter(at, np.inf)
    assert depth[0] == pytest.approx(2 - 0.06 * 5) and depth[-1] == pytest.approx(7 + 0.06 * 5)
    even = np.setdiff1d(depth, np.concatenate([f.depth, np.nextafter(f.depth, np.inf)]))
    assert len(even) == 160 and np.ptp(np.diff(even)) < 1e-9
    assert curve_depths(f, (1, 0)).tolist() == [1, 9]
    close = moit.Fragments([0, 1], [0.01], [0.5], depth_range=(0.01, 10))
    assert curve_depths(close, (0, 0))[0] == pytest.approx(0.005)  # in front, and never behind 0


def test_a_scene_is_described_by_its_fragments_and_exact_curves():
    f = some_fragments(20, 30, most=7)
    report = compare(f, ["power4"], reference="power8")
    scene = report.scenes["fragments"]
    assert (scene.name, scene.shape, scene.fragments) == ("fragments", (20, 30), len(f))
    assert scene.most_layers == f.counts.max() == 7
    reference = moit.composite(f, "power8", dtype="f8")
    assert np.array_equal(scene.reference, reference.astype("f4"))
    assert scene.pixels == telling_pixels(f)
    for at, depth, exact, held in zip(
        scene.pixels, scene.depths, scene.curves, report.results[0].curves, strict=True
    ):
        assert np.array_equal(depth, curve_depths(f, at))
        assert np.array_equal(exact, moit.transmittance(f[at], "sorted", depth).ravel())
        assert np.array_equal(held, moit.transmittance(f[at], "power4", depth).ravel())


def test_a_scene_is_read_and_composited_once_for_all_of_its_techniques(monkeypatch):
    asked = []
    real = measurement.exact
    monkeypatch.setattr(measurement, "exact", lambda *a: asked.append(a) or real(*a))
    scenes = {"a": some_fragments(12, 12, seed=1), "b": some_fragments(12, 12, seed=2)}
    compare(scenes, ["sorted", "wboit", "power4"])
    assert len(asked) == 2


def test_an_image_of_eleven_pixels_has_errors():
    assert compare(some_fragments(11, 11), ["power4"]).rows[0]["flip"] is not None


def test_every_device_and_technique_has_its_row_and_its_files(monkeypatch, tmp_path):
    monkeypatch.setattr("moit.comparing.comparison.gpu_of", lambda device: None)
    f = some_fragments(5, 5)
    report = compare(f, ["sorted", "wboit"], devices=["cpu", "gpu"], out=tmp_path)
    kept = sorted(path.stem for path in tmp_path.glob("*/*.json"))
    assert kept == ["sorted", "sorted-gpu", "wboit", "wboit-gpu"]
    assert [(row["device"], row["technique"]) for row in report.rows] == [
        *(("cpu", "sorted"), ("cpu", "wboit"), ("gpu", "sorted"), ("gpu", "wboit"))
    ]


def test_speed_is_that_of_the_median():
    f = some_fragments()
    for row in compare(f, repeat=3).rows:
        assert row["seconds"] > 0
        assert row["seconds_iqr"] >= 0
        assert row["fragments_per_second"] == pytest.approx(len(f) / row["seconds"])


def test_seconds_are_the_median_and_its_range_from_quarter_to_quarter(monkeypatch):
    lasts = (5, 1, 2, 9, 3)
    clock = iter(accumulate(x for pair in zip([0] * 5, lasts, strict=True) for x in pair))
    monkeypatch.setattr(measurement, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    f = some_fragments()
    (row,) = compare(f, ["power4"], repeat=5).rows
    assert (row["seconds"], row["seconds_iqr"]) == (3, 5 - 2)
    assert row["fragments_per_second"] == len(f) / 3


def test_alpha_weighs_the_last_of_the_transmittance_errors():
    f = some_fragments(dtype=np.float64)
    off = np.abs(moit.transmittance(f, "unsorted") - moit.transmittance(f, "sorted"))
    (row,) = compare(f, ["unsorted"]).rows
    assert row["T_alpha"] == pytest.approx((off * f.alpha).sum() / f.alpha.sum())


@pytest.mark.parametrize("names", [("flip",), ("rmse", "psnr"), ()])
def test_metrics_may_be_chosen(names):
    report = compare(some_fragments(), metrics=names)
    assert report.metrics == names
    expected = [f for f in FIELDS if f not in NAMES or f in names]
    assert [f for f in report.rows[0] if f not in NAMES] == [f for f in expected if f not in NAMES]
    assert [f for f in report.rows[0] if f in NAMES] == list(names)


def test_an_image_below_eleven_pixels_has_no_errors_but_a_note():
    report = compare(some_fragments(5, 40))
    for row in report.rows:
        assert all(row[name] is None for name in NAMES)
        assert "11 pixels" in row["note"]
        assert row["T_mae"] is not None
        assert row["seconds"] > 0


def test_no_fragments_at_all_are_compared_too():
    f = moit.Fragments(np.zeros(12 * 12 + 1, int), [], [], np.zeros((0, 3)), shape=(12, 12))
    for row in compare(f).rows:
        assert row["mse"] == 0
        assert row["psnr"] == math.inf
        assert row["T_max"] is None
        assert row["fragments_per_second"] == 0


def test_no_pixels_at_all_are_compared_too():
    f = moit.Fragments([0], [], [], np.zeros((0, 3)), shape=(0, 7))
    report = compare(f)
    assert all(row["mse"] is None and row["seconds"] is not None for row in report.rows)


def test_a_technique_that_fails_has_its_row_and_others_go_on():
    report = compare(some_fragments(), ["sorted", WeightedBlended(failing_weight), "power4"])
    failed = report.rows[1]
    assert list(failed) == FIELDS
    assert failed["note"] == "RuntimeError: no weight <today>"
    assert failed["seconds"] is None and failed["flip"] is None and failed["T_mae"] is None
    assert failed["bits_per_pixel"] == 8
    assert report.rows[2]["flip"] is not None


def test_rows_do_not_depend_on_the_executor():
    f = {"a": some_fragments(seed=1), "b": some_fragments(seed=2)}
    here = compare(f)
    with ThreadPoolExecutor(2) as executor:
        assert unmeasured(compare(f, executor=executor)) == unmeasured(here)
    with processes(2) as executor:
        assert unmeasured(compare(f, executor=executor)) == unmeasured(here)


def test_a_path_is_read_by_the_process_that_measures(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    moit.save("one.npz", some_fragments())
    with processes(1) as executor:
        report = compare("one.npz", executor=executor)
    assert unmeasured(report) == unmeasured(compare("one.npz"))
    assert report.rows[0]["scene"] == "one"


def test_what_cannot_be_sent_to_a_process_fails_alone():
    techniques = ["sorted", WeightedBlended(lambda depth, alpha, color: depth)]
    with processes(1) as executor:
        rows = compare(some_fragments(), techniques, executor=executor).rows
    assert rows[0]["note"] == ""
    assert "ickl" in rows[1]["note"] and rows[1]["seconds"] is None


class Recording(Executor):
    """Works at once, and counts."""

    def __init__(self):
        self.calls = 0

    def submit(self, function, /, *arguments, **options):
        self.calls += 1
        future = Future()
        try:
            future.set_result(function(*arguments, **options))
        except BaseException as error:
            future.set_exception(error)
        return future


def test_any_executor_will_do():
    executor = Recording()
    report = compare(some_fragments(), executor=executor)
    assert executor.calls == 1 + len(CHOSEN)  # the reference, and each technique
    assert all(row["flip"] is not None for row in report.rows)


def test_a_folder_keeps_each_result_and_is_asked_first(tmp_path):
    f = some_fragments()
    first = compare(f, out=tmp_path)
    assert sorted(p.name for p in (tmp_path / "fragments").iterdir()) == sorted(
        f"{name}.{kind}" for name in CHOSEN for kind in ("exr", "json")
    )
    again = compare(f, out=tmp_path)
    assert again.rows == first.rows  # times as well: nothing was measured
    for one, other in zip(first.results, again.results, strict=True):
        assert np.array_equal(one.image, other.image)
        assert (one.curves is None) == (other.curves is None)
        for a, b in zip(one.curves or (), other.curves or (), strict=True):
            assert np.array_equal(a, b)


def test_a_kept_result_is_readable(tmp_path):
    f = some_fragments()
    compare(f, out=tmp_path)
    row = json.loads((tmp_path / "fragments" / "power4.json").read_text())["row"]
    assert list(row) == FIELDS
    image = moit.read_image(tmp_path / "fragments" / "power4.exr")
    assert np.array_equal(image, moit.composite(f, "power4"))


@pytest.mark.usefixtures("no_two_seconds_alike")
@pytest.mark.parametrize(
    "change",
    [
        {"f": some_fragments(seed=7)},
        {"repeat": 3},
        {"reference": "power8"},
        {"metrics": ("flip",)},
        {"background": (0, 0, 0.5)},
    ],
)
def test_another_question_is_measured_anew(tmp_path, change):
    f = some_fragments()
    first = compare(f, out=tmp_path)
    options = {"f": f, "out": tmp_path} | change
    assert compare(**options).rows[2]["seconds"] != first.rows[2]["seconds"]


def test_whatever_is_another_number_of_fragments_has_another_fingerprint():
    arrays = {
        "offsets": np.array([0, 2, 2, 3]),
        "depth": np.array([1.0, 2, 3]),
        "alpha": np.array([0.5, 0.25, 1]),
        "color": np.full((3, 3), 0.5),
        "transmission": np.full((3, 3), 0.25),
        "shape": (1, 3),
        "depth_range": (1.0, 4.0),
        "origin": (0, 0),
        "dtype": np.float32,
    }
    changes = [
        {"offsets": np.array([0, 1, 2, 3])},
        {"depth": np.array([1.0, 2, 3.5])},
        {"alpha": np.array([0.5, 0.25, 0.75])},
        {"color": np.full((3, 3), 0.75)},
        {"color": None},
        {"transmission": np.full((3, 3), 0.125)},
        {"transmission": None},
        {"shape": (3, 1)},
        {"depth_range": (1.0, 5.0)},
        {"depth_range": (0.5, 4.0)},
        {"origin": (0, 1)},
        {"origin": (1, 0)},
        {"dtype": np.float64},
    ]
    all_ = [fingerprint(moit.Fragments(**(arrays | change))) for change in ({}, *changes)]
    assert len(set(all_)) == len(all_)
    assert fingerprint(moit.Fragments(**arrays)) == all_[0]


def test_another_job_is_another_question(monkeypatch):
    job = measurement.Job(
        scene="s",
        token="t",
        source="panes",
        technique=moit.technique("power4"),
        label="power4",
        device="cpu",
        reference=moit.technique("sorted"),
        metrics=("flip",),
        repeat=2,
        pixels=(),
        background=(0.0, 0.0, 0.0),
    )
    changes = [
        {"technique": moit.technique("power4(bias=0.0)")},
        {"device": "gpu"},
        {"reference": moit.technique("power8")},
        {"metrics": ("rmse",)},
        {"repeat": 3},
        {"background": (0.0, 0.0, 1.0)},
    ]
    first = question(job, "f")
    asked = [question(replace(job, **change), "f") for change in changes] + [question(job, "g")]
    monkeypatch.setattr("moit.system.version.VERSION", "another")
    asked.append(question(job, "f"))
    assert all(one != first for one in asked)
    json.dumps(asked)


@pytest.mark.usefixtures("no_two_seconds_alike")
def test_functions_as_weights_are_measured_anew(tmp_path):
    f, technique = some_fragments(), [WeightedBlended(ones)]
    first = compare(f, technique, out=tmp_path)
    assert compare(f, technique, out=tmp_path).rows[0]["seconds"] != first.rows[0]["seconds"]


def test_a_damaged_result_is_measured_anew(tmp_path):
    f = some_fragments()
    first = compare(f, out=tmp_path)
    folder = tmp_path / "fragments"
    (folder / "power4.json").write_text('{"question": 1')
    os.truncate(folder / "wboit.exr", 100)
    (folder / "unsorted.json").write_text("[]")
    again = compare(f, out=tmp_path)
    assert unmeasured(again) == unmeasured(first)
    assert again.rows[0] == first.rows[0]
    assert json.loads((folder / "power4.json").read_text())["row"]["technique"] == "power4"


def test_a_failure_is_tried_again(tmp_path):
    f = some_fragments()
    technique = WeightedBlended(failing_weight)
    compare(f, [technique], out=tmp_path)
    assert compare(f, [technique], out=tmp_path).rows[0]["note"].startswith("RuntimeError")


def test_a_failure_of_a_technique_with_a_name_is_tried_again(tmp_path, monkeypatch):
    f = some_fragments()

    def refuse(*_, **__):
        raise RuntimeError("not today")

    compare(f, ["power4"], out=tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(measurement, "_timed", refuse)
        # a picture of another question is still there
        row = compare(f, ["power4"], repeat=9, out=tmp_path).rows[0]
        assert row["note"] == "RuntimeError: not today"
    assert list(tmp_path.glob("*/power4.exr"))
    row = compare(f, ["power4"], repeat=9, out=tmp_path).rows[0]
    assert row["note"] == "" and row["seconds"] > 0


def test_no_numbers_of_before_stand_beside_a_new_picture(tmp_path, monkeypatch):
    f = some_fragments()
    compare(f, ["power4"], out=tmp_path)

    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("moit.comparing.results_folder.keep", interrupt)
    with pytest.raises(KeyboardInterrupt):
        compare(f, ["power4"], repeat=9, out=tmp_path)
    assert not list(tmp_path.glob("*/*.json"))


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    def stop(done, total, label):
        if done == 3:  # the reference and two techniques
            raise KeyboardInterrupt

    f = some_fragments()
    with pytest.raises(KeyboardInterrupt):
        compare(f, out=tmp_path, progress=stop)
    kept = sorted(p.stem for p in (tmp_path / "fragments").glob("*.json"))
    assert kept == ["sorted", "unsorted"]
    seconds = json.loads((tmp_path / "fragments" / "sorted.json").read_text())["row"]["seconds"]
    report = compare(f, out=tmp_path)
    assert report.rows[0]["seconds"] == seconds
    assert unmeasured(report) == unmeasured(compare(f))


def test_names_with_odd_letters_are_kept_apart(tmp_path):
    f = some_fragments(12, 12)
    report = compare({"a/b": f, "a_b": f, "../x": f, "": f}, ["sorted"], out=tmp_path)
    assert len(list(tmp_path.glob("*/*.json"))) == 4
    assert not (tmp_path.parent / "x").exists()
    assert [row["scene"] for row in report.rows] == ["a/b", "a_b", "../x", ""]


def test_progress_is_told_to_a_callable():
    told = []
    compare(some_fragments(), progress=lambda *step: told.append(step))
    total = 1 + len(CHOSEN)
    assert [step[:2] for step in told] == [(i, total) for i in range(total + 1)]
    assert told[-1][2] == "fragments power4"


def test_progress_in_a_log_is_nothing_for_a_short_call(capfd):
    compare(some_fragments(12, 12), progress=True)
    out, err = capfd.readouterr()
    assert out == "" and err == ""


def test_scenes_are_named_by_key_file_or_number(tmp_path):
    f = some_fragments(12, 12)
    path = tmp_path / "trees.npz"
    moit.save(path, f)
    assert list(named_scenes(f)) == ["fragments"]
    assert list(named_scenes([f, f, str(path), path])) == [
        "fragments",
        "fragments (2)",
        "trees",
        "trees (2)",
    ]
    assert list(named_scenes({"b": f, "a": path})) == ["b", "a"]
    assert list(named_scenes(path)) == ["trees"]


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"f": []}, ValueError, "f: expected at least one scene"),
        ({"f": {}}, ValueError, "f: expected at least one scene"),
        ({"f": 3}, TypeError, "f: expected Fragments"),
        ({"f": [3]}, TypeError, "expected Fragments, a path"),
        ({"f": {1: "panes"}}, TypeError, "names as str"),
        ({"f": "missing.exr"}, FileNotFoundError, "missing.exr"),
        ({"techniques": []}, ValueError, "techniques: expected at least one"),
        ({"techniques": 4}, TypeError, "techniques"),
        ({"techniques": "powr4"}, ValueError, "'power4'"),
        ({"reference": "best"}, ValueError, "best"),
        ({"devices": ()}, ValueError, "devices: expected at least one"),
        ({"devices": "tpu"}, ValueError, "tpu"),
        ({"metrics": ("flop",)}, ValueError, "'flip'"),
        ({"metrics": (1,)}, TypeError, "metrics"),
        ({"repeat": 0}, ValueError, "repeat: expected at least 1"),
        ({"repeat": 2.0}, TypeError, "repeat"),
        ({"repeat": True}, TypeError, "repeat"),
        ({"progress": "yes"}, TypeError, "progress"),
    ],
)
def test_bad_arguments_are_named(options, error, words):
    with pytest.raises(error, match=words):
        compare(**{"f": some_fragments(12, 12), **options})


def test_fragments_without_colour_cannot_be_compared():
    with pytest.raises(moit.FragmentsError, match="color"):
        compare(some_fragments(color=False))


@pytest.mark.parametrize("executor", [None, "process"])
def test_an_image_behind_a_depth_range_and_no_culling_are_those_of_composite(executor, tmp_path):
    f = moit.scenes.load("panes", (32, 24))
    moit.save(tmp_path / "f.npz", f)
    behind = np.random.default_rng(1).random((24, 32, 3))
    near, far = f.depth_range
    span = (near / 2, 2 * far)
    wide = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, shape=f.shape, depth_range=span, origin=f.origin
    )
    how = {"background": behind, "threads": 1, "cull_opaque": False}
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn")) if executor else nullcontext()
    with pool as workers:
        report = moit.compare(
            tmp_path / "f.npz",
            "power4,sorted",
            depth_range=span,
            executor=workers,
            repeat=1,
            progress=False,
            **how,
        )
    image = moit.composite(wide, "power4", **how)
    np.testing.assert_array_equal(report.results[0].image, image.astype(np.float32))
    exact = moit.composite(wide, "sorted", dtype="f8", **how)
    assert report.rows[0].rmse == pytest.approx(moit.metrics.rmse(image, exact))
    off = moit.transmittance(wide, "power4", cull_opaque=False)
    off = np.abs(off - moit.transmittance(wide, "sorted", cull_opaque=False))
    assert report.rows[0].T_mae == pytest.approx(off.mean(), rel=1e-3)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"threads": 0}, ValueError, "threads"),
        ({"threads": "many"}, TypeError, "threads"),
        ({"cull_opaque": 1}, TypeError, "cull_opaque"),
        ({"depth_range": (5.0, 5.5)}, ValueError, "depth_range|depth"),
        ({"depth_range": (2.0, 1.0)}, ValueError, "depth_range"),
        ({"background": np.zeros((3, 4, 3))}, ValueError, "background"),
        ({"background": np.full((24, 32, 3), np.nan)}, ValueError, "background"),
    ],
)
def test_bad_ways_to_ask_are_named(options, error, words):
    f = moit.scenes.load("panes", (32, 24))
    with pytest.raises(error, match=words):
        moit.compare(f, ["wboit"], progress=False, **options)


def test_what_is_kept_is_taken_back_for_the_same_question_only(tmp_path):
    f = moit.scenes.load("panes", (32, 24))
    behind = np.random.default_rng(1).random((24, 32, 3))
    asked = [
        {},
        {"background": behind},
        {"background": behind + 0.1},
        {"cull_opaque": False},
        {"depth_range": (f.depth_range[0] / 2, f.depth_range[1])},
    ]
    how = {"repeat": 1, "progress": False, "metrics": "mse"}
    for options in asked:
        fresh = moit.compare(f, "power4", **how, **options).rows[0]
        for _ in range(2):
            kept = moit.compare(f, "power4", out=tmp_path, **how, **options).rows[0]
            assert kept.mse == fresh.mse and kept.T_max == fresh.T_max


def test_a_background_is_behind_every_picture():
    f = some_fragments()
    behind = (0.5, 0.25, 1.0)
    report = moit.compare(f, ["wboit"], background=behind, repeat=1, progress=False)
    expected = moit.composite(f, "wboit", background=behind)
    assert np.array_equal(report.results[0].image, expected)
    exact = moit.composite(f, "sorted", background=behind, dtype="f8")
    assert report.rows[0].rmse == pytest.approx(moit.metrics.rmse(expected, exact))
    with pytest.raises(ValueError, match=r"background: expected \(3,\) or .*, got \(2,\)"):
        moit.compare(f, ["wboit"], background=(0, 1), progress=False)
