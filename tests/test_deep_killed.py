"""Verbs of deep files that are killed, or meet in one folder, leave whole files only."""

import json
import sys

import pytest
from forked import Server

if sys.platform == "win32":
    pytest.skip("there is no fork", allow_module_level=True)

BEGINNING = """
import json, os, signal, sys
import moit

f = moit.scenes.load("panes", (12, 10))
moit.write_deep("a.exr", f)
"""

# Kills a process of its own whenever something is opened, named or removed: before the first time,
# before the second, and so on, until it lives long enough.
PHASES = """
verb("out")
with open("out", "rb") as file:
    whole = file.read()
found, phases = [], 0
while True:
    with open("out", "wb") as file:
        file.write(b"before")
    child = os.fork()
    if not child:
        left = phases
        def look(event, given):
            global left
            if event in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir"):
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
        sys.addaudithook(look)
        verb("out")
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    with open("out", "rb") as file:
        content = file.read()
    if content == whole:
        found.append("whole")
    else:
        found.append("before" if content == b"before" else "broken")
    if code == 0:
        break
    assert code == -signal.SIGKILL
    phases += 1
print(json.dumps(found))
"""

VERBS = {
    "simplify": 'verb = lambda path: moit.deep.simplify("a.exr", path, 0.02)',
    "to_points": 'verb = lambda path: moit.deep.to_points("a.exr", path, moit.Camera())',
    "to_moments": 'verb = lambda path: moit.deep.to_moments("a.exr", path)',
    "curve": 'verb = lambda path: moit.deep.curve("a.exr", path, "power4")',
}


@pytest.fixture(scope="module")
def server():
    made = Server()
    yield made
    made.end()


def results(server, tmp_path, text):
    folder = tmp_path / "files"
    folder.mkdir()
    run = server.run(text, folder, tmp_path)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


@pytest.mark.parametrize("verb", VERBS)
def test_who_is_killed_in_any_phase_leaves_whole_files(tmp_path, server, verb):
    ending = {"curve": ".svg", "to_points": ".ply"}.get(verb, ".exr")
    text = (BEGINNING + VERBS[verb] + PHASES).replace('"out"', f'"out{ending}"')
    found = results(server, tmp_path, text)
    assert len(found) > 2 and found[0] == "before" and found[-1] == "whole"
    assert "broken" not in found


TOGETHER = """
errors = (0.01, 0.3)
for error in errors:
    moit.deep.simplify("a.exr", f"{error}.exr", error)
wholes = [open(f"{error}.exr", "rb").read() for error in errors]
with open("out.exr", "wb") as file:
    file.write(wholes[0])
children = []
for i, error in enumerate(errors):
    child = os.fork()
    if not child:
        for k in range(8):
            moit.deep.simplify("a.exr", "out.exr", error)
            moit.deep.simplify("a.exr", f"own{i}.exr", error)
        os._exit(0)
    children.append(child)
seen = set()
while children:
    with open("out.exr", "rb") as file:
        content = file.read()
    seen.add(wholes.index(content) if content in wholes else -1)
    if os.waitpid(children[0], os.WNOHANG)[0]:
        del children[0]
own = [open(f"own{i}.exr", "rb").read() == wholes[i] for i in range(2)]
print(json.dumps([sorted(seen), own, sorted(os.listdir())]))
"""


def test_two_processes_in_one_folder_disturb_neither(tmp_path, server):
    seen, own, names = results(server, tmp_path, BEGINNING + TOGETHER)
    assert -1 not in seen and own == [True, True]
    assert names == sorted(["a.exr", "0.01.exr", "0.3.exr", "out.exr", "own0.exr", "own1.exr"])
