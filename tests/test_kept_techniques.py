"""Techniques of one's own in other processes and in kept results: what changes them is seen."""

import functools
import importlib.util
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from own_techniques import EXACT, Fog, PythonTechnique, exact, halves, twice_exact
from small import some_fragments

import moit
from moit.catalog.source_digest import source_digest


def test_it_is_measured_in_other_processes(tmp_path):
    f = some_fragments()
    options = {"metrics": ["mse"], "repeat": 1, "progress": False}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        report = moit.compare(f, [EXACT, Fog(2.0)], executor=executor, out=tmp_path, **options)
        local = PythonTechnique("local", lambda f: halves(f))
        (failed,) = moit.compare(f, [local], executor=executor, **options).rows
    here = moit.compare(f, [EXACT, Fog(2.0)], **options)
    assert [row.mse for row in report.rows] == [row.mse for row in here.rows]
    assert "ickl" in failed.note
    # and taken back by the process that has sent it
    again = moit.compare(f, [EXACT, Fog(2.0)], out=tmp_path, **options)
    assert [row.seconds for row in again.rows] == [row.seconds for row in report.rows]


def seconds(techniques, folder, **options):
    report = moit.compare(
        some_fragments(), techniques, metrics="mse", repeat=1, progress=False, out=folder, **options
    )
    return [row.seconds for row in report.rows]


@pytest.mark.usefixtures("no_two_seconds_alike")
def test_what_is_kept_is_measured_again_where_the_source_has_changed(tmp_path):
    before = seconds([PythonTechnique("mine", exact), Fog()], tmp_path)
    assert seconds([PythonTechnique("mine", exact), Fog()], tmp_path) == before
    changed = seconds([PythonTechnique("mine", twice_exact), Fog(steps=3)], tmp_path)
    assert not set(changed) & set(before)
    normalized = PythonTechnique("mine", twice_exact, normalize=False)
    assert seconds([normalized], tmp_path) != changed[:1]
    path = tmp_path / "stability"
    options = {"families": "order", "rays": 2, "progress": False, "out": path}
    for one in (exact, exact, halves):
        rows = moit.stability(PythonTechnique("mine", one), **options).rows
        assert (max(row.T_max for row in rows) < 1e-5) == (one is exact)


def test_a_reference_of_ones_own_is_part_of_the_question(tmp_path):
    def error(reference):
        report = moit.compare(
            some_fragments(),
            ["power4"],
            reference=reference,
            metrics="mse",
            repeat=1,
            progress=False,
            out=tmp_path,
        )
        return report.rows[0].mse

    first = error(PythonTechnique("mine", exact))
    assert error(PythonTechnique("mine", halves)) != first
    assert error(PythonTechnique("mine", exact)) == first


def compiled(text, **names):
    """A function `mine` without a source."""
    space = {"np": np, "__name__": __name__, **names}
    exec(text, space)
    return space["mine"]


def captured(value):
    return lambda f: value


def with_default(value):
    def mine(f, scale=value):
        return scale

    return mine


class Called:
    def __init__(self, value):
        self.value = value

    def __call__(self, f):
        return self.value

    def method(self, f):
        return self.value


TEXT = "def mine(f):\n    return SCALE * len(f)"
HELPED = "def helper(x): return {} * x\ndef mine(f): return [helper(x) for x in f]"
CHANGES = {
    "code": (compiled("def mine(f): return 1"), compiled("def mine(f): return 2")),
    "a global": (compiled(TEXT, SCALE=1.0), compiled(TEXT, SCALE=2.0)),
    "a global array": (
        compiled(TEXT, SCALE=np.arange(3)),
        compiled(TEXT, SCALE=np.arange(3) + 1),
    ),
    "a global of another type": (compiled(TEXT, SCALE=1.0), compiled(TEXT, SCALE=1)),
    "a function that it calls": (compiled(HELPED.format(1)), compiled(HELPED.format(2))),
    "what is captured": (captured(1), captured(2)),
    "a dict that is captured": (captured({"a": [1, 2]}), captured({"a": [1, 3]})),
    "a set that is captured": (captured({1, 2}), captured({1, 3})),
    "a default": (with_default(1), with_default(2)),
    "an object": (Called(1), Called(2)),
    "a method": (Called(1).method, Called(2).method),
    "a partial": tuple(functools.partial(with_default(0), scale=scale) for scale in (1, 2)),
    "two of one line": ((lambda f: 1 * f), (lambda f: 2 * f)),
    "what is cached": (functools.cache(captured(1)), functools.cache(captured(2))),
    "a function": (exact, halves),
    "an installed function": (np.sort, np.argsort),
    "an option": (Fog(1.0).read, Fog(2.0).read),
}  # fmt: skip


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_changes_the_digest(what):
    one, other = CHANGES[what]
    assert source_digest(one) is not None
    assert source_digest(one) == source_digest(one)
    assert source_digest(one) != source_digest(other)
    mine = PythonTechnique("mine", one)
    assert (
        mine.identity
        == PythonTechnique("mine", one).identity
        != PythonTechnique("mine", other).identity
    )


def test_modules_beside_ones_own_are_read_too(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "kit").mkdir()
    (tmp_path / "mine_too.py").write_text(
        "import kit, kit.sub, helping\nfrom helping import other\n"
        "def by_module(f): return helping.scaled(f)\n"
        "def by_name(f): return other(f)\n"
        "def by_package(f): return kit.sub.half(f)\n"
        "def by_nothing(f): return f\n"
    )
    names = ("by_module", "by_name", "by_package", "by_nothing")
    found = []
    for factor in (2, 3):
        (tmp_path / "helping.py").write_text(
            f"FACTOR = {factor}\ndef other(f): return FACTOR * f\ndef scaled(f): return other(f)\n"
        )
        (tmp_path / "kit" / "__init__.py").write_text("")
        (tmp_path / "kit" / "sub.py").write_text(f"def half(f): return f / {factor}\n")
        importlib.invalidate_caches()
        for name in ("mine_too", "helping", "kit", "kit.sub"):
            monkeypatch.delitem(sys.modules, name, raising=False)
        sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
        module = importlib.import_module("mine_too")
        sys.dont_write_bytecode = before
        found.append([source_digest(getattr(module, name)) for name in names])
    assert None not in found[0]
    assert [one == other for one, other in zip(*found, strict=True)] == [False, False, False, True]


@pytest.mark.usefixtures("no_two_seconds_alike")
def test_what_cannot_be_told_is_never_taken_back(tmp_path):
    unknown = captured(np.random.default_rng(0))
    assert source_digest(unknown) is None
    held = np.random.default_rng(0)

    def random(f):
        return np.clip(halves(f) + 0.01 * held.random(), 0, 1)

    mine = PythonTechnique("mine", random)
    assert mine.identity is None
    assert seconds([mine], tmp_path) != seconds([mine], tmp_path)


def test_the_digest_is_the_same_in_other_processes():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        for one in (exact, Fog, Called(1), Called({"b", "a"})):
            assert executor.submit(source_digest, one).result() == source_digest(one)
