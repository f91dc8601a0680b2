"""The stability lab's families of hard rays, and that a run goes on where it ended."""

import dataclasses
import json

import numpy as np
import pytest
from test_stability import stability

import moit
from moit.numerics import stability as stability_lab
from moit.numerics.hard_cases import FAMILIES
from moit.numerics.unlimited import stored_as


def test_families_are_what_they_are_said_to_be():
    def case(name, value, rays=64):
        f = FAMILIES[name].case(value, rays, seed=4).f
        n = int(f.counts[0])
        assert (f.counts == n).all()
        return f, f.depth.reshape(-1, n), f.alpha.reshape(-1, n)

    def absorbed(alpha):
        return -np.log1p(-alpha).sum(axis=1)

    f, depth, alpha = case("distance", 0.01)
    assert f.depth_range == (1, 2) and depth.shape == (64, 2)
    np.testing.assert_allclose(depth[:, 1] - depth[:, 0], 0.01, rtol=1e-4)
    f, depth, alpha = case("opaque", 1e-3)
    assert depth.shape == (64, 4) and alpha.ravel() == pytest.approx(1 - 1e-3)
    assert (case("opaque", 0)[2] == 1).all()
    f, depth, alpha = case("clear", 0.01)
    assert depth.shape == (64, 8) and 0.005 <= alpha.min() < alpha.max() <= 0.01
    for n, count in ((1, 64), (5, 64), (1000, 64), (10_000, 6)):
        f, depth, alpha = case("layers", n)
        assert depth.shape == (count, n)  # 65,536 fragments at most
        np.testing.assert_allclose(absorbed(alpha), 3, rtol=1e-4)
    f, depth, alpha = case("range", 1e4)
    assert f.depth_range == (1, 1e4) and depth.shape == (64, 6)
    logs = np.log(depth) / np.log(1e4)
    assert logs.mean() == pytest.approx(0.5, abs=0.05) and (logs < 0.25).mean() > 0.15
    f, depth, alpha = case("one-depth", 16)
    assert (depth[:, :16] == depth[:, :1]).all() and depth.shape == (64, 17)
    np.testing.assert_allclose(depth[:, 16] - depth[:, 0], 0.25, rtol=1e-6)
    np.testing.assert_allclose(absorbed(alpha[:, :16]), 2, rtol=1e-4)
    assert (alpha[:, 16] == 0.5).all()
    f, depth, alpha = case("symmetric", 0.1)
    assert f.depth_range == (0.5, 2)
    logs = np.log2(depth)
    np.testing.assert_allclose(logs[:, :2], -logs[:, 2:4], atol=1e-6)
    np.testing.assert_allclose(logs[:, 0], 0.1, atol=1e-6)
    assert (logs[:, 4] == 0).all() and (alpha[:, :2] == alpha[:, 2:4]).all()
    assert np.allclose(alpha[::2, 4], 0) and np.allclose(alpha[1::2, 4], 0.3)
    f, depth, alpha = case("ends", 0.1)
    near, far = depth[:, 0] - 1, 2 - depth[:, 2]
    for away in (near, far):
        assert 0.05 <= away.min() + 1e-6 and away.max() <= 0.1 + 1e-6
    assert ((depth[:, [1, 3]] > 1.19) & (depth[:, [1, 3]] < 1.81)).all()
    f, depth, alpha = case("order", 8)
    assert depth.shape == (64, 8)
    np.testing.assert_allclose(absorbed(alpha), 3, rtol=1e-4)
    assert np.diff(np.sort(depth, axis=1), axis=1).min() > 0
    f, depth, alpha = case("moving", 0.03)
    assert f.depth_range == (0.1, 3) and depth.shape == (64, 5)
    run = depth[:16]
    np.testing.assert_allclose(np.diff(run[:, 0]), 0.03, rtol=1e-4)
    assert (run[:, 1:] == run[0, 1:]).all()
    # half way through it passes the first of the others
    np.testing.assert_allclose(run[7:9, 0].mean(), run[0, 1], rtol=1e-6)


def test_families_of_slices_are_what_they_are_said_to_be():
    def case(name, value):
        f = FAMILIES[name].case(value, 300, seed=4).f
        rays = (len(f.counts), -1)
        return f, f.depth.reshape(rays), -np.log1p(-f.alpha.reshape(rays))

    _, depth, absorbed = case("thin", 0.01)
    assert depth.shape == (300, 200) and 0.003 < absorbed.min() < absorbed.max() < 0.02
    np.testing.assert_allclose(absorbed.sum(axis=1), 2, rtol=1e-4)
    _, depth, absorbed = case("adjacent", 1e-3)
    assert (depth == depth[0]).all() and depth[0, 1] - depth[0, 0] == pytest.approx(1e-3, rel=1e-3)
    _, depth, absorbed = case("overflow", 8)
    assert (depth[:, :4] == depth[:, :1]).all() and (depth[:, 4] > depth[:, 0]).all()
    np.testing.assert_allclose(absorbed[:, :4].sum(axis=1), 8, rtol=1e-3)
    f, depth, absorbed = case("screen", 0.9)
    alpha = -np.expm1(-absorbed)
    assert f.shape == (16, 16) and (depth == depth[0]).all()
    assert 0.05 <= alpha[:, 0].min() < 0.1 and 0.9 < alpha[:, 0].max() <= 0.95
    assert (case("screen", 0)[2][:, 0] == absorbed[0, 1]).all()
    f, depth, absorbed = case("tilted", 0.01)
    assert (absorbed == absorbed[0]).all() and depth.shape == (256, 1)
    picture = depth.reshape(f.shape)
    assert (picture == picture[0]).all()
    np.testing.assert_allclose(picture[0, 8:] - picture[0, :-8], 0.01, rtol=1e-4)


