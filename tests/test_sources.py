"""Sources read side by side on one screen: no line of C, and no comment of GLSL, is longer than 100
columns. Every file of tests has quick ones, and what tests read comes with them."""

import re
from pathlib import Path

import pytest
from conftest import FIRST, LONG

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "tests"
TESTS = sorted(FOLDER.glob("test_*.py"))
C = sorted(path for path in (ROOT / "csrc").rglob("*") if path.suffix in (".c", ".h"))
GLSL = sorted((ROOT / "shaders").rglob("*.glsl"))


def test_lines_end_at_column_100():
    assert C
    assert GLSL
    assert not [
        f"{path.relative_to(ROOT)}:{number}"
        for path in [*C, *GLSL]
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > 100 and (path.suffix != ".glsl" or "//" in line)
    ]


def test_what_is_said_to_take_long_is_there():
    for name, functions in LONG.items():
        source = (Path(__file__).parent / name).read_text()
        assert not [function for function in functions if f"def {function}(" not in source], name
    assert [name for name in FIRST if not (FOLDER / name).exists()] == []


def test_every_file_of_tests_has_a_quick_one(request):
    quick = {item.path for item in request.session.items if item.get_closest_marker("quick")}
    collected = {item.path for item in request.session.items}
    if not collected >= set(TESTS):
        pytest.skip("needs all tests to be collected")
    assert not [path.name for path in TESTS if path not in quick]


def test_tests_read_nothing_outside_the_repository():
    outside = []
    for path in sorted(FOLDER.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        above = [int(number) + 1 for number in re.findall(r"parents\[(\d+)\]", text)]
        above += [chain.count(".parent") for chain in re.findall(r"(?:\.parent\b)+", text)]
        root = len(path.relative_to(FOLDER).parts) + 1
        if max(above, default=0) > root or re.search(r"[\"'/]shared[\"'/]", text):
            outside.append(str(path.relative_to(FOLDER)))
    assert not outside
