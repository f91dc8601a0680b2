"""Notebooks run from top to bottom, and are committed as they came out of such a run."""

import json
import re
import sys
from importlib.util import find_spec
from pathlib import Path

import gpu
import pytest
from forked import Server

FOLDER = Path(__file__).parent.parent / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
MOST_BYTES = 600_000  # so that a code host shows it, and a clone stays small
AGAIN = "run it again: python notebooks/run.py"


def cells_of(path):
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def code_of(path):
    return [cell for cell in cells_of(path) if cell["cell_type"] == "code"]


def kinds(cell):
    """What a cell puts out, without how often: text may come in one piece or in several."""
    found = set()
    for output in cell["outputs"]:
        name = output.get("name", output["output_type"])
        found |= {(name, mime) for mime in output.get("data", [""])}
    return found


def texts(cell):
    """A cell's source and the text that it put out; pictures are left out."""
    found = ["".join(cell["source"])]
    for output in cell.get("outputs", []):
        shown = [output["text"]] if "text" in output else []
        shown += [value for mime, value in output.get("data", {}).items() if "text" in mime]
        found += ["".join(one) for one in shown]
    return [re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]*", "", one) for one in found]


def test_there_are_notebooks():
    assert NOTEBOOKS


# What a notebook's kernel and who asks it import first; figures go into the notebook, whatever
# backend the caller chose.
IMPORTS = """
import os
os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
import ipykernel.ipkernel, ipykernel.kernelapp, ipykernel.zmqshell
import matplotlib.pyplot, nbclient, nbformat
"""
# Forks a kernel, which waits to be told of its connection, and runs the notebook by it.
RUN = """
import os, runpy, signal, socket, sys
from ipykernel.kernelapp import launch_new_instance

os.environ.update({environment})
waiting = socket.create_server(("127.0.0.1", 0))
os.environ["MOIT_TESTS_KERNEL"] = str(waiting.getsockname()[1])
kernel = os.fork()
if not kernel:
    told, _ = waiting.accept()  # the other end waits for ours to be closed, by the kernel's end
    connection, folder = told.makefile().read().splitlines()
    os.chdir(folder)
    launch_new_instance(argv=["-f", connection])
    os._exit(0)
sys.argv = {command}
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    os.kill(kernel, signal.SIGKILL)
    os.waitpid(kernel, 0)
"""
# What Jupyter begins instead of a kernel.
TELL = """
import os, socket, sys
kernel = socket.create_connection(("127.0.0.1", int(os.environ["MOIT_TESTS_KERNEL"])))
kernel.sendall(f"{sys.argv[1]}\\n{os.getcwd()}".encode())
kernel.shutdown(socket.SHUT_WR)
kernel.recv(1)
"""


@pytest.fixture(scope="module")
def preloaded():
    """A Python that has imported what kernels import, two seconds of each notebook's, and forks."""
    missing = [name for name in ("nbclient", "ipykernel", "matplotlib") if not find_spec(name)]
    if missing:
        pytest.skip(f"running a notebook needs {', '.join(missing)}")
    environment = {
        "MOIT_NOTEBOOK_STEPS": "3",  # of those that fit something
        "MOIT_NOTEBOOK_REPEATS": "1",  # of what is timed
    }
    server = Server(environment, IMPORTS)
    yield server
    server.end()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_puts_out_what_is_committed_with_it(path, tmp_path, preloaded):
    if "moit.gpu" in path.read_text(encoding="utf-8"):
        pytest.importorskip("moderngl", reason="no moderngl to draw with")
        gpu.device()  # skips where there is none
    folders = {name: tmp_path / name for name in ("jupyter/kernels/python3", "temporary", "made")}
    for folder in folders.values():
        folder.mkdir(parents=True)
    words = [sys.executable, "-S", "-E", "-c", TELL, "{connection_file}"]
    spec = {"argv": words, "display_name": "Python 3", "language": "python"}
    (folders["jupyter/kernels/python3"] / "kernel.json").write_text(json.dumps(spec))
    environment = {
        "IPYTHONDIR": str(tmp_path / "ipython"),
        "JUPYTER_RUNTIME_DIR": str(tmp_path / "runtime"),
        "JUPYTER_PATH": str(tmp_path / "jupyter"),
    }
    command = [str(FOLDER / "run.py"), str(path), "--to", str(folders["made"])]
    text = RUN.format(environment=environment, command=command)
    # A process of its own: what Jupyter's packages warn of is no failure of ours, and its event
    # loop and kernel end with it.
    run = preloaded.run(text, folders["made"], folders["temporary"])
    assert run.returncode == 0, run.stderr[-4000:]
    for fresh, committed in zip(code_of(folders["made"] / path.name), code_of(path), strict=True):
        # On a new machine matplotlib may say on stderr that it looks for fonts.
        assert kinds(fresh) - {("stderr", "")} == kinds(committed), AGAIN


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_committed_with_the_outputs_of_one_run(path):
    code = code_of(path)
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1)), AGAIN
    assert any(mime == "image/png" for cell in code for _, mime in kinds(cell))
    for cell in code:
        for output in cell["outputs"]:
            assert output["output_type"] != "error"
            assert output.get("name") != "stderr", output["text"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_small_and_true_on_other_machines(path):
    assert path.stat().st_size < MOST_BYTES
    metadata = json.loads(path.read_text(encoding="utf-8"))["metadata"]
    assert metadata["kernelspec"]["name"] == "python3"
    assert metadata["language_info"] == {"name": "python"}  # not the version of whoever ran it
    for cell in cells_of(path):
        assert "execution" not in cell["metadata"]  # when it ran
        for text in texts(cell):
            assert not re.search(r"(?<![\w.:/])/[a-z]+/|[A-Z]:\\|0x[0-9a-f]{6}", text), text[:400]
