"""Sources read side by side on one screen: no line of C, and no comment of GLSL, is longer than 100
columns."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
C = sorted(path for path in (ROOT / "csrc").rglob("*") if path.suffix in (".c", ".h"))
GLSL = sorted((ROOT / "shaders").rglob("*.glsl"))


@pytest.mark.parametrize("path", [*C, *GLSL], ids=lambda path: path.relative_to(ROOT).as_posix())
def test_lines_end_at_column_100(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    if path.suffix == ".glsl":
        lines = [line if "//" in line else "" for line in lines]
    assert not [number for number, line in enumerate(lines, 1) if len(line) > 100]
