"""Texts that `moit.export` writes, run on this machine: a thread a fragment or a pixel.

GLSL runs on llvmpipe; HLSL there, too, by way of glslang, SPIR-V and SPIRV-Cross; WGSL on the CPU
by wgpu; Metal as C++, with a stand-in for its library (readings/metal); Slang as the GLSL that its
compiler makes. What a machine lacks is a skip that says so.
"""

from __future__ import annotations

import ctypes
import os
import re
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gpu import software_device

from moit.kit.including import LANGUAGES, Include
from readings import engine
from readings.compilers import from_slang, run_tool, tool

METAL = Path(__file__).parent / "metal"
GROUP = 64


@cache
def wgpu_device():
    try:
        import wgpu
    except ImportError:
        pytest.skip("needs wgpu (PyPI)")
    try:
        adapter = wgpu.gpu.request_adapter_sync(power_preference="low-power")
    except Exception as error:
        pytest.skip(f"needs a Vulkan driver (Debian's mesa-vulkan-drivers): {error}")
    features = {"float32-blendable"} & set(adapter.features)
    return adapter.request_device_sync(required_features=list(features))


class Spelling:
    """How a language writes what a test asks: vectors, structs, buffers."""

    def __init__(self, language: str) -> None:
        self.language = language
        kind = {"glsl": "vec", "wgsl": "vec"}.get(language, "float")
        self.vector = {1: "", **{n: f"{kind}{n}" + "f" * (language == "wgsl") for n in (2, 3, 4)}}

    def given(self, first: int, size: int, row: int) -> str:
        """`size` numbers of the row that belongs to this thread, which has `row` of them."""
        numbers = ", ".join(f"given[i * {row}u + {first + k}u]" for k in range(size))
        return f"{self.vector[size]}({numbers})" if size > 1 else numbers

    def variable(self, type: str, name: str) -> str:
        return f"var {name}: {type};" if self.language == "wgsl" else f"{type} {name};"

    def value(self, type: str, name: str, value: str) -> str:
        if self.language == "wgsl":
            return f"let {name} = {value};"
        return f"{LANGUAGES[self.language].words.get(type, type)} {name} = {value};"


_COMPUTE = {
    "glsl": """#version 450
#define MOIT_NO_FETCH
{defines}
{text}
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Given {{ float given[]; }};
layout(std430, binding = 1) buffer Made {{ float made[]; }};
void main() {{
    uint i = gl_GlobalInvocationID.x;
{body}
}}
""",
    "hlsl": """#define MOIT_NO_FETCH
{text}
StructuredBuffer<float> given : register(t0);
RWStructuredBuffer<float> made : register(u1);
[numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) {{
    uint i = thread.x;
{body}
}}
""",
    "slang": """#define MOIT_NO_FETCH
{text}
[[vk::binding(0)]] StructuredBuffer<float> given;
[[vk::binding(1)]] RWStructuredBuffer<float> made;
[shader("compute")] [numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) {{
    uint i = thread.x;
{body}
}}
""",
    "wgsl": """{text}
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> made: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) thread: vec3<u32>) {{
    let i = thread.x;
{body}
}}
""",
    "metal": """{text}
extern "C" void run(uint count, const float *given, float *made, void **arrays) {{
{memory}    for (uint i = 0; i < count; ++i) {{
{body}
    }}
}}
""",
}


