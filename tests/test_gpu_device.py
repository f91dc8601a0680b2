"""A device runs what it is given: buffers go in and out, uniforms arrive by their names."""

from pathlib import Path

import numpy as np
import pytest
from gpu import device

COPY = """#version 450
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer From { uint from[]; };
layout(std430, binding = 3) writeonly buffer Into { uint into[]; };
uniform uint count;
uniform uint factor;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) into[i] = from[i] * factor;
}
"""


def test_a_dispatch_reads_and_writes_buffers():
    with device() as d:
        numbers = np.arange(1000, dtype=np.uint32)
        source = d.context.buffer(numbers.nbytes, numbers)
        target = d.context.buffer(numbers.nbytes)
        program = d.compile(compute=COPY)
        d.context.dispatch(
            program,
            (16, 1, 1),
            buffers={0: source, 3: target},
            uniforms={"count": len(numbers), "factor": np.uint32(3), "unknown": 1},
        )
        got = np.empty_like(numbers)
        target.read(got)
    np.testing.assert_array_equal(got, 3 * numbers)


UNIFORMS = {
    "float": (0.1, np.float32),
    "double": (0.1, np.float64),
    "int": (-7, np.int32),
    "uint": (2**32 - 1, np.uint32),
    "vec3": ([0.1, 0.2, 0.3], np.float32),
    "dvec2": ([0.1, 0.2], np.float64),
    "ivec4": ([1, -2, 3, -4], np.int32),
    "uvec2": ([1, 2**31], np.uint32),
}


@pytest.mark.parametrize("kind", UNIFORMS)
def test_uniforms_arrive_bit_by_bit(kind):
    value, dtype = UNIFORMS[kind]
    text = f"""#version 450
    layout(local_size_x = 1) in;
    layout(std430, binding = 0) writeonly buffer Got {{ {kind} got; }};
    uniform {kind} given;
    void main() {{ got = given; }}
    """
    for given in (value, np.array(value, dtype), np.array(value, dtype).tolist()):
        with device() as d:
            expected = np.atleast_1d(np.array(value, dtype))
            target = d.context.buffer(expected.nbytes)
            program = d.compile(compute=text)
            d.context.dispatch(program, (1, 1, 1), buffers={0: target}, uniforms={"given": given})
            got = np.empty_like(expected)
            target.read(got)
        np.testing.assert_array_equal(got, expected)


def test_matrices_are_given_by_rows():
    text = """#version 450
    layout(local_size_x = 1) in;
    layout(std430, binding = 0) writeonly buffer Got { vec3 got; };
    uniform mat3 given;
    void main() { got = given * vec3(1, 10, 100); }
    """
    matrix = np.arange(9, dtype=np.float64).reshape(3, 3)
    with device() as d:
        target = d.context.buffer(12)
        program = d.compile(compute=text)
        d.context.dispatch(program, (1, 1, 1), buffers={0: target}, uniforms={"given": matrix})
        got = np.empty(3, np.float32)
        target.read(got)
    np.testing.assert_array_equal(got, matrix @ [1, 10, 100])


def test_a_pass_of_ones_own_runs_with_the_kernels_and_is_compiled_once():
    path = Path(__file__).parent / "readings" / "passes" / "elementary.comp.glsl"
    x = np.linspace(0, 0.99, 500, dtype=np.float32)
    with device() as d:
        program = d.program(path, DOUBLE=0, FUNCTION="absorbance")
        assert program is d.program(path, FUNCTION="absorbance", DOUBLE=0)
        source, target = d.context.buffer(x.nbytes, x), d.context.buffer(x.nbytes)
        d.context.dispatch(
            program, (8, 1, 1), buffers={0: source, 1: target}, uniforms={"count": x.size}
        )
        got = np.empty_like(x)
        target.read(got)
    np.testing.assert_allclose(got, -np.log1p(-x.astype(np.float64)), rtol=1e-6)
