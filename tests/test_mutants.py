"""The list of small faults: each can still be made, and asks tests that there are."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import mutants

ROOT = Path(__file__).parents[1]


def test_each_fault_changes_its_file():
    faults = mutants.listed()
    assert len(faults) > 50 and len({fault.key for fault in faults}) == len(faults)
    for fault in faults:
        text = (ROOT / fault.file).read_text(encoding="utf-8")
        assert fault.made_in(text) != text
        assert all((ROOT / name.partition("::")[0]).exists() for name in fault.tests), fault
    with pytest.raises(ValueError, match="expected once, found 2 times: 'a'"):
        mutants.Fault("x.py", "a", "b", ()).made_in("a a")


def test_faults_are_found_or_survive_and_files_are_put_back(tmp_path):
    (tmp_path / "moit").mkdir()
    (tmp_path / "moit" / "twice.py").write_text("def twice(x):\n    return x + x  # sum\n")
    test = "from moit.twice import twice\ndef test_it():\n    assert twice(2) == 4\n"
    (tmp_path / "test_twice.py").write_text(test)
    ask = ("test_twice.py",)
    faults = [
        mutants.Fault("moit/twice.py", "x + x", "x - x", ask),
        mutants.Fault("moit/twice.py", "x + x", "x * x", ask),
        mutants.Fault("moit/twice.py", "x + x", "2 * x", ask, "the same number"),
    ]
    told = [mutants.asked(fault, tmp_path) for fault in faults[:2]]
    assert told == [(mutants.FOUND, "test_twice.py::test_it"), (mutants.SURVIVED, "")]
    assert mutants.asked(faults[0], tmp_path, "test_twice.py::test_it") == told[0]
    assert mutants.failing(ask, tmp_path) is None
    assert "x + x" in (tmp_path / "moit" / "twice.py").read_text()
    results = zip(faults, [what for what, _ in told] + [""], strict=True)
    said = mutants.scores({fault.key: (fault, what) for fault, what in results}).splitlines()
    assert said[0].split() == ["moit", "1", "of", "2"] and said[1].split() == "all 1 of 2".split()
    assert said[2].startswith("survived: ") and said[2].endswith("'x * x'")
    assert said[3:] == ["not counted: moit/twice.py: '2 * x': the same number"]


def test_the_program_can_be_asked_as_a_module():
    command = [sys.executable, "-m", "tests.mutants", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0 and "--changed" in done.stdout
