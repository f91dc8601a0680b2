"""Writes and runs a notebook for each experiment: `python docs/experiment_notebooks.py [NAME ...]`.

They lie in notebooks/experiments, with the outputs of a run at small size. `--sources` leaves out
the run, `--size SIZE` sets another.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import nbformat

from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.description import SIZES, Experiment
from moit.system.files import write_text

FOLDER = Path(__file__).resolve().parent.parent / "notebooks"
SIZE = "MOIT_EXPERIMENT_SIZE"


def notebook(described: Experiment) -> nbformat.NotebookNode:
    """The cells for an experiment, without outputs."""
    name = described.name
    cells = [
        (
            "markdown",
            f"# {described.figure[0].upper()}{described.figure[1:]}: {described.title}\n\n"
            f"*{described.paper}*\n\n{described.about}\n\n"
            f"The same from the command line, with larger pictures: `moit experiment {name}`.",
        ),
        (
            "code",
            "import os\n\nimport moit\n\n"
            f'size = os.environ.get("{SIZE}", "small")\n'
            f'result = moit.experiment("{name}", size, progress=False)\n'
            'print(f"{result.seconds:.0f} s on {result.machine}")',
        ),
        ("markdown", "## What the paper says of it"),
        (
            "code",
            "for one in result.claims:\n"
            '    print(f"{one.verdict.upper()}: {one.claim.text} ({one.claim.where})")\n'
            '    print(f"    {one.short}")',
        ),
    ]
    for i, part in enumerate(described.parts):
        cells += [("markdown", f"## {part.title}"), ("code", f"result.sections[{i}]")]
    made = []
    for i, (kind, text) in enumerate(cells):
        new = nbformat.v4.new_markdown_cell if kind == "markdown" else nbformat.v4.new_code_cell
        made.append(new(text, id=f"{name}-{i:02}"))
    return nbformat.v4.new_notebook(
        cells=made,
        metadata={
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Write the experiments' notebooks and run them.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    parser.add_argument("--sources", action="store_true", help="write without running")
    parser.add_argument("--size", default="small", choices=SIZES, help="default: small")
    given = parser.parse_args()
    os.environ[SIZE] = given.size
    sys.path.insert(0, str(FOLDER))
    from run import run

    for name in given.names or EXPERIMENTS:
        path = FOLDER / "experiments" / f"{name}.ipynb"
        write_text(path, nbformat.writes(notebook(EXPERIMENTS[name])) + "\n")
        if not given.sources:
            write_text(path, nbformat.writes(run(path)) + "\n")
            print(f"{path.name}: {path.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    main()
