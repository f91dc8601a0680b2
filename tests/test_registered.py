"""What is registered is all there is, and its class says what is so of it."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import moit
from moit.catalog import registered
from moit.catalog.by_kind import ByKind
from moit.catalog.names import CLASSES, class_of, start_of
from moit.catalog.palette import FAMILIES
from moit.catalog.technique import FACTS
from moit.gpu.drawn import drawn_for
from moit.kit.recipes import names_with_kits, recipe_for, recipe_of

CATALOG = Path(registered.__file__).parent


def test_each_row_of_the_core_has_a_class_that_is_registered():
    assert set(FACTS) == {class_of(start).kind for start in CLASSES} - {"per-pixel"}


def test_each_class_of_a_kind_is_registered():
    """But `PythonTechnique`, which has functions of one's own."""
    for path in CATALOG.glob("*.py"):
        importlib.import_module(f"moit.catalog.{path.stem}")
    kinds, waiting = set(), [moit.Technique]
    while waiting:
        waiting += (found := waiting.pop()).__subclasses__()
        if found.kind and found.__module__.startswith("moit.catalog."):
            kinds.add(found)
    assert kinds - {moit.PythonTechnique} == {class_of(start) for start in CLASSES}


@pytest.mark.parametrize("start", CLASSES)
def test_names_begin_as_the_table_says_and_lead_to_the_class(start):
    made = class_of(start)
    names = [one.base_name for one in (made(**options) for options in made.listed)]
    assert any(start_of(name) == start for name in names)
    assert all(CLASSES[start_of(name)] == CLASSES[start] for name in names)
    assert all(type(moit.technique(name)) is made for name in names)


@pytest.mark.parametrize("start", CLASSES)
def test_each_class_names_its_family(start):
    assert class_of(start).family in {family.title for family in FAMILIES[:-1]}


def test_each_kind_with_a_kit_has_a_name_by_which_kits_are_tested():
    assert {moit.technique(name).kind for name in names_with_kits()} == set(recipe_for.kinds)


def test_what_is_drawn_in_its_own_way_has_targets():
    """Else its passes over triangles would be there, and never be asked for."""
    drawn = {one.kind for one in moit.techniques() if one.drawn_to()}
    assert set(drawn_for.kinds) <= drawn


def test_a_kit_that_leaves_colours_as_they_come_out_scales_none(monkeypatch):
    published = recipe_for["adaptive"]
    technique = moit.AdaptiveTransparency(4, normalize=True)
    assert recipe_of(technique, (1.0, 2.0))
    same = {
        "adaptive": lambda one, depth_range: published(moit.technique("adaptive4"), depth_range)
    }
    monkeypatch.setattr(recipe_for, "_functions", same)
    with pytest.raises(ValueError, match="leaves colours as they come out"):
        recipe_of(technique, (1.0, 2.0))


def test_functions_are_of_kinds_that_there_are_one_each():
    functions = ByKind()
    functions("sorted")(len)
    with pytest.raises(ValueError, match="no row for 'sortd'"):
        functions("sortd")
    with pytest.raises(ValueError, match="'sorted' has len already"):
        functions("sorted")(abs)
    assert functions.kinds == ("sorted",) and "unsorted" not in functions


def types_of(path):
    """(module, name) of what stands there for readers of types, each public by `as`."""
    found = set()
    for block in ast.parse(path.read_text(encoding="utf-8")).body:
        test = getattr(block, "test", None)
        if isinstance(test, ast.Name) and test.id == "TYPE_CHECKING":
            for line in block.body:
                for one in line.names:
                    assert one.name == "*" or one.asname == one.name, one.name
                    found.add((line.module, one.name))
    return found


def test_types_have_what_the_tables_have():
    rows = {tuple(one.split(".")) for one in CLASSES.values()}
    classes = types_of(CATALOG / "registered.py")
    assert classes == {(f"moit.catalog.{module}", name) for module, name in rows}
    everything = types_of(CATALOG.parent / "__init__.py")
    assert ("moit.catalog.registered", "*") in everything
    names = {name for _, name in everything} | {name for _, name in classes}
    with_types = {name for name in moit.__all__ if name not in eager()}
    assert names - {"*"} == with_types
    later = {("moit." + module, name) for name, module in moit._LATER.items()}
    assert later - everything == classes


def eager():
    """Names that `import moit` has at once, public for readers of types by `as`."""
    tree = ast.parse((CATALOG.parent / "__init__.py").read_text(encoding="utf-8"))
    imports = [one for one in tree.body if isinstance(one, ast.ImportFrom)]
    return {name.name for one in imports for name in one.names if name.asname == name.name}


def test_importing_moit_loads_no_class_of_a_technique_and_a_name_loads_its_own():
    code = (
        "import sys, moit; first = set(sys.modules); moit.technique('wboit');"
        "print(*(m for m in first if m.startswith('moit.catalog.')));"
        "print(*(m for m in set(sys.modules) - first if m.startswith('moit.catalog.')))"
    )
    run = [sys.executable, "-c", code]
    first, then = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )[:2]
    modules = {one.split(".")[0] for one in CLASSES.values()}
    assert not modules & {one.split(".")[-1] for one in first.split()}
    assert {one.split(".")[-1] for one in then.split()} & modules == {"weighted"}
