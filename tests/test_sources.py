"""Rules of sources: C ends at column 100, and tests bring their data with them."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
CSRC = TESTS.parent / "csrc"


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


def test_tests_read_nothing_outside_the_repository():
    outside = []
    for path in sorted(TESTS.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        above = [int(number) + 1 for number in re.findall(r"parents\[(\d+)\]", text)]
        above += [chain.count(".parent") for chain in re.findall(r"(?:\.parent\b)+", text)]
        root = len(path.relative_to(TESTS).parts) + 1
        if max(above, default=0) > root or re.search(r"[\"'/]shared[\"'/]", text):
            outside.append(str(path.relative_to(TESTS)))
    assert not outside
