"""What moit says of itself and its surroundings, and what importing it costs others."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from gpu import device
from small import ENVIRONMENT

import moit
from moit.system.environment import EXTRAS, thread_count

ROOT = Path(__file__).parent.parent


def test_importing_moit_imports_nothing_heavy():
    heavy = ("matplotlib", "OpenImageIO", "OpenEXR", "tqdm", "trimesh", "moderngl", "asyncio")
    heavy += ("moit._gl", "moit.gpu", "moit.gpu.texts")
    code = f"import sys, moit; print([m for m in {heavy} if m in sys.modules])"
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=ENVIRONMENT
    )
    assert run.stdout.strip() == "[]"


def test_what_is_loaded_later_is_there_all_the_same():
    assert set(moit.__all__) <= set(dir(moit))
    assert all(getattr(moit, name) is not None for name in moit.__all__)
    with pytest.raises(AttributeError, match="compere"):
        moit.compere  # noqa: B018


def test_info_names_versions_and_prints_a_line_for_each():
    found = moit.info()
    assert found["moit"] == moit.__version__
    assert found["threads"] >= 1
    assert found["compiler"].split()[0] in ("gcc", "clang")
    text = str(found)
    for key in ("python", "numpy", "OpenImageIO", "OpenEXR", "GPU", "extra plot"):
        assert any(line.startswith(key) for line in text.splitlines()), key


def test_info_says_what_draws_or_what_is_missing_for_that():
    with pytest.MonkeyPatch.context() as patch:  # read when libEGL is first opened
        code = "import moit; print(moit.info()['GPU'])"
        patch.setitem(ENVIRONMENT, "MOIT_EGL", "libEGL-of-nobody.so")
        run = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env=ENVIRONMENT,
        )
    assert "libEGL-of-nobody.so" in run.stdout
    assert "install" in run.stdout
    assert moit.info()["GPU"].startswith(device().renderer)


def test_info_says_how_to_install_a_missing_extra(monkeypatch):
    monkeypatch.setitem(EXTRAS, "mesh", ("no-such-distribution-of-moit",))
    assert "pip install 'moit[mesh]'" in moit.info()["extra"]["mesh"]


def test_info_lists_the_extras_of_the_project_file():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert set(EXTRAS) == set(extras) - {"test", "all"}
    for name, distributions in EXTRAS.items():
        listed = " ".join(extras[name]).replace("moit[plot]", " ".join(extras["plot"]))
        for one in distributions:
            assert one in listed, (name, one)


def test_threads_come_from_the_argument_then_the_environment_then_the_machine(monkeypatch):
    monkeypatch.setenv("MOIT_THREADS", "3")
    assert thread_count(2) == 2
    assert thread_count(None) == 3
    monkeypatch.setenv("MOIT_THREADS", "")
    assert thread_count(None) >= 1
    monkeypatch.delenv("MOIT_THREADS")
    if hasattr(os, "sched_getaffinity"):
        assert thread_count(None) == len(os.sched_getaffinity(0))


@pytest.mark.parametrize("text", ["0", "-1", "two", "1.5", "1e3", "\u0663"])
def test_a_bad_thread_variable_is_named(monkeypatch, text):
    monkeypatch.setenv("MOIT_THREADS", text)
    with pytest.raises(ValueError, match="MOIT_THREADS"):
        thread_count(None)


@pytest.mark.parametrize("threads", [0, -4, -(2**80)])
def test_fewer_than_one_thread_is_an_error(threads):
    with pytest.raises(ValueError, match="threads: expected at least 1"):
        thread_count(threads)


@pytest.mark.parametrize("threads", [1.0, "2", True, [1]])
def test_threads_are_integers(threads):
    with pytest.raises(TypeError, match="threads: expected an integer"):
        thread_count(threads)
