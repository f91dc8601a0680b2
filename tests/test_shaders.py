"""The GLSL sources: what `source` pastes together compiles, says where it fails, and is shipped."""

import re
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest
from gpu import device
from readings import glsl
from readings.compilers import refused_by_glslang
from small import PATIENCE, some_fragments

import moit
from moit import _gl
from moit.gpu import bindings, passes
from moit.gpu import texts as shaders

ROOT = Path(__file__).parents[1]
KERNELS = ROOT / "csrc" / "kernels"

# The passes that tests have for kernels, with every value of their defines.
DEFINES = {
    "surface": {"DOUBLE": [0, 1]},
    "elementary": {
        "DOUBLE": [0, 1],
        "FUNCTION": ["exponential", "logarithm", "absorbance", "unorm8_byte"],
    },
    "blend_weights": {"DOUBLE": [0, 1], "WEIGHT": list(range(6))},
    "power_bounds": {"DOUBLE": [1], "NODES": [2, 3, 4]},
    "upsampling": {"DOUBLE": [0, 1]},
}
VARIANTS = [
    pytest.param(name, dict(zip(values, chosen, strict=True)), id=f"{name}-{chosen}")
    for name, values in DEFINES.items()
    for chosen in product(*values.values())
]


def used_by(technique) -> tuple[str, dict]:
    """The shader of a technique, and its own defines."""
    f = some_fragments(height=1, width=1, most=2)
    constants = passes.Constants.of(technique.fields_for(f), False, f.depth_range)
    found = passes.passes_of(technique, constants)
    return f"techniques/{found.shader}", dict(found.defines)


# Every shader of techniques once, and passes of each: of a pixel, of a fragment, of an image.
ONE = list(dict([used_by(t) for t in moit.techniques() if passes.has_passes(t)]).items())
PASSES = [
    bindings.CAPTURE,
    bindings.FACTOR,
    bindings.TRANSMITTANCE,
    bindings.CURVE,
    bindings.COMPOSITE,
]


def text(name: str, defines: dict, double: int = 0, number: int = bindings.COMPOSITE) -> str:
    scalar = ("float", "double")[double]
    return shaders.source(name, **defines, SCALAR=scalar, DOUBLE=double, PASS=number)


@pytest.mark.parametrize(("name", "defines"), VARIANTS)
def test_mesa_compiles_every_variant(name, defines):
    glsl.program(name, **defines)


def test_glslang_takes_every_variant():
    each = [one.values for one in VARIANTS]
    texts = [shaders.source(glsl.PASSES / f"{name}.comp.glsl", **given) for name, given in each]
    assert refused_by_glslang(dict.fromkeys(texts, "comp")) == []


def test_of_many_texts_glslang_names_those_that_it_refuses():
    good, bad = "#version 450\nvoid main() {}\n", "#version 450\nvoid main() { int i = 0.5; }\n"
    (said,) = refused_by_glslang({good: "comp", bad: "frag", good + " ": "frag"})
    assert "cannot convert" in said


def test_the_variants_are_those_of_all_passes_of_tests():
    names = {path.name for path in glsl.PASSES.iterdir()}
    assert names == {f"{name}.comp.glsl" for name in DEFINES}


def test_every_shader_of_techniques_is_some_techniques():
    assert shaders.names() == sorted(name for name, _ in ONE)


def kernels_in(folder: Path) -> set[str]:
    """Those that its texts include."""
    texts = (path.read_text() for path in folder.rglob("*.glsl") if path.parent != KERNELS)
    return {found for text in texts for found in re.findall(r'#include "kernels/(.+?)"', text)}


def test_every_kernel_is_in_some_pass():
    """Of techniques or meshes, or in one that is."""
    texts = {path.name for path in KERNELS.iterdir() if path.suffix in (".h", ".glsl")}
    nested = {
        found
        for path in KERNELS.glob("*.h")
        for found in re.findall(r'#include "kernels/(.+?)"', path.read_text())
    }
    found = kernels_in(ROOT / "shaders") | nested
    assert found == texts - {"dialect.h"}
    assert "power_bounds.h" in kernels_in(glsl.PASSES)


def file_of(name: str) -> Path:
    return ROOT / ("csrc" if name.startswith("kernels/") else "shaders") / name


@pytest.mark.parametrize(("name", "defines"), ONE)
def test_lines_keep_the_numbers_of_their_files(name, defines):
    """Followed by #line directives alone, every line is that of the file it came from."""
    seen = set()
    file, number = name, 1
    for line in text(name, defines).splitlines():
        if directive := re.match(r"#line (\d+) // (.+)", line):
            file, number = directive[2], int(directive[1]) % 10_000
        elif (file, number) == (name, 2) and line.startswith("#define "):  # given, after #version
            continue
        else:
            theirs = file_of(file).read_text().splitlines()[number - 1]
            double = re.compile(r"(?<=[\d.])lf\b")
            assert double.sub("", line) == double.sub("", theirs)
            seen.add(file)
            number += 1
    assert len(seen) > 2


