"""The long search for faults: what is broken is told; a few cases of each target break nothing."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import fuzz
import hostile_scenes
from readings.compilers import tool

import moit


def test_the_corpus_has_cases_of_every_target():
    corpus = json.loads(fuzz.CORPUS.read_text(encoding="utf-8"))
    assert set(corpus) == set(fuzz.TARGETS)
    assert all(first >= 0 and count > 0 for ranges in corpus.values() for first, count in ranges)


def test_cases_that_once_broke_something_break_nothing():
    corpus = json.loads(fuzz.CORPUS.read_text(encoding="utf-8"))
    single = {target: [n for n, count in ranges if count == 1] for target, ranges in corpus.items()}
    assert single["fragments"] and single["files"]
    found = [
        (target, number, what)
        for target, numbers in single.items()
        for number in numbers
        for what in fuzz.TARGETS[target]()(number)
    ]
    assert found == []


FEW = {"scenes": 60, "words": 20, "kits": 8, "deep": 8, "gradients": 8, "doors": 8, "trainings": 2}


@pytest.mark.parametrize(("target", "count"), FEW.items())
def test_a_few_cases_break_nothing(target, count):
    if target == "kits":
        tool("glslangValidator", "glslang-tools")
    tried = fuzz.TARGETS[target]()
    assert [what for number in range(count) for what in tried(number)] == []


def test_what_is_broken_is_told_by_number(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(fuzz.TARGETS, "words", lambda: lambda n: ["odd"] if n % 2 else [])
    progress = tmp_path / "case"
    progress.write_text("0" * 20)
    fuzz.work("words", range(4, 8), 60.0, progress)
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["case"] for one in told] == [5, 7] and int(progress.read_text()) == 7


def test_a_process_that_dies_costs_one_case(monkeypatch):
    def dies_at_2(command, **_):
        first, count = (int(command[command.index(word) + 1]) for word in ("--first", "--count"))
        reached = min(max(first, 2), first + count - 1)
        Path(command[command.index("--progress") + 1]).write_text(f"{reached:020d}")
        return subprocess.CompletedProcess(command, -11 if reached == 2 else 0, "")

    monkeypatch.setattr(fuzz.subprocess, "run", dies_at_2)
    reached, broken = fuzz.turn("scenes", 0, 5, 60.0)
    assert reached == 5
    assert [(one["case"], one["what"]) for one in broken] == [(2, "the process ended with -11")]


def test_promises_that_are_broken_are_seen(monkeypatch):
    whole = [n for n in range(40) if _composes(n, monkeypatch)]
    assert len(whole) > 5
    for wrong, said in ((np.nan, "not finite"), (1.5, "covers")):
        monkeypatch.setattr(moit, "composite", lambda *_, wrong=wrong: np.full((2, 2, 4), wrong))
        assert said in hostile_scenes.tried_scene(whole[0])[0]
    monkeypatch.setattr(hostile_scenes, "main", lambda words: 1)
    assert "failed, and said ''" in hostile_scenes.tried_words(0)[0]


def _composes(number, monkeypatch):
    seen = []
    with monkeypatch.context() as patched:
        blank = np.zeros((2, 2, 4))
        patched.setattr(moit, "composite", lambda *_: seen.append(1) or blank)
        assert hostile_scenes.tried_scene(number) == []
    return bool(seen)