def test_families_have_numbers_of_their_own():
    first = FAMILIES["range"].case(10, 4, seed=0).f.depth[0]
    assert first != pytest.approx(10 ** np.random.default_rng(0).random())  # that of its seed alone


def test_cases_are_the_same_numbers_in_both_precisions():
    for family in FAMILIES.values():
        case = family.case(family.values[-1], 8, seed=0)
        for array in (case.f.depth, case.f.alpha):
            assert array.dtype == np.float64
            assert np.array_equal(array, array.astype(np.float32))
        assert (case.f.alpha == 1).all() == (family.name == "opaque")
        again = family.case(family.values[-1], 8, seed=0)
        assert np.array_equal(case.f.depth, again.f.depth)
        other = family.case(family.values[-1], 8, seed=1)
        assert not np.array_equal(case.f.alpha, other.f.alpha) or family.name == "opaque"


def test_runs_show_the_same_fragments():
    for name in ("order", "moving"):
        family = FAMILIES[name]
        case = family.case(family.values[1], 32, seed=0)
        at = np.argsort(case.runs(case.place), axis=2)
        alpha = np.take_along_axis(case.runs(case.f.alpha), at, axis=2)
        assert np.array_equal(alpha, np.broadcast_to(alpha[:, :1], alpha.shape))
        moved = np.diff(np.take_along_axis(case.runs(case.f.depth), at, axis=2), axis=1) != 0
        assert moved.any(axis=(0, 1)).sum() == (1 if name == "moving" else 0)


def test_techniques_are_measured_in_the_forms_that_they_have():
    def form(name, precision):
        return str(stored_as(moit.technique(name), precision))

    assert form("power4", "16 bit") == "power4-16" and form("power4-16", "float64") == "power4"
    assert form("adaptive4", "float32") == "adaptive4(quantized=False)"
    assert form("sorted", "16 bit") == "None" and form("sorted", "float64") == "sorted"
    assert form("moment-transparency-nlqm", "float32") == "moment-transparency"
    assert form("power4(bias=1e-06)", "16 bit") == "None"
    assert form("dfa", "16 bit") == "dfa" and form("dfa", "float32") == "None"  # half floats only
    for t in moit.techniques():
        assert any(stored_as(t, precision) for precision in ("16 bit", "float32")), t


def test_an_interrupted_run_leaves_rows_that_are_not_measured_again(tmp_path, monkeypatch):
    def stop(done, total, label):
        if done == 2:
            raise KeyboardInterrupt

    options = {"families": ["distance", "clear"], "rays": 4, "out": tmp_path / "rows"}
    with pytest.raises(KeyboardInterrupt):
        moit.stability(["power4", "wboit"], progress=stop, **options)
    kept = list((tmp_path / "rows").rglob("*.json"))
    assert len(kept) == 2
    assert all(len(json.loads(path.read_text())["rows"]) == 7 for path in kept)

    asked = []
    real = stability_lab._row
    monkeypatch.setattr(stability_lab, "_row", lambda *a: asked.append(a) or real(*a))
    resumed = moit.stability(["power4", "wboit"], progress=False, **options)
    assert len(asked) == 7 * (2 * 6 - 2)
    fresh = stability(["power4", "wboit"], families=["distance", "clear"], rays=4)
    assert resumed.rows == fresh.rows
    asked.clear()
    moit.stability(["power4", "wboit"], progress=False, **{**options, "rays": 5})
    assert len(asked) == 7 * 2 * 6
    kept[0].write_text("[]")
    asked.clear()
    moit.stability(["power4", "wboit"], progress=False, **{**options, "rays": 5})
    assert len(asked) == 7
    (tmp_path / "rows/distance/mine.json").write_text("{}")
    stability_lab.clear(tmp_path / "rows")
    assert [path.name for path in (tmp_path / "rows").rglob("*.json")] == ["mine.json"]


def test_another_question_is_measured_anew(tmp_path, monkeypatch):
    asked = []
    real = stability_lab._row
    monkeypatch.setattr(stability_lab, "_row", lambda *a: asked.append(a) or real(*a))
    usual = {"families": "ends", "precisions": "float32", "rays": 2, "out": tmp_path}
    for changes in ({}, {"rays": 3}, {"seed": 1}, {"seed": 0}):
        asked.clear()
        found = stability("power4", **usual | changes)
        assert len(asked) == 8, changes
        assert [row["T_max"] for row in found.rows] == [
            row["T_max"] for row in stability("power4", **usual | changes | {"out": None}).rows
        ]
    asked.clear()
    stability("power4", **usual)
    assert not asked
    fewer = dataclasses.replace(FAMILIES["ends"], values=FAMILIES["ends"].values[:-1])
    with monkeypatch.context() as patch:
        patch.setitem(FAMILIES, "ends", fewer)
        stability("power4", **usual)
        assert len(asked) == 7
        asked.clear()
    stability("power4", **usual)
    assert len(asked) == 8
    asked.clear()
    monkeypatch.setattr("moit.system.version.VERSION", "another")
    stability("power4", **usual)
    assert len(asked) == 8