@pytest.mark.parametrize(
    ("file", "ours"),
    [
        ("kernels/power_moments.h", "    real rest = s / product;"),
        ("arrays/absorbance.glsl", "uniform number max_alpha;"),
        ("techniques/power_moments.glsl", "    ray.d = factors[FACTORS_SIZE * p + 3u * NODES];"),
    ],
)
def test_a_compile_error_names_our_file_and_line(file, ours):
    lines = enumerate(file_of(file).read_text().splitlines(), 1)
    [number] = [n for n, line in lines if ours in line]
    right = text(*used_by(moit.technique("power6")))
    wrong = right.replace(ours, f"{ours[:-1]} + undeclared;", 1)
    with pytest.raises(moit.GpuError, match=rf"{file}:{number}\(.*\n?.*(undeclared|\+)"):
        device().compile(compute=wrong)


def test_logs_of_other_compilers_are_explained_too():
    path = glsl.PASSES / "elementary.comp.glsl"
    pasted = shaders.source(path, DOUBLE=0, FUNCTION="absorbance")
    logs = {
        "0(31)": "elementary.comp.glsl(31)",
        "0(30031) : error C1503: undefined variable": "kernels/elementary.h(31) : error C1503",
        "ERROR: 0:30031: 'x' : undeclared": "ERROR: kernels/elementary.h:31: 'x'",
        "0:990001(1): error": "0:990001(1): error",  # no file of ours
    }
    for log, expected in logs.items():
        assert expected in shaders.explain(log, pasted)


def without_comments(pasted: str) -> str:
    return re.sub(r"//.*", "", pasted)


def test_every_literal_of_a_double_pass_is_a_double():
    number = re.compile(r"\b\d+(?:\.\d*)?(?:[eE][-+]?\d+)?\w*|\.\d+\w*")
    for (name, defines), one in product(ONE, PASSES):
        for found in number.findall(without_comments(text(name, defines, 1, one))):
            assert found.endswith("lf") or re.fullmatch(r"\d+u?|0x[0-9a-f]+u?", found), found
    for name in ("elementary", "blend_weights", "surface"):
        of_float = shaders.source(glsl.PASSES / f"{name}.comp.glsl", DOUBLE=0)
        assert not re.search(r"[\d.]lf\b", of_float)


def test_a_pass_without_its_precision_does_not_compile():
    wrong = shaders.source(glsl.PASSES / "elementary.comp.glsl", FUNCTION="absorbance")
    with pytest.raises(moit.GpuError, match="DOUBLE must be 0 or 1"):
        device().compile(compute=wrong)


@pytest.mark.parametrize("name", ["techniques/no_such.glsl", "techniques", "", "../pyproject"])
def test_an_unknown_name_is_refused_with_those_there_are(name):
    with pytest.raises(ValueError, match=r"techniques/power_moments\.glsl"):
        shaders.source(name)


def test_a_file_that_includes_itself_or_nothing_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path))
    (tmp_path / "techniques").mkdir()
    (tmp_path / "a.glsl").write_text('#include "b.glsl"\n')
    (tmp_path / "b.glsl").write_text('#include "a.glsl"\n')
    (tmp_path / "c.glsl").write_text('#include "lost.glsl"\n')
    with pytest.raises(ValueError, match=r"a\.glsl includes itself, by way of b\.glsl"):
        shaders.source("a.glsl")
    with pytest.raises(ValueError, match=r"c\.glsl includes lost\.glsl"):
        shaders.source("c.glsl")


def texts_of_the_tree() -> dict[str, str]:
    paths = {f"kernels/{path.name}": path for path in KERNELS.iterdir()}
    folder = ROOT / "shaders"
    paths |= {path.relative_to(folder).as_posix(): path for path in folder.rglob("*.glsl")}
    return {
        name: path.read_text() for name, path in paths.items() if path.suffix in (".glsl", ".h")
    }


def test_the_build_holds_the_texts_of_the_tree():
    """Where this fails alone, the extension is older than the shaders: build it again."""
    assert {name: _gl.shader_text(name) for name in _gl.shader_names()} == texts_of_the_tree()


def test_a_folder_of_shaders_takes_the_place_of_the_build(tmp_path, monkeypatch):
    built = text(*ONE[0])
    monkeypatch.setenv("MOIT_SHADER_DIR", str(ROOT / "shaders"))
    assert shaders._texts() == sorted(texts_of_the_tree())
    assert text(*ONE[0]) == built
    shutil.copytree(ROOT / "shaders", tmp_path / "shaders")
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path / "shaders"))
    with open(tmp_path / "shaders" / ONE[0][0], "a") as file:
        file.write("// changed\n")
    assert text(*ONE[0]) == built + "// changed\n"
    with pytest.raises(ValueError, match="the techniques there are in"):
        shaders.source("../secret.glsl")


def test_texts_that_are_worked_on_are_compiled_anew(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "shaders", tmp_path / "shaders")
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path / "shaders"))
    name, defines = "techniques/sorted.glsl", {"SCALAR": "float", "DOUBLE": 0, "PASS": 0}
    with device() as d:
        first = d.program(name, **defines)
        assert d.program(name, **defines) is first
        with open(tmp_path / "shaders" / name, "a") as file:
            file.write("wrong\n")
        with pytest.raises(moit.GpuError, match=r"sorted\.glsl:\d+"):
            d.program(name, **defines)


def test_a_source_distribution_and_the_package_need_no_links(tmp_path):
    """What setuptools puts into a wheel beside the extension has no shader a second time."""
    build = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", tmp_path]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=PATIENCE)
    assert (tmp_path / "moit" / "gpu" / "texts.py").is_file()
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".glsl", ".h")]
