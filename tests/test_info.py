"""What moit says of itself and its surroundings, and what importing it costs others."""

import io
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from gpu import device
from small import ENVIRONMENT

import moit
from moit.__main__ import main
from moit.about import EXTRAS
from moit.system import progress
from moit.system.environment import machine, processor, processors, thread_count
from moit.system.files import must_be_writable, replacing, write_text

ROOT = Path(__file__).parent.parent


def test_importing_moit_imports_nothing_heavy():
    heavy = (
        "matplotlib",
        "OpenImageIO",
        "OpenEXR",
        "tqdm",
        "trimesh",
        "moderngl",
        "asyncio",
        "torch",
        "jax",
    )
    heavy += ("moit._gl", "moit.gpu", "moit.gpu.texts")
    # each takes milliseconds, and nobody needs it until something is asked for
    heavy += ("statistics", "zipfile", "difflib", "html", "hashlib", "secrets", "shutil")
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
    assert set(EXTRAS) == set(extras) - {"test", "all", "docs"}
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


def test_threads_are_as_many_as_the_core_can_count():
    assert thread_count(2**40) == thread_count(2**31 - 1) == 2**31 - 1


def test_processors_are_those_that_the_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 5}, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert processors() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    assert processors() == 64


def test_a_line_says_what_times_were_measured_on(monkeypatch):
    monkeypatch.setenv("MOIT_THREADS", "37")
    parts = machine().split(", ")
    assert parts[0] == f"moit {moit.__version__}" and "37 threads" in parts
    assert parts[-1] == f"Python {sys.version.split()[0]}" and processor() in machine()
    facts = Path("/proc/cpuinfo")
    if facts.exists() and "model name" in facts.read_text():
        assert f": {processor()}\n" in facts.read_text()


# Files appear whole or not at all


@pytest.mark.parametrize("error", [OSError, ValueError, KeyboardInterrupt, SystemExit])
def test_whatever_ends_a_write_leaves_the_old_file_and_nothing_else(error, tmp_path):
    path = tmp_path / "kept.txt"
    write_text(path, "old")
    with pytest.raises(error), replacing(path) as part:
        Path(part).write_text("half")
        assert Path(part).parent == tmp_path and Path(part).suffix == ".txt"
        assert path.read_text() == "old"
        raise error
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_link_stays_and_what_it_leads_to_changes(tmp_path):
    (tmp_path / "there").mkdir()
    path, link = tmp_path / "there" / "real.txt", tmp_path / "link.txt"
    link.symlink_to(path)
    write_text(link, "text")
    assert link.is_symlink() and path.read_text() == "text"


def test_what_is_no_file_is_not_replaced(tmp_path):
    for path, words in (
        (tmp_path, "over a folder"),
        ("/dev/null", "regular file"),
        (tmp_path / "no" / "such.txt", "no such folder"),
    ):
        with pytest.raises(OSError, match=words), replacing(path):
            raise AssertionError("the block runs")
        with pytest.raises(OSError, match=words):
            must_be_writable(path)
    assert not Path("/dev/null").is_file()


def test_whether_a_file_can_be_written_leaves_no_trace(tmp_path):
    must_be_writable(tmp_path / "new.txt")
    write_text(tmp_path / "old.txt", "old")
    must_be_writable(tmp_path / "old.txt")
    assert [one.name for one in tmp_path.iterdir()] == ["old.txt"]
    assert (tmp_path / "old.txt").read_text() == "old"


@pytest.mark.parametrize(
    "line",
    [
        "bench --gpu-cost -t none",
        "bench --gpu -t none",
        "bench -t none",
        "train neural-bounded --data none.npz",
        "composite none.npz -t power4",
        "curve none.npz",
    ],
)
def test_commands_ask_whether_they_can_write_before_they_begin(line, tmp_path, capsys):
    # else what they would do first is refused, too
    path = tmp_path / "no" / "such.svg"
    assert main([*line.split(), "-o", str(path)]) == 1
    assert "there is no such folder" in capsys.readouterr().err


# Progress


def shown(monkeypatch, seconds, terminal=False, label="x"):
    """What steps that end at these seconds show."""
    out, now = io.StringIO(), [0.0]
    monkeypatch.setattr(out, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(sys, "stderr", out)
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with progress.steps(True, len(seconds), "title") as done:
        for at in seconds:
            now[0] = at
            done(label)
    return out.getvalue()


def test_a_log_gets_a_line_every_ten_seconds(monkeypatch):
    assert shown(monkeypatch, [1.0, 9.9]) == ""
    lines = shown(monkeypatch, [1.0, 10.0, 19.0, 21.0, 29.0, 31.5]).splitlines()
    assert lines == ["title: 2/6  10 s  x", "title: 4/6  21 s  x", "title: 6/6  32 s  x"]


def test_a_terminal_gets_a_line_that_overwrites_itself(monkeypatch):
    written = shown(monkeypatch, [1.0, 2.0], terminal=True, label="y" * 200)
    first, second = written.rstrip("\n").split("\r")[1:]
    assert first.startswith("title: 1/2  yyy") and second.startswith("title: 2/2  yyy")
    assert len(first) == len(second) == 79
