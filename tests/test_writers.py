"""Every command that writes, on a full disk, killed in any phase, and two at once in one folder:
what is there afterwards is whole, and who could not write says so.

A limit of the size of files stands for the full disk. What one file goes through in each byte is
test_full_disk.py's; here are all commands, with all of their files.
"""

import argparse
import json
import os
import sys

import pytest
from forked import Server

import moit.__main__ as line
from moit.comparing import results_folder
from moit.judging import running
from moit.numerics import stability

if sys.platform == "win32":
    pytest.skip("there is no fork", allow_module_level=True)

# What each is asked for; {out} is what it writes to. Small, as each is run some twenty times.
COMMANDS = {
    "compare": "small.npz -t power4,sorted --repeat 1 -o {out}",
    "composite": "small.npz -t power4 -o {out}.png",
    "curve": "small.npz -t power4 -o {out}.svg",
    "merge": "a.exr b.exr -o {out}.exr",
    "flatten": "a.exr -o {out}.exr",
    "holdout": "a.exr b.exr -o {out}.exr",
    "recolor": "a.exr flat.exr -o {out}.exr",
    "crop": "a.exr --window 1,1,4x4 -o {out}.exr",
    "simplify": "a.exr --error 0.01 -o {out}.exr",
    "to-points": "a.exr --eye 0,0,9 -o {out}.ply",
    "to-moments": "a.exr -o {out}.exr",
    "bench": "--gpu-cost --stored -t wboit -o {out}.md",
    "train": "neural-bounded --data small.npz --epochs 2 --seed 1 -o {out}.npz",
    "stability": "-t power4 -f distance -p float32 --rays 2 -o {out}",
    "experiment": "mt-fig2 --size tiny -o {out}",
    "export": "wboit -o {out}",
}
# They write by the functions of `compare`, of more scenes.
ALIKE = {"demo": "compare"}

BEGINNING = """
import contextlib, csv, io, json, os, resource, signal, struct, sys, zipfile
import moit
from moit.__main__ import main

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
f = moit.scenes.load("panes", (8, 6))
moit.save("small.npz", f)
moit.write_deep("a.exr", f)
moit.write_deep("b.exr", moit.scenes.load("panes", (8, 6), seed=1))
moit.write_image("flat.exr", moit.composite(f, "sorted"))
made = set(os.listdir("."))

def run(out):
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = main([COMMAND, *(word.format(out=out) for word in WORDS)])
    return code, said.getvalue()

def written():
    return {
        os.path.join(folder, name): open(os.path.join(folder, name), "rb").read()
        for folder, _, names in os.walk(".") for name in names
        if name not in made and ".moit-" not in os.path.join(folder, name)
    }

def is_whole(name, content):
    kind = name.rpartition(".")[2]
    if kind == "exr":
        if COMMAND == "to-moments":
            moit.deep.read_moments(name)
        else:
            deep = moit.inspect(name).parts[0].deep
            moit.read_deep(name) if deep else moit.read_image(name)
    elif kind == "npz":
        assert zipfile.ZipFile(name).testzip() is None
    elif kind == "json":
        json.loads(content)
    elif kind == "png":
        assert content.endswith(b"IEND\\xae\\x42\\x60\\x82")
    elif kind == "ply":
        head, _, rest = content.partition(b"end_header\\n")
        assert rest and b"vertex" in head
    elif kind in ("html", "svg"):
        assert content.rstrip().endswith(f"</{kind}>".encode())
    else:
        assert content.endswith(b"\\n")

def broken(files):
    found = []
    for name, content in files.items():
        try:
            is_whole(name, content)
        except Exception as error:
            found.append([name, repr(error)])
    return found
"""

FULL = """
# Single results are measured anew where a run is not resumed; a checkpoint is kept to go on from.
def lasting(files):
    return {name for name in files if "/results/" not in name and ".checkpoint." not in name}

assert run("out")[0] == 0
names, largest = lasting(written()), max(map(len, written().values()))
found, unlimited = [], resource.getrlimit(resource.RLIMIT_FSIZE)
for limit in (0, largest // 2, largest * 9 // 10):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, unlimited[1]))
    code, said = run("out")
    resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    if code == 0 or "no space" not in said:
        found.append([limit, code, said])
    found += broken(written())
    found += [[limit, name] for name in sorted(names ^ lasting(written()))]
    found += [[limit, "left behind", folder] for folder, inner, files in os.walk(".")
              for name in [*inner, *files] if name.startswith(".moit-")]
print(json.dumps({"found": found, "files": len(names)}))
"""

