"""What is told of a release: the changelog's points, each on one line."""

import importlib.util
from pathlib import Path

import pytest

import moit

ROOT = Path(__file__).parents[1]

CHANGELOG = """# Changelog

## 0.3.0 (unreleased)

## 0.2.0 (2027-01-02)

- One point that
  goes on - with a dash.
- Another:

## 0.1.0

- The first.
"""


@pytest.fixture(scope="module")
def release_notes():
    spec = importlib.util.spec_from_file_location("release_notes", ROOT / "docs/release_notes.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_points_are_of_one_version_and_on_one_line(release_notes):
    lines = release_notes.notes(CHANGELOG, "0.2.0").splitlines()
    assert lines[:4] == [
        "# moit 0.2.0",
        "",
        "- One point that goes on - with a dash.",
        "- Another:",
    ]
    assert "- The first." not in lines
    assert "moit[all]==0.2.0" in "\n".join(lines)
    for version, said in ((None, "nothing of 0.3.0"), ("0.4.0", "has 0.3.0, 0.2.0, 0.1.0, not")):
        with pytest.raises(ValueError, match=said):
            release_notes.notes(CHANGELOG, version)


def test_this_version_has_notes(release_notes):
    text = release_notes.notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    assert text.startswith(f"# moit {moit.__version__}\n")
    assert moit.cite().splitlines()[0] in text
