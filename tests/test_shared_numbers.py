"""Numbers that Python, C and GLSL share are written once, and are the same in all three."""

import re
from pathlib import Path

import numpy as np
import pytest
from gpu import software_device

from moit import _core
from moit.catalog.options import names_of
from moit.gpu import bindings

ROOT = Path(__file__).parents[1]
TEXTS = [ROOT / "csrc" / "kernels" / "options.h", ROOT / "shaders" / "arrays" / "bindings.glsl"]
# Texts for engines and of papers stand alone, with names of their own.
ALONE = ("engine", "published")
SHADERS = [
    path
    for path in (ROOT / "shaders").rglob("*.glsl")
    if path not in TEXTS and path.parent.name not in ALONE
]

# What a text would be that has a number of its own for what has a name.
BARE = {
    "binding": (SHADERS, r"binding\s*=\s*\d"),
    "pass": (SHADERS, r"\b(?:PASS|ORDERED|FORM|WEIGHT|STORAGE)\s*[=!<>]=?\s*\d"),
    "group": (SHADERS, r"local_size_x\s*=\s*\d"),
    "own": (SHADERS, rf"#define ({'|'.join(_core.numbers())})\s+[(\d-]"),
    "stage": (
        sorted((ROOT / "moit" / "gpu").glob("*.py")),
        r"\bStage\(\d|textures=\{\d|images=\{\d",
    ),
}


def written() -> dict[str, int]:
    """What the texts say, read by neither C nor GLSL."""
    found: dict[str, int] = {}
    for path in TEXTS:
        for line in path.read_text().splitlines():
            if define := re.match(r"#define (\w+) ([^/]+)", line):
                assert define[1] not in found
                found[define[1]] = eval(define[2], {}, found)
    return found


def test_python_has_what_c_makes_of_the_texts():
    assert _core.numbers() == written()
    assert bindings.CAPTURE == written()["CAPTURE"]
    with pytest.raises(ImportError, match="NOTHING"):
        from moit.gpu.bindings import NOTHING  # noqa: F401


def test_glsl_makes_the_same_of_them(tmp_path):
    names = list(written())
    path = tmp_path / "numbers.comp.glsl"
    path.write_text(
        '#version 450\n#include "kernels/options.h"\n#include "arrays/bindings.glsl"\n'
        "layout(local_size_x = 1) in;\n"
        "layout(std430, binding = ANSWERS) writeonly buffer Found { int found[]; };\n"
        + "void main() {\n"
        + "".join(f"found[{i}] = {name};\n" for i, name in enumerate(names))
        + "}\n"
    )
    found = np.empty(len(names), np.int32)
    with software_device() as device:
        buffer = device.buffer(found.nbytes)
        device.dispatch(device.program(path), (1, 1, 1), buffers={bindings.ANSWERS: buffer})
        buffer.read(found)
    assert dict(zip(names, found.tolist(), strict=True)) == written()


@pytest.mark.parametrize("option", ["WEIGHT", "WARP", "STORAGE"])
def test_values_of_options_stand_at_their_numbers(option):
    numbers = [written()[f"{option}_{name.upper()}"] for name in names_of(option)]
    assert len(numbers) > 2 and numbers == list(range(len(numbers)))


@pytest.mark.parametrize("kind", BARE)
def test_no_other_text_has_numbers_of_its_own(kind):
    paths, bare = BARE[kind]
    assert len(paths) > 9
    found = [f"{path.name}: {m[0]}" for path in paths for m in re.finditer(bare, path.read_text())]
    assert not found
