"""Notebooks run from top to bottom, and are committed as they came out of such a run."""

import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import gpu
import pytest
from small import ENVIRONMENT, PATIENCE

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


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_puts_out_what_is_committed_with_it(path, tmp_path):
    missing = [name for name in ("nbclient", "ipykernel", "matplotlib") if not find_spec(name)]
    if missing:
        pytest.skip(f"running a notebook needs {', '.join(missing)}")
    if "moit.gpu" in path.read_text(encoding="utf-8"):
        pytest.importorskip("moderngl", reason="no moderngl to draw with")
        gpu.device()  # skips where there is none
    environment = {
        **ENVIRONMENT,
        "MOIT_NOTEBOOK_STEPS": "3",  # of those that fit something
        "MOIT_NOTEBOOK_REPEATS": "1",  # of what is timed
        "IPYTHONDIR": str(tmp_path / "ipython"),
        "JUPYTER_RUNTIME_DIR": str(tmp_path / "jupyter"),
    }
    # A backend that the caller chose would keep figures out of the notebook.
    environment.pop("MPLBACKEND", None)
    # A process of its own: what Jupyter's packages warn of is no failure of ours, and its event
    # loop and kernel end with it.
    command = [sys.executable, str(FOLDER / "run.py"), str(path), "--to", str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=PATIENCE)
    assert run.returncode == 0, run.stderr[-4000:]
    for fresh, committed in zip(code_of(tmp_path / path.name), code_of(path), strict=True):
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
