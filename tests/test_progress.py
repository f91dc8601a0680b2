"""Who waits at a terminal sees within two seconds what is done; by a clock that tests move."""

import io
import logging
import os
import sys
import threading

import numpy as np
import pytest
from small import some_fragments

import moit
from moit.system import progress
from moit.system.progress import preparing, steps


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Clock:
    """What is to be called after so many seconds is called when they pass."""

    def __init__(self):
        self.waiting = []

    def later(self, seconds, function):
        entry = (seconds, function)
        self.waiting.append(entry)
        return lambda: self.waiting.remove(entry) if entry in self.waiting else None

    def two_seconds_pass(self):
        due = [entry for entry in self.waiting if entry[0] <= 2]
        self.waiting = [entry for entry in self.waiting if entry not in due]
        for _, function in due:
            function()


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(progress, "later", made.later)
    return made


@pytest.fixture(params=[False, True], ids=["without tqdm", "with tqdm"])
def at_a_terminal(request, monkeypatch):
    """Called in a test, for between fixtures and tests pytest has a stderr of its own."""
    if request.param:
        pytest.importorskip("tqdm")
    else:
        monkeypatch.setitem(sys.modules, "tqdm", None)

    def begins():
        made = Terminal()
        monkeypatch.setattr(sys, "stderr", made)
        return made

    return begins


def lines(terminal):
    """What a terminal has shown: each text that stood in its line."""
    return [
        one.strip() for one in terminal.getvalue().replace("\n", "\r").split("\r") if one.strip()
    ]


GLASS = moit.Mesh([[-1, 0, -1], [1, 0, -1], [0, 0, 1]], [[0, 1, 2]], alpha=0.5)
SUN = moit.Light((0, -1, 0), shadows="power4")
CAMERA = moit.Camera(eye=(0, 2, 3)).fit(GLASS)


def f():
    return some_fragments(12, 16)


# A call, what of it lasts when two seconds pass, and what is seen then.
CALLS = {
    "render": (
        lambda **how: moit.render(GLASS, "power4", (8, 6), lights=[SUN], **how),
        "moit.shadows.reaching.ShadowMap",
        "render: 0/2  the shadow map of light 1",
    ),
    "render's picture": (
        lambda **how: moit.render(GLASS, "power4", (8, 6), lights=[SUN], **how),
        "moit.rendering.rasterizing.Picture",
        "render: 1/2  power4",
    ),
    "rasterize": (
        lambda **how: moit.rasterize(GLASS, CAMERA, (8, 6), lights=[SUN], **how),
        "moit.shadows.reaching.ShadowMap",
        "rasterize: 0/2  the shadow map of light 1",
    ),
    "ShadowMap": (
        lambda **how: moit.ShadowMap(GLASS, "power4", light=(0, -1, 0), resolution=8, **how),
        "moit.shadows.shadow_map.ShadowMap._seen",
        "ShadowMap: 0/2  casters",
    ),
    "compare reads": (
        lambda **how: moit.compare("panes", "wboit", metrics="mse", repeat=1, **how),
        "moit.comparing.comparison.as_fragments",
        "compare:  reads panes",
    ),
    "compare's reference": (
        lambda **how: moit.compare({"one": f()}, "wboit", metrics="mse", repeat=1, **how),
        "moit.comparing.measurement.composite",
        "one reference",
    ),
    "compare's first technique": (
        lambda **how: moit.compare({"one": f()}, "wboit", metrics="mse", repeat=1, **how),
        "moit.comparing.measurement._timed",
        "one wboit",
    ),
    "recommend reads": (
        lambda **how: moit.recommend(f(), max_error=1, techniques="wboit", **how),
        "moit.comparing.recommendation.as_fragments",
        "recommend:  reads f",
    ),
    "recommend's exact picture": (
        lambda **how: moit.recommend(f(), max_error=1, techniques="wboit", **how),
        "moit.comparing.recommendation.Trials",
        "recommend:  the exact picture",
    ),
    "choose": (
        lambda **how: moit.choose(f(), **how),
        "moit.comparing.choice.plan_of",
        "choose: 0/3  tries techniques on a sample",
    ),
    "train": (
        lambda **how: moit.train(
            "neural-bounded", "surfaces", fragments=200, epochs=1, batch=100, **how
        ),
        "moit.neural.training.examples_of",
        "training:  what is learnt from",
    ),
    "train's first weights": (
        lambda **how: moit.train(
            "neural-bounded", "surfaces", fragments=200, epochs=1, batch=100, **how
        ),
        "moit.neural.training.State.start",
        "training:  the first weights",
    ),
    "stability": (
        lambda **how: moit.stability("power4", families="distance", rays=2, **how),
        "moit.numerics.stability._kept_or_measured",
        "stability",
    ),
    "experiment": (
        lambda **how: moit.experiment("mt-fig2", "tiny", **how),
        "moit.experiments.running.Setting",
        "mt-fig2",
    ),
}


class Passed(BaseException):
    """Two seconds have passed, and what is to be seen was seen or not: the rest need not run."""


def stopped_within(monkeypatch, name, before):
    """The thing of that name does `before` and stops, when first called."""

    def stops(*_, **__):
        before()
        raise Passed

    monkeypatch.setattr(name, stops)


