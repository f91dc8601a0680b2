"""The folder of `moit.export` on a disk: what it replaces, and that it is whole or not there."""

import os
import shutil

import pytest

import moit
from moit.__main__ import main


def test_an_export_before_is_replaced_and_nothing_else_is(tmp_path):
    folder = tmp_path / "kit"
    moit.export("power4", folder)
    moit.export("wboit", folder, "metal")
    assert sorted(os.listdir(folder)) == ["README.md", "moit_wboit.metal", "targets.json"]
    (folder / "mine.txt").write_text("mine")
    with pytest.raises(FileExistsError, match=r"holds 'mine.txt'"):
        moit.export("power4", folder)
    assert (folder / "mine.txt").read_text() == "mine"
    (tmp_path / "file").write_text("a file")
    with pytest.raises(FileExistsError, match="needed a folder"):
        moit.export("power4", tmp_path / "file")
    assert sorted(os.listdir(tmp_path)) == ["file", "kit"]


def test_a_folder_appears_whole_or_not_at_all(tmp_path, monkeypatch):
    folder = tmp_path / "kit"
    moit.export("power4", folder)
    before = {one: (folder / one).read_text() for one in os.listdir(folder)}

    def full(text: str, *_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("moit.system.files._to_disk", full)
    with pytest.raises(OSError, match="no space left"):
        moit.export("wboit", folder)
    assert {one: (folder / one).read_text() for one in os.listdir(folder)} == before
    assert os.listdir(tmp_path) == ["kit"]


def test_the_command_line_writes_a_folder(tmp_path, capsys):
    folder = str(tmp_path / "kit")
    command = ["export", "wboit", "-o", folder, "--language", "hlsl", "--depth-range", "1,50"]
    assert main(command) == 0
    assert os.path.join(folder, "moit_wboit.hlsl") in capsys.readouterr().out
    assert main(["export", "power4", "-o", folder, "--language", "cg"]) == 1
    assert "expected 'glsl'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["", ".", "..", "link"])
def test_the_folder_one_works_in_is_never_replaced(name, tmp_path, monkeypatch):
    # "" is what a shell makes of a variable that is not set
    own = tmp_path / "work"
    own.mkdir()
    (own / "thesis.tex").write_text("years of work")
    (own / "inner").mkdir()
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(own)
    with pytest.raises(OSError, match=r"folder"):
        moit.export("wboit", name if name != "link" else own)
    assert (own / "thesis.tex").read_text() == "years of work"
    monkeypatch.chdir(tmp_path / "empty")
    (own / "link").symlink_to(tmp_path / "empty")
    if name != "..":
        where = own / "link" if name == "link" else name
        with pytest.raises(OSError, match=r"works in|needs a name"):
            moit.export("wboit", where)
    assert os.path.samefile(os.getcwd(), tmp_path / "empty")
    assert os.listdir(tmp_path / "empty") == []
    assert sorted(os.listdir(tmp_path)) == ["empty", "work"]


@pytest.mark.parametrize(
    "files",
    [
        {"README.md": "my project"},
        {"targets.json": '{"include": "main.c"}', "main.c": "int main;"},
        {"targets.json": "[" * 10**5},
        {"targets.json": '{"include": ["moit"], "moit": 1, "technique": 1, "language": 1}'},
    ],
)
def test_files_of_others_that_look_like_an_export_stay(files, tmp_path):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(FileExistsError, match="holds"):
        moit.export("wboit", tmp_path)
    assert {one: (tmp_path / one).read_text() for one in os.listdir(tmp_path)} == files


def test_an_interrupt_between_two_names_brings_the_old_folder_back(tmp_path, monkeypatch):
    folder = tmp_path / "kit"
    moit.export("power4", folder)
    before = {one: (folder / one).read_text() for one in os.listdir(folder)}
    rename, calls = os.rename, []

    def interrupted(old, new):
        calls.append(new)
        if len(calls) == 2:
            raise KeyboardInterrupt
        rename(old, new)

    monkeypatch.setattr("moit.system.files.os.rename", interrupted)
    with pytest.raises(KeyboardInterrupt):
        moit.export("wboit", folder)
    assert {one: (folder / one).read_text() for one in os.listdir(folder)} == before
    assert os.listdir(tmp_path) == ["kit"]


@pytest.mark.parametrize("wrong", ["12", b"12", {1.0, 2.0}, {1: 0, 2: 0}, (1, 10**400), 3])
def test_a_depth_range_is_two_numbers_in_order(wrong, tmp_path):
    with pytest.raises(TypeError, match=r"depth_range: expected \(near, far\), got"):
        moit.export("power4", tmp_path / "kit", depth_range=wrong)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("other", ["puts its own there", "takes the old one away"])
def test_two_that_export_at_once_both_succeed(other, tmp_path, monkeypatch):
    folder = tmp_path / "kit"
    moit.export("power4", folder)
    rename, calls = os.rename, []

    def disturbed(old, new):
        calls.append(new)
        if len(calls) == 1 and other == "takes the old one away":
            shutil.rmtree(folder)
        if len(calls) == 2 and other == "puts its own there":
            folder.mkdir()
            (folder / "moit_power6.glsl").write_text("of the other")
        rename(old, new)

    monkeypatch.setattr("moit.system.files.os.rename", disturbed)
    moit.export("wboit", folder)
    assert sorted(os.listdir(folder)) == ["README.md", "moit_wboit.glsl", "targets.json"]
    assert os.listdir(tmp_path) == ["kit"]
