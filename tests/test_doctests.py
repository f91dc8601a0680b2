"""Every public name ends with a short example, and the examples run."""

import doctest
import inspect
import sys

import numpy as np
import pytest
from gpu import device

import moit

MODULES = (
    moit.deep,
    moit.gpu,
    moit.gradients,
    moit.moments,
    moit.metrics,
    moit.plot,
    moit.scenes,
    moit.storage,
)
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def public():
    """Each public object by its name: those of moit, and the functions of its open modules."""
    found = {f"moit.{name}": getattr(moit, name) for name in moit.__all__}
    found = {name: held for name, held in found.items() if not inspect.ismodule(held)}
    for module in MODULES:
        for name in getattr(module, "__all__", vars(module)):
            held = getattr(module, name)
            ours = getattr(held, "__module__", "").startswith(module.__name__)
            public = inspect.isfunction(held) or inspect.isclass(held)
            if public and ours and not name.startswith("_"):
                found[f"{module.__name__}.{name}"] = held
    return found


PUBLIC = public()


def examples(name):
    return doctest.DocTestParser().get_examples(inspect.getdoc(PUBLIC[name]) or "")


def test_all_have_an_example():
    for name, one in PUBLIC.items():
        doc = inspect.getdoc(one) or ""
        assert ">>>" in doc, f"{name} has no example"
        assert doc.split("\n\n")[-1].startswith(">>>"), f"{name} does not end with its example"
        # A class without a docstring shows that of its base: the example would be of another.
        assert not inspect.isclass(one) or "__doc__" in vars(one), name


@pytest.mark.parametrize("name", PUBLIC)
def test_its_example_runs(name, tmp_path, monkeypatch):
    written = examples(name)
    source = "".join(example.source for example in written)
    if "moit.plot" in source:
        pytest.importorskip("matplotlib").use("Agg")
    if "read_mesh" in source:
        pytest.importorskip("trimesh", reason="no trimesh, so no mesh files")
    if "gpu" in source:
        device()
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTest(written, {"moit": moit, "np": np}, name, None, None, None)
    told = []
    doctest.DocTestRunner(optionflags=OPTIONS, verbose=False).run(test, out=told.append)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
    assert not told, "".join(told)
