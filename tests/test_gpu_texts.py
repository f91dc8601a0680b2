"""The passes of techniques are GLSL to another compiler than Mesa's, too."""

import shutil
import subprocess

import gpu
import numpy as np
import pytest
from small import PATIENCE, some_fragments

import moit
from moit.gpu import passes
from moit.gpu import texts as shaders

# The largest of each kind, and what is stored in 16 bits.
KINDS = {technique.kind: technique for technique in moit.techniques()}
WORDS = [moit.PowerMoments(4, bits=16), moit.TrigonometricMoments(2, bits=16)]
WORDS += [moit.WaveletTransparency(8, bits=16), moit.WeightedBlended(bits=16)]
ON_GPU = [t for t in [*KINDS.values(), *WORDS] if t.kind in passes.kinds()]


@pytest.mark.parametrize("technique", ON_GPU, ids=str)
def test_glslang_takes_every_pass(technique, monkeypatch, tmp_path):
    if not shutil.which("glslangValidator"):
        pytest.skip("glslangValidator is not installed")
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
    assert used
    for text in used.values():
        path = tmp_path / "pass.comp"
        path.write_text(text)
        # Half a minute: what is precise in structs takes glslang forever at times.
        check = subprocess.run(
            ["glslangValidator", path], capture_output=True, text=True, timeout=PATIENCE
        )
        assert check.returncode == 0, shaders.explain(check.stdout, text)
