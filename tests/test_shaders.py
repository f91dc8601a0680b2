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

import moit
from moit import _gl, shaders

ROOT = Path(__file__).parents[1]
KERNELS = ROOT / "csrc" / "kernels"

# Every pass with every value of its defines.
DEFINES = {
    "surface": {"DOUBLE": [0, 1]},
    "elementary": {
        "DOUBLE": [0, 1],
        "FUNCTION": ["exponential", "logarithm", "absorbance"],
    },
    "blend_weights": {"DOUBLE": [0, 1], "WEIGHT": list(range(6))},
    "deep_shadow": {"DOUBLE": [0, 1]},
    "deep_shadow_map": {"DOUBLE": [0, 1]},
    "haar_coefficients": {"DOUBLE": [0, 1], "LEVELS": [5], "DENSITY": [0, 1], "BITS": [16, 32]},
    "haar_cells": {"DOUBLE": [0, 1], "LEVELS": [5], "DENSITY": [0, 1]},
    "haar_transmittance": {"DOUBLE": [0, 1], "LEVELS": [5], "DENSITY": [0, 1]},
    "fourier_opacity": {"DOUBLE": [0, 1], "HARMONICS": [3, 7], "PASS": [0, 1]},
    "transmittance_function": {"DOUBLE": [0, 1], "COSINES": [8], "HALF": [0, 1], "PASS": [0, 1]},
    "stochastic": {"DOUBLE": [0, 1], "SAMPLES": [1, 8, 40], "STRATIFIED": [0, 1]},
    "quantised_moments": {"DOUBLE": [1], "SYMMETRIC": [0, 1]},
    "nonlinear_moments": {"DOUBLE": [1], "NODES": [2], "STORED": ["float", "double"]},
    "scaled_absorbance": {"DOUBLE": [0, 1]},
    "two_moments": {"DOUBLE": [0, 1]},
    "mlab": {"DOUBLE": [0, 1], "LAYERS": [1, 2, 6], "QUANTIZED": [0, 1]},
    "steps": {"DOUBLE": [0, 1], "STEPS": [1, 4]},
    "adaptive": {"DOUBLE": [0, 1], "NODES": [2, 4], "QUANTIZED": [0, 1]},
    "power_rules": {"DOUBLE": [1], "NODES": [2, 3, 4], "STORED": ["float", "double"]},
    "power_transmittance": {"DOUBLE": [0, 1], "NODES": [2, 3, 4]},
    "trigonometric_rules": {"DOUBLE": [1], "NODES": [2, 3, 4], "STORED": ["float", "double"]},
    "trigonometric_transmittance": {"DOUBLE": [0, 1], "NODES": [2, 3, 4]},
    "power_bounds": {"DOUBLE": [1], "NODES": [2, 3, 4]},
    "moment_words": {"DOUBLE": [0, 1], "NODES": [2, 3, 4], "CIRCLE": [0, 1], "B0_IS_HALF": [0, 1]},
    "words_decoded": {"DOUBLE": [1], "NODES": [2, 3, 4], "CIRCLE": [0, 1]},
    "weighted_targets": {"DOUBLE": [0, 1]},
}
VARIANTS = [
    pytest.param(name, dict(zip(values, chosen, strict=True)), id=f"{name}-{chosen}")
    for name, values in DEFINES.items()
    for chosen in product(*values.values())
]
ONE = [(name, {key: value[0] for key, value in values.items()}) for name, values in DEFINES.items()]


def text(name: str, defines: dict) -> str:
    return shaders.source(f"passes/{name}.comp.glsl", **defines)


@pytest.mark.parametrize(("name", "defines"), VARIANTS)
def test_mesa_compiles_every_variant(name, defines):
    glsl.shader(name, **defines)


@pytest.mark.parametrize(("name", "defines"), VARIANTS)
def test_glslang_takes_every_variant(name, defines, tmp_path):
    if not shutil.which("glslangValidator"):
        pytest.skip("glslangValidator is not installed")
    path = tmp_path / "pass.comp"
    path.write_text(text(name, defines))
    check = subprocess.run(["glslangValidator", path], capture_output=True, text=True)
    assert check.returncode == 0, shaders.explain(check.stdout, path.read_text())


def test_the_variants_are_those_of_all_passes():
    passes = [name for name in shaders.names() if name.startswith("passes/")]
    assert passes == sorted(f"passes/{name}.comp.glsl" for name in DEFINES)


def test_every_kernel_is_in_some_pass():
    folder = KERNELS.parents[1] / "shaders"
    pasted = {
        found
        for name in shaders.names()
        for found in re.findall(r'#include "kernels/(.+)"', (folder / name).read_text())
    }
    texts = {path.name for path in KERNELS.iterdir() if path.suffix in (".h", ".glsl")}
    assert pasted == texts - {"dialect.h"}


