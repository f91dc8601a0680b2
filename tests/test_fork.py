"""A child of fork does all that its parent does, also after the parent used every library.

The threads that a library waits for are not there in a child. ARCHITECTURE says that fork is safe.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from small import PATIENCE

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")

# What the parent has done before: everything that begins threads, twice where it matters.
BEGINNING = """
import multiprocessing, os, warnings
import numpy as np
import moit

image = np.random.default_rng(0).random((300, 500, 4), np.float32)
f = moit.scenes.load("cloud", (64, 48))

def everything(folder):
    os.makedirs(folder, exist_ok=True)
    path = lambda name: os.path.join(folder, name)
    for name in ("a.exr", "a.png"):
        moit.write_image(path(name), image)
        moit.read_image(path(name))
    assert (moit.read_image(path("a.exr")) == image).all()
    moit.write_deep(path("d.exr"), f)
    assert len(moit.read_deep(path("d.exr"))) == len(f)
    assert sum(len(band) for band in moit.read_deep_bands(path("d.exr"))) == len(f)
    moit.composite_deep(path("d.exr"), path("c.exr"), "power4")
    moit.save(path("f.npz"), f)
    moit.composite(moit.load(path("f.npz")), "power4")
    return True

everything("parent")
"""

IN_A_CHILD = {
    "write_image exr": 'moit.write_image("c.exr", image)',
    "write_image png": 'moit.write_image("c.png", image)',
    "read_image exr": 'moit.read_image("parent/a.exr")',
    "read_image png": 'moit.read_image("parent/a.png")',
    "write_deep": 'moit.write_deep("c.exr", f)',
    "read_deep": 'moit.read_deep("parent/d.exr")',
    "read_deep_bands": 'list(moit.read_deep_bands("parent/d.exr"))',
    "composite_deep": 'moit.composite_deep("parent/d.exr", "c.png", "power4")',
    "composite": 'moit.composite(f, "power6")',
    "compare": 'moit.compare({"f": f}, ["power4"], repeat=1, out="out")',
    "jpeg": "from moit.reports.pictures import image_jpeg; image_jpeg(image, 100)",
    "everything": 'everything("child")',
}

FORK = """
def forked(work):
    child = os.fork()
    if not child:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
"""


def run(text: str, folder: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", BEGINNING + FORK + text], cwd=folder, env=environment,
        timeout=PATIENCE, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_child_of_fork_does_not_hang(tmp_path):
    texts = [
        f"def work():\n    {text}\n\n"
        f"print({call!r}, flush=True)\neverything('parent')\nforked(work)"
        for call, text in IN_A_CHILD.items()
    ]
    # the last that it says is what hangs or fails
    assert run("\n\n".join(texts), tmp_path).split("\n") == [*IN_A_CHILD, ""]


def test_a_grandchild_does_not_hang_nor_a_parent_afterwards(tmp_path):
    run(
        "def child():\n"
        "    forked(lambda: everything('grandchild'))\n"
        "    everything('child')\n\n"
        "for _ in range(3):\n"
        "    forked(child)\n"
        "    everything('parent')\n",
        tmp_path,
    )


def test_a_pool_of_children_does_not_hang(tmp_path):
    run(
        "with multiprocessing.get_context('fork').Pool(3) as pool:\n"
        "    assert all(pool.map(everything, [f'c{i}' for i in range(4)]))\n",
        tmp_path,
    )


def test_a_parent_keeps_its_threads_of_openimageio(tmp_path):
    run(
        "import OpenImageIO as oiio\n"
        "names = ('threads', 'exr_threads')\n"
        "oiio.attribute('threads', 3)\n"
        "before = [oiio.get_int_attribute(name) for name in names]\n"
        "forked(lambda: None)\n"
        "assert [oiio.get_int_attribute(name) for name in names] == before\n",
        tmp_path,
    )


def test_a_fork_while_another_thread_writes_is_as_good(tmp_path):
    run(
        "import threading\n"
        "ended = threading.Event()\n"
        "def busy():\n"
        "    while not ended.is_set():\n"
        "        moit.write_image('busy.exr', image)\n"
        "        list(moit.read_deep_bands('parent/d.exr'))\n"
        "thread = threading.Thread(target=busy)\n"
        "thread.start()\n"
        "try:\n"
        "    for _ in range(10):\n"
        "        forked(lambda: moit.write_image('c.exr', image))\n"
        "finally:\n"
        "    ended.set()\n"
        "    thread.join()\n",
        tmp_path,
    )


def test_one_file_alone_imports_openimageio():
    """The others ask it for the module, which is ready for a fork then."""
    moit = Path(__file__).parents[1] / "moit"
    found = [
        path.name
        for path in moit.rglob("*.py")
        if re.search(r"^\s*(import|from) OpenImageIO", path.read_text(), re.MULTILINE)
    ]
    assert found == ["image_library.py"]
