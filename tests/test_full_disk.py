"""On a full disk every writer keeps the old file, says so, and leaves nothing behind.

A limit of the size of files stands for the disk: it stops a write at any byte, as a quota does.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from forked import Server
from small import PATIENCE

pytest.importorskip("resource")

BEGINNING = """
import contextlib, io, json, os, random, resource, signal, sys
import numpy as np
import moit
from moit.__main__ import main

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
rng = np.random.default_rng(1)
noise = rng.random((37, 300, 4), np.float32)
f = moit.scenes.load("cloud", (40, 30))
moit.write_deep("input.exr", f)
made = {"input.exr"}

def command(*words):
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = main(words)
    if code:
        raise OSError(said.getvalue())

def contents():
    return {
        os.path.join(folder, name): open(os.path.join(folder, name), "rb").read()
        for folder, _, names in os.walk(".") for name in names
    }
"""

# Tries the writer at every phase of its largest file.
TRIES = """
write()
before = contents()
own = [len(content) for name, content in before.items() if name[2:] not in made]
largest, found = max(own), []
limits = {0, 1, 7, 100, 600, largest // 3, largest // 2, largest - 4096, largest - 100}
limits |= {largest - 9, largest - 1, *(random.Random(5).randrange(largest) for _ in range(6))}
unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
limits = sorted(one for one in limits if 0 <= one < largest)
for limit in limits:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, unlimited[1]))
    said = None
    try:
        write()
    except Exception as error:
        said = [type(error).__name__, str(error)]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    now = contents()
    if said is None or said[0] != "OSError" or "no space" not in said[1]:
        found.append([limit, said])
    if now != before:
        found.append([limit, sorted(k for k in {*now, *before} if now.get(k) != before.get(k))])
print(json.dumps({"found": found, "tried": len(limits), "largest": largest}))
"""

NETWORK = """
network = moit.Network.shipped("neural-bounded")
"""
REPORT = """
report = moit.compare({"panes": moit.scenes.load("panes", (16, 12))}, ["power4"], repeat=1)
"""
FRAME = """
framed = moit.read_deep("input.exr")
frame = framed.frame
"""
BLOCKS = """
from moit.reports.blocks import Gallery, Markdown, Picture
def blocks(ending):
    return Markdown("pages", ending=ending)([Gallery([Picture("one", "One", noise[..., :3])])])
"""
FIGURE = """
figure = moit.plot.curves(f, "power4", pixel=(15, 20)).figure
"""
CHECKPOINT = """
from moit.neural import checkpoint
from moit.neural.fitting import State
state = State.start((3, 8, 1), 0)
"""

WRITERS = {
    "exr": 'write = lambda: moit.write_image("a.exr", noise)',
    "small exr": 'write = lambda: moit.write_image("a.exr", noise[:12, :14])',
    "half": 'write = lambda: moit.write_image("a.exr", noise, half=True)',
    "long header": 'write = lambda: moit.write_image("a.exr", noise, attributes={"a": "b" * 9**5})',
    "png": 'write = lambda: moit.write_image("a.png", noise)',
    "small png": 'write = lambda: moit.write_image("a.png", noise[:2, :2], alpha=True)',
    "deep": 'write = lambda: moit.write_deep("a.exr", f)',
    "deep, another name": 'write = lambda: moit.write_deep(b"\\xff.exr", f, half=True)',
    "with a frame": FRAME + 'write = lambda: moit.write_image("a.exr", noise, frame=frame)',
    "deep with a frame": FRAME + 'write = lambda: moit.write_deep("a.exr", framed)',
    "npz": 'write = lambda: moit.save("a.npz", f)',
    "network": NETWORK + 'write = lambda: network.write("a.npz")',
    "checkpoint": CHECKPOINT + 'write = lambda: checkpoint.write("a.npz", state, {"a": 1})',
    "csv": REPORT + 'write = lambda: report.to_csv("a.csv")',
    "json": REPORT + 'write = lambda: report.to_json("a.json")',
    "html": REPORT + 'write = lambda: report.to_html("a.html")',
    "png in a page": BLOCKS + 'write = lambda: blocks("png")',
    "jpg in a page": BLOCKS + 'write = lambda: blocks("jpg")',
    "composite": 'write = lambda: command("composite", "panes", "-tpower4", "-oa.png")',
    "bands": 'write = lambda: command("composite", "input.exr", "-tpower4", "-oa.exr")',
    "merged": 'write = lambda: moit.deep.merge(["input.exr"] * 2, "a.exr")',
    "simplified": 'write = lambda: moit.deep.simplify("input.exr", "a.exr", 1e-4)',
    "points": 'write = lambda: moit.deep.to_points("input.exr", "a.ply", moit.Camera())',
    "moments": 'write = lambda: moit.deep.to_moments("input.exr", "a.exr")',
    "curve": 'write = lambda: command("curve", "panes", "-tpower4", "-oa.svg")',
    "plot": 'write = lambda: command("curve", "panes", "-tpower4", "-oa.png")',
    "plot, pdf": FIGURE + 'write = lambda: figure.savefig("a.pdf")',
    "shown": 'write = lambda: moit.show(noise).save("a.png")',
}  # fmt: skip
for _compression in ("none", "rle", "zips", "piz", "pxr24", "b44", "dwaa"):
    WRITERS[_compression] = (
        f'write = lambda: moit.write_image("a.exr", noise, attributes={{"compression": '
        f'"{_compression}"}})'
    )


@pytest.fixture(scope="module")
def server():
    made = Server()
    yield made
    made.end()


@pytest.mark.parametrize("writer", WRITERS)
def test_a_full_disk_loses_no_file(tmp_path, writer, server):
    if writer.startswith("plot"):
        pytest.importorskip("matplotlib")
    text = BEGINNING + WRITERS[writer] + TRIES
    folder = tmp_path / "files"
    folder.mkdir()
    run = server.run(text, folder, tmp_path)
    assert run.returncode == 0, run.stderr
    assert not run.stderr
    result = json.loads(run.stdout)
    assert result["found"] == []
    assert result["tried"] > 9
    assert os.listdir(tmp_path) == ["files"]


FULL = """
import os, numpy as np, moit
from moit.system.files import write_text

image, f = np.full((12, 14, 4), 0.5, np.float32), moit.scenes.load("panes", (8, 6))
writers = {
    "a.exr": lambda: moit.write_image("a.exr", image),
    "a.png": lambda: moit.write_image("a.png", image),
    "d.exr": lambda: moit.write_deep("d.exr", f),
    "a.npz": lambda: moit.save("a.npz", f),
    "a.txt": lambda: write_text("a.txt", "text" * 2000),
}
for write in writers.values():
    write()
before = {name: open(name, "rb").read() for name in os.listdir()}
with open("fill", "wb", buffering=0) as fill:
    try:
        while fill.write(bytes(4096)):
            pass
    except OSError:
        pass
for name, write in writers.items():
    try:
        write()
    except OSError as error:
        assert "no space left on its disk" in str(error) and name in str(error), error
    else:
        raise AssertionError(name)
os.unlink("fill")
assert {name: open(name, "rb").read() for name in os.listdir()} == before
"""


def test_a_disk_that_is_full_loses_no_file(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(disk)]
    try:
        if subprocess.run(mount, capture_output=True).returncode:
            pytest.skip("mounting takes rights")
    except FileNotFoundError:
        pytest.skip("there is no mount")
    try:
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
        run = subprocess.run(
            [sys.executable, "-c", FULL], cwd=disk, env=environment, capture_output=True, text=True,
            timeout=PATIENCE,
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
    finally:
        subprocess.run(["umount", str(disk)], check=True)
