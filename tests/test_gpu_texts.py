"""The passes of techniques are GLSL to another compiler than Mesa's, too."""

import gpu
import numpy as np
import pytest
from readings.compilers import refused_by_glslang
from small import some_fragments

import moit
from moit.gpu import passes
from moit.gpu import texts as shaders

# The largest of each kind, and what is stored in 16 bits.
KINDS = {technique.kind: technique for technique in moit.techniques()}
WORDS = [moit.PowerMoments(4, bits=16), moit.TrigonometricMoments(2, bits=16)]
WORDS += [moit.WaveletTransparency(8, bits=16), moit.WeightedBlended(bits=16)]
ON_GPU = [t for t in [*KINDS.values(), *WORDS] if t.kind in passes.kinds()]


@pytest.mark.parametrize("technique", ON_GPU, ids=str)
def test_glslang_takes_every_pass(technique, monkeypatch):
    device = gpu.device()
    used = {}
    compiled = device.program

    def program(name, **defines):
        used[str((name, *sorted(defines.items())))] = shaders.source(name, **defines)
        return compiled(name, **defines)

    monkeypatch.setattr(device, "program", program)
    f = some_fragments(height=2, width=2, most=5, dtype=np.float32)
    moit.composite(f, technique, device=device, exact=True)
    moit.transmittance(f, technique, device=device, exact=True)
    if technique.has_curve:
        moit.transmittance(f, technique, [1.0], device=device, exact=True)
    assert refused_by_glslang(dict.fromkeys(used.values(), "comp")) == []


@pytest.mark.parametrize(("double", "outer"), [(0, ""), (1, "lf")])
def test_literals_are_double_where_all_is_and_in_what_is_included_so(
    double, outer, tmp_path, monkeypatch
):
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path))
    (tmp_path / "arrays").mkdir()
    (tmp_path / "arrays" / "within.glsl").write_text("c = 1e-3;\n")
    (tmp_path / "arrays" / "other.glsl").write_text('b = .25;\n#include "arrays/within.glsl"\n')
    own = tmp_path / "own.glsl"
    own.write_text(
        "#version 450\na = 0.5 + 2;\n"
        '#include "arrays/other.glsl" // in double\n#include "arrays/within.glsl"\n'
    )
    text = shaders.source(own, DOUBLE=double, K=0.75, SIZE="3u")
    found = [line for line in text.splitlines() if not line.startswith("#line")]
    assert found == [
        "#version 450",
        f"#define DOUBLE {double}",
        f"#define K 0.75{outer}",
        "#define SIZE 3u",
        f"a = 0.5{outer} + 2;",
        "b = .25lf;",
        "c = 1e-3lf;",
        f"c = 1e-3{outer};",
    ]
