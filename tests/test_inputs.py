"""What may stand for fragments, and how progress is shown."""

import io
import sys
from pathlib import Path

import pytest
from small import some_fragments

import moit
from moit.inputs import as_fragments
from moit.system.progress import steps


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_fragments_are_taken_as_they_are():
    f = some_fragments()
    assert as_fragments(f) is f


def test_files_are_read_by_their_ending():
    f = some_fragments()
    moit.save("a.npz", f)
    moit.write_deep("b.exr", f)
    Path("a.npz").rename("c.NPZ")
    for path in ("c.NPZ", Path("c.NPZ"), "b.exr", Path("b.exr").absolute()):
        assert len(as_fragments(path)) == len(f)


def test_a_scene_is_loaded_by_its_name():
    name = moit.scenes.names()[0]
    assert (as_fragments(name).depth == moit.scenes.load(name).depth).all()


def test_a_file_comes_before_a_scene_of_its_name():
    name = moit.scenes.names()[0]
    Path(name).write_bytes(b"")
    with pytest.raises(ValueError, match="cannot tell what"):
        as_fragments(name)


def test_a_folder_does_not_hide_a_scene():
    name = moit.scenes.names()[0]
    Path(name).mkdir()
    assert len(as_fragments(name)) > 0


@pytest.mark.parametrize(
    ("value", "error", "words"),
    [
        ("clowd", ValueError, "did you mean 'cloud'"),
        ("", ValueError, "known: "),
        ("gone.exr", FileNotFoundError, "gone.exr"),
        ("gone.npz", FileNotFoundError, "gone.npz"),
        ("no/such/cloud", FileNotFoundError, "no/such/cloud"),
        (Path("cloud"), FileNotFoundError, "cloud"),
        (Path("."), IsADirectoryError, "folder"),
        ("words.txt", ValueError, "words.txt"),
        (None, TypeError, "NoneType"),
        (3.5, TypeError, "float"),
        (b"cloud", TypeError, "bytes"),
        ([1.0], TypeError, "list"),
    ],
)
def test_anything_else_is_named_with_what_was_needed(value, error, words):
    Path("words.txt").write_text("words")
    with pytest.raises(error, match=words) as raised:
        as_fragments(value, "scene")
    assert str(raised.value).startswith("scene: ")


def test_a_mesh_is_seen_whole():
    pytest.importorskip("trimesh", reason="no trimesh, so no mesh files")
    Path("plate.obj").write_text("v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nf 1 2 3\nf 1 3 4\n")
    f = as_fragments("plate.obj")
    seen = f.counts.reshape(f.shape) > 0
    assert seen.mean() > 0.05
    assert not (seen[0].any() or seen[-1].any() or seen[:, 0].any() or seen[:, -1].any())


def test_a_name_with_nothing_like_it_gets_the_list():
    with pytest.raises(ValueError) as raised:
        as_fragments("zzzzzz")
    assert all(name in str(raised.value) for name in moit.scenes.names())


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("has_tqdm", [True, False])
def test_a_terminal_sees_each_step(monkeypatch, has_tqdm):
    if has_tqdm:
        pytest.importorskip("tqdm")
    else:
        monkeypatch.setitem(sys.modules, "tqdm", None)
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with steps(True, 3, "work") as done:
        for label in "abc":
            done(label)
    shown = terminal.getvalue()
    assert "3/3" in shown and "work" in shown and shown.endswith("\n")


def test_no_progress_writes_nothing(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with steps(False, 1, "work") as done:
        done("a")
    assert terminal.getvalue() == ""


def test_a_log_gets_a_line_now_and_then(monkeypatch):
    log = io.StringIO()
    monkeypatch.setattr(sys, "stderr", log)
    monkeypatch.setattr("moit.system.progress.SECONDS_BETWEEN_LINES", 0.0)
    with steps(True, 2, "work") as done:
        done("a")
        done("b")
    assert [line.split()[1] for line in log.getvalue().splitlines()] == ["1/2", "2/2"]


def test_a_process_without_stderr_shows_nothing(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    with steps(True, 1, "work") as done:
        done("a")
