"""Sources read on one screen side by side: no line of C is longer than 100 columns."""

from pathlib import Path

import pytest

CSRC = Path(__file__).parents[1] / "csrc"


@pytest.mark.parametrize("folder", ["core/stages", "core/metrics", "kernels", "gl", "python/gl"])
def test_lines_end_at_column_100(folder):
    paths = [path for path in sorted((CSRC / folder).rglob("*")) if path.suffix in (".c", ".h")]
    assert paths
    long = [
        f"{path.relative_to(CSRC)}:{number}"
        for path in paths
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > 100
    ]
    assert not long