# Kills a process of its own before the first time that something is opened to be written, named or
# removed, before the second, the fourth and so on, until it lives long enough.
KILLED = """
found, phase = [], 0
while True:
    child = os.fork()
    if not child:
        left = phase
        def look(event, given):
            global left
            writes = event in ("os.rename", "os.remove", "os.mkdir", "os.rmdir")
            if event == "open" and isinstance(given[0], str | bytes | os.PathLike):
                writes = not (given[1] or "r").startswith("r") or given[1] == "r+b"
            if writes:
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
        sys.addaudithook(look)
        os._exit(run("out")[0])
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    found += broken(written())
    if code == 0:
        break
    assert code == -signal.SIGKILL, code
    phase = max(phase + 1, 2 * phase)
code, said = run("out")
assert code == 0, said
print(json.dumps({"found": found + broken(written()), "files": len(written()), "phase": phase}))
"""

TOGETHER = """
assert run("out")[0] == 0
names = set(written())
children = []
for k in range(2):
    child = os.fork()
    if not child:
        runs = [run("out") for _ in range(2)]
        for code, said in runs:
            if code:
                print(said, file=sys.stderr, flush=True)
        os._exit(max(code for code, _ in runs))
    children.append(child)
codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
found = broken(written()) + sorted(names ^ set(written()))
assert codes == [0, 0]
print(json.dumps({"found": found, "files": len(names)}))
"""


@pytest.fixture(scope="module")
def server():
    made = Server()
    yield made
    made.end()


def asked(server, tmp_path, command, text):
    folder = tmp_path / "files"
    folder.mkdir()
    words = f"COMMAND, WORDS = {command!r}, {COMMANDS[command].split()!r}\n"
    run = server.run(words + BEGINNING + text, folder, tmp_path)
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert result["found"] == [] and result["files"] > 0
    return result


def test_every_command_that_writes_is_tried():
    parser = line._parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    writing = {name for name, one in commands.choices.items() if "-o" in one._option_string_actions}
    assert writing == {*COMMANDS, *ALIKE}
    assert set(ALIKE.values()) <= set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_disk_leaves_whole_files_and_is_told(tmp_path, server, command):
    asked(server, tmp_path, command, FULL)


@pytest.mark.parametrize("command", COMMANDS)
def test_who_is_killed_in_any_phase_leaves_whole_files(tmp_path, server, command):
    assert asked(server, tmp_path, command, KILLED)["phase"] > 1


@pytest.mark.parametrize("command", COMMANDS)
def test_two_at_once_in_one_folder_leave_whole_files(tmp_path, server, command):
    asked(server, tmp_path, command, TOGETHER)


CLEARING = {
    results_folder: lambda folder: results_folder.ResultsFolder(folder).clear(),
    running: lambda folder: running.KeptMeasures(folder).clear(),
    stability: stability.clear,
}


@pytest.mark.parametrize("module", CLEARING)
def test_what_another_process_has_just_removed_is_no_error(tmp_path, monkeypatch, module):
    (tmp_path / "distance").mkdir()
    for name in "ab":
        (tmp_path / "distance" / f"{name}.json").write_text("{}")

    def gone(path, _):
        os.unlink(path)
        return True

    monkeypatch.setattr(module, "is_kept", gone)
    CLEARING[module](str(tmp_path))
    assert os.listdir(tmp_path / "distance") == []


def test_what_another_process_is_writing_is_not_cleared(tmp_path):
    (tmp_path / "distance").mkdir()
    part = tmp_path / "distance" / ".moit-0123456789abcdef.json"
    part.write_text('{"question": 1, "rows": [], "row": 1, "measured": {}}')
    for module in CLEARING:
        CLEARING[module](str(tmp_path))
    assert part.exists()
    kept = part.rename(tmp_path / "distance" / "kept.json")
    CLEARING[stability](str(tmp_path))
    assert not kept.exists()
