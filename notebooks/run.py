"""Runs notebooks and keeps what they put out: `python notebooks/run.py [NOTEBOOK ...]`.

Without names all that lie beside this file. Each is run from top to bottom by the Python that runs
this and written back, or with `--to FOLDER` written there; cells see an empty working directory.
What depends on when and by whom it was run, but for what cells print, is left out.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

from moit.system.files import write_text

# More than any needs, however much else the machine has to do.
SECONDS_A_CELL = 600


def run(path: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of a fresh run; raises CellExecutionError where a cell does."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as empty:
        NotebookClient(
            notebook,
            kernel_name="python3",
            timeout=SECONDS_A_CELL,
            startup_timeout=SECONDS_A_CELL,
            record_timing=False,
            coalesce_streams=True,
            resources={"metadata": {"path": empty}},
        ).execute()
    notebook.metadata["kernelspec"] = {
        "display_name": "Python 3",
        "language": "python",
        "name": "python3",
    }
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def main() -> None:
    parser = argparse.ArgumentParser(description="Run notebooks and keep what they put out.")
    parser.add_argument("notebooks", nargs="*", type=Path, metavar="NOTEBOOK")
    parser.add_argument("--to", type=Path, metavar="FOLDER", help="write there, not in place")
    given = parser.parse_args()
    for path in given.notebooks or sorted(Path(__file__).parent.glob("*.ipynb")):
        write_text((given.to or path.parent) / path.name, nbformat.writes(run(path)) + "\n")


if __name__ == "__main__":
    main()