@pytest.mark.parametrize("name", CALLS)
def test_within_two_seconds_a_terminal_shows_what_is_done(name, clock, at_a_terminal, monkeypatch):
    terminal = at_a_terminal()
    call, slow, seen = CALLS[name]
    shown = []

    def before():
        clock.two_seconds_pass()
        shown.extend(lines(terminal))

    stopped_within(monkeypatch, slow, before)
    with pytest.raises(Passed):
        call()
    assert shown and seen in shown[-1]
    assert not clock.waiting  # no thread is left


@pytest.mark.parametrize("name", CALLS)
def test_a_log_and_a_call_without_progress_show_nothing(name, clock, monkeypatch):
    call, slow, _ = CALLS[name]
    for stream, how in ((io.StringIO(), {}), (Terminal(), {"progress": False})):
        monkeypatch.setattr(sys, "stderr", stream)
        with monkeypatch.context() as patched:
            stopped_within(patched, slow, clock.two_seconds_pass)
            with pytest.raises(Passed):
                call(**how)
        assert stream.getvalue() == ""


def test_a_short_call_leaves_nothing_on_a_terminal(clock, at_a_terminal):
    terminal = at_a_terminal()
    moit.render(GLASS, "power4", (8, 6), lights=[SUN])
    moit.choose(f())
    moit.rasterize(GLASS, CAMERA, (8, 6))
    assert terminal.getvalue() == "" and not clock.waiting


def test_a_patient_line_goes_when_the_call_ends(clock, at_a_terminal):
    terminal = at_a_terminal()
    with steps(True, 2, "work", patient=True) as done:
        done.now("one")
        clock.two_seconds_pass()
        done("one")
        done.now("two")
    assert lines(terminal) == ["work: 0/2  one", "work: 1/2  one", "work: 1/2  two"]
    assert terminal.getvalue().endswith("\r" + " " * 79 + "\r")


def test_without_tqdm_a_line_comes_before_the_first_step(clock, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with steps(True, 2, "work") as done:
        done.now("one")
        assert terminal.getvalue() == ""
        clock.two_seconds_pass()
        assert lines(terminal) == ["work: 0/2  one"]


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no terminals of one's own here")
def test_a_terminal_without_a_width_shows_something(monkeypatch):
    pytest.importorskip("tqdm")
    ours, its = os.openpty()  # which is 0 columns wide until somebody says otherwise
    with open(its, "w") as stream, monkeypatch.context() as patched:
        patched.setattr(sys, "stderr", stream)
        with steps(True, 2, "work") as done:
            done("one")
        shown = os.read(ours, 4096).decode()
    os.close(ours)
    assert "work" in shown


def test_calls_within_a_call_that_shows_progress_are_silent(clock, at_a_terminal):
    terminal = at_a_terminal()
    with steps(True, 1, "outer") as done:
        moit.choose(f())
        with preparing(True, "inner") as inner:
            inner.now("something")
            clock.two_seconds_pass()
        done("x")
    assert "outer" in terminal.getvalue()
    assert "inner" not in terminal.getvalue() and "choose" not in terminal.getvalue()
    with preparing(True, "next"):
        clock.two_seconds_pass()
    assert "next:" in terminal.getvalue()


def test_what_comes_after_an_error_shows_progress_again(clock, at_a_terminal):
    terminal = at_a_terminal()
    with pytest.raises(KeyError), steps(True, 1, "first"):
        raise KeyError
    with preparing(True, "next"):
        clock.two_seconds_pass()
    assert "next:" in terminal.getvalue()


@pytest.mark.parametrize("name", ["render", "rasterize", "ShadowMap", "choose"])
def test_a_callable_is_told_each_step(name):
    told = []
    CALLS[name][0](progress=lambda *step: told.append(step))
    total = told[0][1]
    assert told[0] == (0, total, "")
    assert [done for done, _, _ in told] == list(range(total + 1))
    assert all(label for _, _, label in told[1:])


@pytest.mark.parametrize("name", CALLS)
def test_progress_is_a_truth_value_or_a_callable(name):
    with pytest.raises(TypeError, match="progress: expected True, False or a callable"):
        CALLS[name][0](progress="yes")


def test_the_clock_is_a_thread_that_ends():
    called = threading.Event()
    end = progress.later(0.0, called.set)
    assert called.wait(60)
    end()
    never = []
    progress.later(3600.0, lambda: never.append(1))()
    assert not never
    assert not [one for one in threading.enumerate() if isinstance(one, threading.Timer)]


def test_progress_changes_no_answer(monkeypatch):
    with_line = moit.render(GLASS, "power4", (8, 6), lights=[SUN])
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert np.array_equal(with_line, moit.render(GLASS, "power4", (8, 6), lights=[SUN]))


def test_lines_of_a_log_go_to_the_programs_logging_where_it_has_one(monkeypatch, caplog):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "SECONDS_BETWEEN_LINES", 0.0)
    for level, told in ((logging.INFO, 1), (logging.WARNING, 0)):
        caplog.clear()
        stream.seek(0)
        stream.truncate()
        with caplog.at_level(level, logger="moit"), steps(True, 2, "work") as done:
            done("100 % of one")
        assert len(caplog.records) == told
        assert all(record.name == "moit" for record in caplog.records)
        line = caplog.records[0].getMessage() if told else stream.getvalue()
        assert line.startswith("work: 1/2") and line.rstrip().endswith("100 % of one")
        assert bool(stream.getvalue()) != bool(told)  # once, not twice