@pytest.mark.parametrize(("name", "defines"), ONE)
def test_lines_keep_the_numbers_of_their_files(name, defines):
    """Followed by #line directives alone, every line is that of the file it came from."""
    seen = set()
    file, number = f"passes/{name}.comp.glsl", 1
    for line in text(name, {**defines, "DOUBLE": 0}).splitlines():
        if directive := re.match(r"#line (\d+) // (.+)", line):
            file, number = directive[2], int(directive[1]) % 10_000
        elif line.startswith("#define") and line.split()[1] in defines:
            continue
        else:
            theirs = (
                ROOT / "csrc" / file if file.startswith("kernels/") else ROOT / "shaders" / file
            )
            assert line == theirs.read_text().splitlines()[number - 1]
            seen.add(file)
            number += 1
    assert len(seen) > 2


@pytest.mark.parametrize(
    ("file", "ours"),
    [
        ("kernels/power_moments.h", "    real ps = p * s;"),
        ("rules_buffer.glsl", "    r.d = rules[at + 3u * NODES];"),
        ("passes/power_transmittance.comp.glsl", "    if (i >= count) return;"),
    ],
)
def test_a_compile_error_names_our_file_and_line(file, ours):
    folder = ROOT / "csrc" if file.startswith("kernels/") else ROOT / "shaders"
    [number] = [
        n for n, line in enumerate((folder / file).read_text().splitlines(), 1) if ours in line
    ]
    right = text("power_transmittance", {"DOUBLE": 0, "NODES": 3})
    wrong = right.replace(ours, f"{ours[:-1]} + undeclared;", 1)
    with pytest.raises(Exception, match="undeclared") as caught:
        glsl.context().compute_shader(wrong)
    assert f"{file}:{number}(" in shaders.explain(str(caught.value), wrong)


def test_logs_of_other_compilers_are_explained_too():
    pasted = text("elementary", {"DOUBLE": 0, "FUNCTION": "absorbance"})
    logs = {
        "0(20031) : error C1503: undefined variable": "kernels/elementary.h(31) : error C1503",
        "ERROR: 0:20031: 'x' : undeclared": "ERROR: kernels/elementary.h:31: 'x'",
        "0:990001(1): error": "0:990001(1): error",  # no file of ours
    }
    for log, expected in logs.items():
        assert expected in shaders.explain(log, pasted)


def without_comments(pasted: str) -> str:
    return re.sub(r"//.*", "", pasted)


def test_every_literal_of_a_double_pass_is_a_double():
    number = re.compile(r"\b\d+(?:\.\d*)?(?:[eE][-+]?\d+)?\w*|\.\d+\w*")
    for name, defines in ONE:
        for one in number.findall(without_comments(text(name, {**defines, "DOUBLE": 1}))):
            assert one.endswith("lf") or re.fullmatch(r"\d+u?|0x[0-9a-f]+u?", one), one
        assert not re.search(r"\dlf", text(name, {**defines, "DOUBLE": 0}))


def test_a_pass_without_its_precision_does_not_compile():
    wrong = text("elementary", {"FUNCTION": "absorbance"})
    with pytest.raises(Exception, match="DOUBLE must be 0 or 1"):
        glsl.context().compute_shader(wrong)


@pytest.mark.parametrize("name", ["passes/no_such.comp.glsl", "passes", "", "../pyproject"])
def test_an_unknown_name_is_refused_with_those_there_are(name):
    with pytest.raises(ValueError, match=r"passes/power_rules\.comp\.glsl"):
        shaders.source(name)


def test_a_file_that_includes_itself_or_nothing_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path))
    (tmp_path / "passes").mkdir()
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
    with open(tmp_path / "shaders" / "passes" / f"{ONE[0][0]}.comp.glsl", "a") as file:
        file.write("// changed\n")
    assert text(*ONE[0]) == built + "// changed\n"
    with pytest.raises(ValueError, match="the passes there are in"):
        shaders.source("../secret.glsl")


def test_texts_that_are_worked_on_are_compiled_anew(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "shaders", tmp_path / "shaders")
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path / "shaders"))
    name, defines = "passes/scaled_absorbance.comp.glsl", {"DOUBLE": 0}
    with device() as d:
        first = d.program(name, **defines)
        assert d.program(name, **defines) is first
        with open(tmp_path / "shaders" / name, "a") as file:
            file.write("wrong\n")
        with pytest.raises(moit.GpuError, match=r"scaled_absorbance\.comp\.glsl:\d+"):
            d.program(name, **defines)


def test_a_source_distribution_and_the_package_need_no_links(tmp_path):
    """What setuptools puts into a wheel beside the extension has no shader a second time."""
    build = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", tmp_path]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=120)
    assert (tmp_path / "moit" / "shaders.py").is_file()
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".glsl", ".h")]