def run(
    kit: Include,
    given: np.ndarray,
    body: list[str],
    made: int,
    memory: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """(n, made) of float32 (n, k): what `body` puts into `made`.

    memory : arrays of words by their names, which the text changes.
    """
    language = kit.language.name
    count = len(given)
    padded = np.zeros((-(-count // GROUP) * GROUP, given.shape[1]), np.float32)
    padded[:count] = given
    defines = ""
    if language == "glsl":
        defines = f"#define MOIT_NOT_FUSED {int(not engine.fma_is_fused())}"
    text = _COMPUTE[language].format(
        text=_with_constants(kit),
        defines=defines,
        memory=_memory(kit),
        body="\n".join(f"    {line}" for line in body),
    )
    bound = list(_numbers(kit).values()) if language == "wgsl" else []
    if not kit.memory:
        found = _RUNNERS[language](text, padded, made, *bound)
    else:
        memory = memory or {one.name: np.zeros(1, np.uint32) for one in kit.memory}
        arrays = [memory[one.name] for one in kit.memory]
        found = _RUNNERS[language](text, padded, made, *bound, memory=arrays)
    return np.asarray(found, np.float32).reshape(len(padded), made)[:count]


def _memory(kit: Include) -> str:
    """What in Metal makes the arrays that fragments share one."""
    if not kit.memory:
        return "    (void)arrays;\n"
    listed = ", ".join(f"(atomic_uint *)arrays[{i}]" for i in range(len(kit.memory)))
    return f"    moit_memory mem = {{{listed}}};\n"


def _numbers(kit: Include) -> dict[str, np.ndarray]:
    """What its uniform buffers hold, by name; (n, 4) each."""
    return {
        one.name: np.frombuffer(one.content, "<f4").reshape(one.rows.shape)
        for one in kit.buffers
        if one.file
    }


def _with_constants(kit: Include) -> str:
    """Its text, with what it reads from uniform buffers as constants of its language; in WGSL as
    buffers behind the two of `run`: drivers take 20 seconds for what arrays of constants say."""
    text = kit.text
    for i, one in enumerate(kit.memory, MEMORY):
        name = f"MOIT_BINDING_{one.name.upper()}"
        text = re.sub(rf"({name} =?) ?\d+", rf"\1 {i}", text)
    for place, (name, numbers) in enumerate(_numbers(kit).items(), 2):
        own, size = f"{name.lower()}_given", len(numbers)
        vector = Spelling(kit.language.name).vector[4]
        rows = ", ".join(f"{vector}({', '.join(map(str, row))})" for row in numbers)
        if kit.language.name == "wgsl":
            uniform = f"@group(MOIT_GROUP) @binding({name}_BINDING) var<uniform>"
            assert uniform in text
            text = text.replace(uniform, f"@group(0) @binding({place}) var<storage, read>")
        elif kit.language.name == "glsl":
            made = f"const vec4 {own}[{size}] = vec4[{size}]({rows});"
            text = f"{made}\n#define {name} {own}\n{text}"
        else:
            text = f"static const float4 {own}[{size}] = {{{rows}}};\n#define {name} {own}\n{text}"
    return text


MEMORY = 4  # binding of the first array that fragments share


def _glsl(text: str, given: np.ndarray, made: int, memory: Sequence[np.ndarray] = ()) -> np.ndarray:
    found = np.empty((len(given), made), np.float32)
    with software_device() as device:
        program = device.compile(compute=text)
        buffers = [device.buffer(given.nbytes, given), device.buffer(max(4, found.nbytes))]
        shared = [device.buffer(one.nbytes, one) for one in memory]
        groups = (len(given) // GROUP, 1, 1)
        bound = dict(enumerate(buffers)) | dict(enumerate(shared, MEMORY))
        device.dispatch(program, groups, buffers=bound)
        if made:
            buffers[1].read(found)
        for buffer, one in zip(shared, memory, strict=True):
            buffer.read(one)
    return found


def _hlsl(text: str, given: np.ndarray, made: int, **memory) -> np.ndarray:
    return _glsl(glsl_of_hlsl(text), given, made, **memory)


def glsl_of_hlsl(text: str) -> str:
    """A compute shader, by way of SPIR-V that is valid."""
    glslang, cross = tool("glslangValidator", "glslang-tools"), tool("spirv-cross", "spirv-cross")
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder, "text.comp.hlsl"), Path(folder, "text.spv")
        source.write_text(text)
        run_tool(
            *(glslang, "-D", "-V", "-S", "comp", "-e", "main", "--auto-map-bindings"),
            *(source, "-o", binary),
        )
        run_tool(tool("spirv-val", "spirv-tools"), binary)
        return run_tool(cross, "--version", "450", "--no-es", binary)


def _wgsl(
    text: str,
    given: np.ndarray,
    made: int,
    *bound: np.ndarray,
    memory: Sequence[np.ndarray] = (),
) -> np.ndarray:
    from wgpu.utils.compute import compute_with_buffers

    wgpu_device()
    shapes = {1: (max(1, len(given) * made), "f")}
    shared = dict(enumerate(memory, MEMORY))
    shapes |= {at: (len(one), "I") for at, one in shared.items()}
    read = {0: given, **dict(enumerate(bound, 2)), **shared}
    found = compute_with_buffers(read, shapes, text, n=len(given) // GROUP)
    for at, one in shared.items():
        one[:] = np.frombuffer(found[at], np.uint32)
    return np.frombuffer(found[1], np.float32)[: len(given) * made]


def _slang(text: str, given: np.ndarray, made: int, **memory) -> np.ndarray:
    return _glsl(from_slang(text, "compute", "glsl")[0], given, made, **memory)


def _metal(
    text: str, given: np.ndarray, made: int, memory: Sequence[np.ndarray] = ()
) -> np.ndarray:
    found = np.empty((len(given), made), np.float32)
    pointers = (ctypes.c_void_p * max(1, len(memory)))(*(one.ctypes.data for one in memory))
    with tempfile.TemporaryDirectory() as folder:
        library = compiled_metal(text, folder)
        call = ctypes.CDLL(library).run
        call(
            ctypes.c_uint(len(given)),
            given.ctypes.data_as(ctypes.c_void_p),
            found.ctypes.data_as(ctypes.c_void_p),
            pointers,
        )
    return found


def compiled_metal(text: str, folder: str, *how: str) -> str:
    clang = tool("clang++", "clang")
    source, library = os.path.join(folder, "text.cpp"), os.path.join(folder, "text.so")
    Path(source).write_text(text)
    run_tool(
        *(clang, "-std=c++17", "-O1", "-ffp-contract=off", "-Wall", "-Werror"),
        *("-Xclang", "-cl-single-precision-constant"),  # Metal has no double
        *("-Wno-unused-function", "-Wno-unused-variable", "-Wno-unknown-pragmas"),
        *(f"-I{METAL}", source, *(how or ("-shared", "-fPIC", "-o", library))),
    )
    return library


_RUNNERS = {"glsl": _glsl, "hlsl": _hlsl, "slang": _slang, "wgsl": _wgsl, "metal": _metal}
