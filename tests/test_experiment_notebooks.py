"""Notebooks of experiments are what a command writes, and show what an experiment found."""

import contextlib
import importlib.util
import io
import json
import re
from pathlib import Path

import pytest

from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.claims import Numbers, Of

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "notebooks" / "experiments"
MOST_BYTES = 200_000  # those of four scenes show twenty pictures
AGAIN = "run it again: python docs/experiment_notebooks.py"


def committed(name):
    return json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))


def sources(cells):
    return [(cell["cell_type"], "".join(cell["source"])) for cell in cells]


def code_of(notebook):
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def published(html):
    """What a section's table says that papers print: rows by column, with what they are of."""
    heads = re.findall(r"<th[^>]*>(.*?)</th>", html)
    kept = [i for i, head in enumerate(heads) if head in ("scene", "technique") or "paper" in head]
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", html)]
    return [[heads[i] for i in kept]] + [[row[i] for i in kept] for row in rows if row]


class AllTheSame(Numbers):
    """Every number that is asked for is 7."""

    def get(self, of):
        return 7.0 if isinstance(of, Of) else float(of)


def pattern(words):
    """What a check's words look like, whatever was measured."""
    number = r"-?[\d.]+(?:e-?\d+)?"
    return re.escape(words.replace(" >= ", " < ")).replace(re.escape("7.000"), number)


def kinds(cell):
    found = set()
    for output in cell["outputs"]:
        name = output.get("name", output["output_type"])
        found |= {(name, mime) for mime in output.get("data", [""])}
    return found


def test_every_experiment_has_a_notebook_and_no_other_is_there():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(EXPERIMENTS)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_notebook_is_what_the_command_writes_of_the_description(name):
    pytest.importorskip("nbformat", reason="notebooks are written with nbformat")
    path = ROOT / "docs" / "experiment_notebooks.py"
    spec = importlib.util.spec_from_file_location("experiment_notebooks", path)
    written = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(written)
    fresh = written.notebook(EXPERIMENTS[name])
    assert sources(fresh["cells"]) == sources(committed(name)["cells"]), AGAIN


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_notebook_runs_and_shows_as_much_as_its_outputs(name, monkeypatch):
    # Here and not in a kernel: that would take longer than all of the experiments at tiny size.
    monkeypatch.setenv("MOIT_EXPERIMENT_SIZE", "tiny")
    names = {}
    for cell in code_of(committed(name)):
        lines = "".join(cell["source"])
        out = io.StringIO()
        if re.fullmatch(r"result\.sections\[\d+\]", lines):
            shown = eval(lines, names)._repr_html_()
            assert kinds(cell) == {
                ("execute_result", "text/html"),
                ("execute_result", "text/plain"),
            }
            committed_html = "".join(cell["outputs"][0]["data"]["text/html"])
            for tag in ("<table", "<img", "<svg"):
                assert shown.count(tag) == committed_html.count(tag), AGAIN
            assert published(shown) == published(committed_html), AGAIN
        else:
            with contextlib.redirect_stdout(out):
                exec(lines, names)
            assert out.getvalue() and kinds(cell) == {("stdout", "")}


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_notebook_judges_claims_by_the_checks_of_the_description(name):
    outputs = ["".join(o.get("text", "")) for c in code_of(committed(name)) for o in c["outputs"]]
    (said,) = (text for text in outputs if re.match(r"[A-Z ]+: ", text))
    lines = said.splitlines()
    claims = EXPERIMENTS[name].claims
    assert len(lines) == 2 * len(claims)
    for claim, about, checks in zip(claims, lines[::2], lines[1::2], strict=True):
        assert about.partition(": ")[2] == f"{claim.text} ({claim.where})"
        needed = [pattern(check.words) for check in claim.judged(AllTheSame([])).checks]
        found = checks.strip().split("; ")
        more = re.fullmatch(r"and (\d+) more", found[-1])
        found = found[:-1] if more else found
        assert len(needed) == len(found) + (int(more[1]) if more else 0), AGAIN
        for words in found:
            words = words.removeprefix("not so: ").replace(" >= ", " < ")
            one = next((one for one in needed if re.fullmatch(one, words)), None)
            assert one is not None, (words, needed, AGAIN)
            needed.remove(one)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_notebook_is_committed_with_the_outputs_of_one_run_and_is_small(name):
    notebook = committed(name)
    code = code_of(notebook)
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1)), AGAIN
    assert (FOLDER / f"{name}.ipynb").stat().st_size < MOST_BYTES
    assert not any(output["output_type"] == "error" for cell in code for output in cell["outputs"])
    texts = [re.sub(r"data:image/\w+;base64,[A-Za-z0-9+/=]*", "", json.dumps(code))]
    texts += [source for _, source in sources(notebook["cells"])]
    for text in texts:
        assert not re.search(r"(?<![\w.:/<])/[a-z]+/|[A-Z]:\\\\|0x[0-9a-f]{6}", text)
