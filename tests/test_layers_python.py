"""A room of moit imports rooms below it only: at the top, in functions, and for types alike."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1] / "moit"

# From bottom to top: folders, or files that lie beside them. What stands in one line may not
# import one another but within itself.
ORDER = """
    checks
    system
    reports
    fragments
    formats
    catalog
    core metrics storage
    geometry
    scenes
    shadows
    gpu
    gpu_costs
    kit
    per_pixel python_techniques
    engines
    inputs
    showing
    questions
    rendering moments deep_composites about
    gradients
    torch jax
    comparing
    numerics
    neural
    plot
    deep
    benching
    experiments judging
    commands
    __main__
    __init__
"""
RANK = {room: rank for rank, line in enumerate(ORDER.strip().splitlines()) for room in line.split()}
FILES = sorted(ROOT.rglob("*.py"))
MODULES = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in FILES
}


def room_of(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def called(node):
    """The last name of what a call calls."""
    return getattr(node.func, "attr", None) or getattr(node.func, "id", "")


def imported(path, modules=MODULES):
    """The files that one imports, wherever in it, with the lines; compiled modules are none."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports by absolute names only"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Call) and called(node).endswith("import_module"):
            inside = ast.unparse(node.args[0]).startswith(f"f'moit.{room_of(path)}.")
            allowed = inside or path == ROOT / "__init__.py"
            assert allowed, f"{path}: only moit itself imports other rooms by computed names"
        for name in names:
            while name and name not in modules:
                name = name.rpartition(".")[0]
            if name and modules[name] != ROOT / "__init__.py":
                found.append((modules[name], node.lineno))
            elif name == "moit" and isinstance(node, ast.ImportFrom):
                what = node.names[0].name
                assert what in ("_core", "_gl"), f"{path}:{node.lineno}: imports moit itself"
    return found


def test_every_file_has_a_place():
    assert {room_of(path) for path in FILES} == set(RANK)


def test_imports_go_down():
    assert not [
        f"{path.relative_to(ROOT)}:{line} imports {other.relative_to(ROOT)}"
        for path in FILES
        for other, line in imported(path)
        if room_of(other) != room_of(path) and RANK[room_of(other)] >= RANK[room_of(path)]
    ]


def test_no_files_import_one_another_in_a_circle():
    arrows = {path: {other for other, _ in imported(path)} - {path} for path in FILES}
    while True:
        ends = [path for path, others in arrows.items() if not others]
        if not ends:
            break
        for path in ends:
            del arrows[path]
        for others in arrows.values():
            others.difference_update(ends)
    # what is left is in circles, or imports what is
    assert not [path.relative_to(ROOT).as_posix() for path in arrows]


def test_imports_in_functions_and_for_types_are_seen(tmp_path):
    path = tmp_path / "one.py"
    path.write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from moit.questions import composite\n"
        "def f():\n    import moit.plot\n    from moit.scenes import load\n"
        "class C:\n    from moit import gpu\n"
    )
    seen = {other.relative_to(ROOT).as_posix() for other, _ in imported(path)}
    assert seen == {"questions.py", "plot/__init__.py", "scenes/__init__.py", "gpu/__init__.py"}
