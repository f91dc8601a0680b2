"""Rooms in C: what each file includes and calls, which no circle may close."""

import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from moit.catalog.technique import FACTS

ROOT = Path(__file__).parent.parent / "csrc"
CORE = sorted((ROOT / "core").rglob("*.c"))
SOURCES = sorted(path for path in ROOT.rglob("*") if path.suffix in (".c", ".h"))
WORD = r"[A-Za-z_]\w*"


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def code(path: Path) -> str:
    """The text without comments and literals."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", path.read_text(), flags=re.DOTALL)
    return re.sub(r'"(\\.|[^"\\])*"', '""', text)


def includes(path: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s+[<"]([^">]+)[">]', path.read_text(), re.MULTILINE)


def outside_of_bodies(text: str) -> str:
    found, depth = [], 0
    for part in re.split(r"([{}])", re.sub(r"^\s*#(\\\n|[^\n])*", "", text, flags=re.MULTILINE)):
        depth += (part == "{") - (part == "}")
        if part == "{" and depth == 1:
            found.append("{")
        elif depth == 0 and part != "}":
            found.append(part)
    return "".join(found)


def functions(path: Path) -> set[str]:
    """What it defines with external linkage."""
    heads = re.findall(
        rf"([^;{{}}]*?)\b({WORD})\s*\([^;{{}}]*\)\s*{{", outside_of_bodies(code(path))
    )
    return {name for before, name in heads if not re.search(r"\b(static|enum|typedef)\b", before)}


@cache
def definitions() -> dict[str, Path]:
    return {name: path for path in CORE for name in functions(path)}


def calls(path: Path) -> set[Path]:
    """The files whose functions it calls; a table that names functions calls none of them."""
    found = {definitions().get(name) for name in re.findall(rf"\b({WORD})\s*\(", code(path))}
    return {other for other in found if other not in (None, path)}


def circle_of(graph: dict[Path, set[Path]]) -> list[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [name_of(path) for path in error.args[1]]
    return []


def test_definitions_are_found():
    found = definitions()
    assert name_of(found["moit_composite"]) == "core/questions.c"
    assert name_of(found["moit_for_tiles"]) == "core/tile.c"
    assert name_of(found["moit_parallel_for"]) == "core/threads.c"
    assert {name_of(path) for path in calls(found["moit_composite"])} >= {
        "core/tile.c",
        "core/totals.c",
        "core/techniques/table.c",
    }


def test_no_files_of_the_core_call_each_other_in_a_circle():
    assert circle_of({path: calls(path) for path in CORE}) == []


def test_no_headers_include_each_other_in_a_circle():
    by_name = {name_of(path): path for path in SOURCES}
    graph = {
        path: {by_name[name] for name in includes(path) if name in by_name} - {path}
        for path in SOURCES
    }
    assert circle_of(graph) == []


OF_CORE = {
    f"moit{part}.h" for part in ("", "_technique", "_deep", "_errors", "_geometry", "_gradients")
}
ALLOWED = {
    "kernels": {"kernels"},
    "core": {"kernels", "core", *OF_CORE},
    "gl": {"gl", "moit_gl.h"},
    "python": {"python", "moit_gl.h", *OF_CORE},
}


@pytest.mark.parametrize("room", ALLOWED)
def test_a_room_includes_only_what_is_below_it(room):
    ours = {name_of(path) for path in SOURCES}
    for path in SOURCES:
        if name_of(path).split("/")[0] != room:
            continue
        for name in includes(path):
            beside = (path.parent / name).exists()
            target = name_of((path.parent / name).resolve()) if beside else name
            if target in ours:
                assert target.split("/")[0] in ALLOWED[room], f"{name_of(path)} includes {target}"
            assert room == "python" or target != "Python.h", f"{name_of(path)} includes Python.h"
            assert room in ("gl", "python") or not re.match(r"E?GL/", target), name_of(path)


def test_the_tile_knows_no_technique():
    for name in ("tile.c", "tile.h", "totals.c", "totals.h"):
        path = ROOT / "core" / name
        assert not any("techniques" in included for included in includes(path))
        assert not any("techniques" in name_of(other) for other in calls(path))


def test_each_technique_is_one_line_and_a_row_where_it_weighs():
    """So that who adds one touches that line and a file of its own. Without a row nothing links."""
    kinds = re.findall(rf"\bKIND\(({WORD}), ({WORD})\)", code(ROOT / "moit_technique.h"))
    assert [row for _, row in kinds] == [kind.replace("-", "_") for kind in FACTS]
    found = {}
    for path in CORE:
        for row, text in re.findall(
            rf"moit_technique_row moit_({WORD})_row = {{(.*?)\n?}};", code(path), re.DOTALL
        ):
            found[row] = path
            assert re.search(rf"\b{re.search(rf'[.]weigh = ({WORD})', text)[1]}\(", code(path))
    assert set(found) == {row for _, row in kinds}
