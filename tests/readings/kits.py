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

from moit.kit.including import LANGUAGES, Include, include_of
from moit.kit.recipes import recipe_of
from moit.kit.tokens import Member, items_of, members_of
from readings import engine
from readings.compilers import from_slang, run_tool, tool

METAL = Path(__file__).parent / "metal"
SIZES = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}
GROUP = 64


@cache
def include(technique, language: str, depth_range=(0.1, 1000.0)) -> Include:
    return include_of(technique, recipe_of(technique, depth_range), LANGUAGES[language])


@cache
def members(technique, struct: str) -> list[Member]:
    """Of a struct of its text, as in GLSL."""
    text = include(technique, "glsl").text
    body = "\n".join(
        line for line in text.splitlines() if not line.startswith(("#", "layout", "//"))
    )
    start = body.index(f"struct moit_{struct} ")
    found = items_of(body[start : body.index("};", start) + 2] + "\n", "")
    return members_of(found[0])


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


def _stored(technique, struct: str, spelled: str) -> tuple[list[str], int]:
    """What puts the members of a struct into a thread's row, and how many numbers that are."""
    listed = members(technique, struct)
    total = sum(SIZES[one.type] for one in listed)
    lines, at = [], 0
    for one in listed:
        for k in range(SIZES[one.type]):
            place = f"{spelled}.{one.name}" + (f"[{k}]" if SIZES[one.type] > 1 else "")
            lines.append(f"made[i * {total}u + {at}u] = {place};")
            at += 1
    return lines, total


def filled(
    technique, struct: str, name: str, language: str, row: int, at: int = 0
) -> tuple[list[str], int]:
    """What fills a struct from a place in a thread's row, and where the row goes on."""
    spelling = Spelling(language)
    lines = [spelling.variable(f"moit_{struct}", name)]
    for one in members(technique, struct):
        size = SIZES[one.type]
        lines.append(f"{name}.{one.name} = {spelling.given(at, size, row)};")
        at += size
    return lines, at


def numbers_of(technique, struct: str) -> int:
    return sum(SIZES[one.type] for one in members(technique, struct))


def accumulated(technique, language: str, depth, alpha, color=None, **options) -> np.ndarray:
    """(n, k): what each fragment adds to targets."""
    kit = include(technique, language, **options)
    spelling = Spelling(language)
    if color is None:
        given = np.stack([depth, alpha], 1)
        z = spelling.given(0, 1, 2)
        z = f"moit_warped({z})" if "moit_warped" in kit.calls else z  # or it is given
        call = f"moit_accumulate({z}, {spelling.given(1, 1, 2)})"
    else:
        given = np.concatenate([color, np.stack([alpha, depth], 1)], 1)
        parts = [spelling.given(0, 3, 5), spelling.given(3, 1, 5), spelling.given(4, 1, 5)]
        call = f"moit_accumulate_color({', '.join(parts)})"
    lines, total = _stored(technique, "sums", "sums")
    return run(kit, given, [spelling.value("moit_sums", "sums", call), *lines], total)


def inserted(technique, language: str, case) -> tuple[np.ndarray, np.ndarray]:
    """(P, words) as bits of floats, and (P, k) what the tail's targets then hold: the fragments of
    each pixel (depth, alpha, color and offsets of a case) in their order, a thread a pixel."""
    kit = include(technique, language)
    assert kit.state and kit.kept
    counts = np.diff(case.offsets)
    most = int(counts.max())
    given = np.zeros((len(counts), most, 5), np.float32)
    place = np.arange(len(case.pixel)) - case.offsets[case.pixel]
    given[case.pixel, place] = np.column_stack([case.depth, case.alpha, case.color])
    given = np.concatenate([counts[:, None].astype(np.float32), given.reshape(len(counts), -1)], 1)
    words, row = kit.kept.words, given.shape[1]
    spelling = Spelling(language)
    asks = ["moit_warped(given[at])" if kit.state.warps else "given[at]", "given[at + 1u]"]
    if kit.state.takes_color:
        asks.append(f"{spelling.vector[3]}(given[at + 2u], given[at + 3u], given[at + 4u])")
    call = f"moit_inserted(held, {', '.join(asks)})"
    tail = members(technique, "sums") if kit.held else []
    sizes = [SIZES[one.type] for one in tail]
    total = words + sum(sizes)
    lines = ["moit_state held;"]
    lines += [f"held.word[{k}] = {clear}u;" for k, clear in enumerate(kit.state.clears)]
    lines += ["moit_sums tail;"] if tail else []
    for one in tail:
        (clear,) = [target.clear for name, target in kit.held if name == one.name]
        lines += [f"tail.{one.name}{part} = {clear};" for part in _parts(one)]
    lines += [f"for (int r = 0; r < {most}; ++r) {{ if (float(r) < given[i * {row}u]) {{"]
    lines += [f"uint at = i * {row}u + 1u + uint(r) * 5u;"]
    lines += [f"moit_insertion found = {call};" if tail else f"held = {call};"]
    if tail:
        lines += ["held = found.held;"]
        for one, (_, target) in zip(tail, kit.held, strict=True):
            rest = " * (1.0 - found.leaves.target0.w)" if target.blend == "over" else ""
            name = f"tail.{one.name}"
            leaves = f"found.leaves.{one.name}"
            if target.blend == "multiply-complement":
                lines.append(f"{name} = {name} * (1.0 - {leaves});")
            else:
                lines.append(f"{name} = {leaves} + {name}{rest};")
    lines += ["} }"]
    bits = LANGUAGES[language].words.get("uintBitsToFloat", "uintBitsToFloat")
    lines += [f"made[i * {total}u + {k}u] = {bits}(held.word[{k}]);" for k in range(words)]
    at = words
    for one in tail:
        for part in _parts(one):
            lines.append(f"made[i * {total}u + {at}u] = tail.{one.name}{part};")
            at += 1
    found = run(kit, given, lines, total)
    return found[:, :words], found[:, words:]


def masks(technique, language: str, row, column, depth, alpha) -> np.ndarray:
    """(n,) of uint32: the samples that each fragment covers."""
    kit = include(technique, language)
    whole = "u32" if language == "wgsl" else "uint"
    bits = (
        "bitcast<f32>"
        if language == "wgsl"
        else LANGUAGES[language].words.get("uintBitsToFloat", "uintBitsToFloat")
    )
    place = "given[i * 4u], given[i * 4u + 1u]"
    row_, column_ = (f"{whole}({one})" for one in place.split(", "))
    call = f"moit_covered_samples({row_}, {column_}, given[i * 4u + 2u], given[i * 4u + 3u])"
    given = np.stack([row, column, depth, alpha], 1).astype(np.float32)
    return run(kit, given, [f"made[i] = {bits}({call});"], 1)[:, 0].view(np.uint32)


def added(technique, language: str, color, alpha) -> np.ndarray:
    """(n, 4): what fragments add to colours where nothing hides them."""
    kit, spelling = include(technique, language), Spelling(language)
    call = f"moit_shaded({spelling.given(0, 3, 4)}, {spelling.given(3, 1, 4)}, 1.0)"
    lines = [spelling.value("vec4", "found", call)]
    lines += [f"made[i * 4u + {k}u] = found[{k}];" for k in range(4)]
    return run(kit, np.column_stack([color, alpha]).astype(np.float32), lines, 4)


def behind(technique, language: str, depth, before) -> np.ndarray:
    """(n,) of bool: which fragments a round of peeling keeps."""
    kit = include(technique, language)
    call = "moit_is_behind(given[i * 2u], given[i * 2u + 1u])"
    lines = [f"made[i] = 0.0; if ({call}) {{ made[i] = 1.0; }}"]
    return run(kit, np.stack([depth, before], 1).astype(np.float32), lines, 1)[:, 0] == 1


def _parts(one: Member) -> list[str]:
    return [f"[{k}]" for k in range(SIZES[one.type])] if SIZES[one.type] > 1 else [""]


def _state(kit: Include, language: str, row: int) -> list[str]:
    """What fills the words of a pixel from the beginning of a thread's row."""
    assert kit.kept
    bits = LANGUAGES[language].words.get("floatBitsToUint", "floatBitsToUint")
    return [
        "moit_state held;",
        *(f"held.word[{k}] = {bits}(given[i * {row}u + {k}u]);" for k in range(kit.kept.words)),
    ]


def through_words(technique, language: str, words, depth, alpha, in_place=True) -> np.ndarray:
    """Transmittance of fragments at a depth, given the words of their pixels (n, words); of what
    has factors in place or by these."""
    kit = include(technique, language)
    assert kit.state
    row = words.shape[1] + 2
    depths, alphas = (Spelling(language).given(row - k, 1, row) for k in (2, 1))
    depths = f"moit_warped({depths})" if kit.state.warps else depths
    call = f"moit_transmittance(held, {depths})"
    if kit.state.has_factors:
        call = f"moit_transmittance_of_words(held, {depths}, {alphas})"
        if not in_place:
            call = f"moit_transmittance(moit_factor_of_words(held), {depths}, {alphas})"
    lines = [*_state(kit, language, row), f"made[i] = {call};"]
    return run(kit, np.column_stack([words, depth, alpha]), lines, 1)[:, 0]


def resolved_layers(technique, language: str, words, tail) -> np.ndarray:
    """(n, 4): premultiplied colour and coverage, by words and what the tail's targets hold."""
    kit = include(technique, language)
    spelling, row, at = Spelling(language), words.shape[1] + tail.shape[1], words.shape[1]
    lines = _state(kit, language, row)
    lines += ["moit_sums tail;"] if kit.held else []
    for one in members(technique, "sums") if kit.held else []:
        lines.append(f"tail.{one.name} = {spelling.given(at, SIZES[one.type], row)};")
        at += SIZES[one.type]
    call = f"moit_resolve_layers(held{', tail' * bool(kit.held)})"
    lines += [spelling.value("vec4", "found", call)]
    lines += [f"made[i * 4u + {k}u] = found[{k}];" for k in range(4)]
    return run(kit, np.concatenate([words, tail], 1), lines, 4)


def warped(technique, language: str, depth, **options) -> np.ndarray:
    kit = include(technique, language, **options)
    call = f"made[i] = moit_warped({Spelling(language).given(0, 1, 1)});"
    return run(kit, depth[:, None], [call], 1)[:, 0]


def extents_of(technique, language: str, depth) -> np.ndarray:
    """(n, 2): what each fragment brings to its pixel's own range."""
    kit = include(technique, language)
    lines, total = _stored(technique, "extents", "found")
    call = f"moit_extents_of({Spelling(language).given(0, 1, 1)})"
    lines = [Spelling(language).value("moit_extents", "found", call), *lines]
    return run(kit, depth[:, None], lines, total)


def warped_within(technique, language: str, extents, depth) -> np.ndarray:
    """(n,): z of depths in their pixels' own ranges (n, 2)."""
    kit, spelling = include(technique, language), Spelling(language)
    lines, at = filled(technique, "extents", "own", language, 3)
    lines.append(f"made[i] = moit_warped_within(own, {spelling.given(at, 1, 3)});")
    return run(kit, np.column_stack([extents, depth]), lines, 1)[:, 0]


def through(
    technique, language: str, sums, z, alpha, in_place=False, extents=None, **options
) -> np.ndarray:
    """Transmittance of fragments at z with opacity alpha, given what their pixels keep (n, k);
    extents: and their own ranges (n, 2), where factors hang on these."""
    kit = include(technique, language, **options)
    ranges = [extents] if extents is not None and kit.factors_read_extents else []
    row = sums.shape[1] + 2 * len(ranges) + 2
    lines, at = filled(technique, "sums", "sums", language, row)
    if ranges:
        more, at = filled(technique, "extents", "own", language, row, at)
        lines += more
    spelling, own = Spelling(language), ", own" * len(ranges)
    in_place |= "moit_factor" not in kit.calls
    pixel = f"sums{own}" if in_place else f"moit_factor(sums{own})"
    name = "moit_transmittance_of_sums" if in_place else "moit_transmittance"
    asked = f"{spelling.given(at, 1, row)}, {spelling.given(at + 1, 1, row)}"
    lines.append(f"made[i] = {name}({pixel}, {asked});")
    given = np.concatenate([sums, *ranges, np.stack([z, alpha], 1)], 1)
    return run(kit, given, lines, 1)[:, 0]


def factors(technique, language: str, sums) -> np.ndarray:
    """(n, k): what the pass for factors makes of what pixels keep (n, j), before it is rounded."""
    kit = include(technique, language)
    row = sums.shape[1]
    lines, _ = filled(technique, "sums", "sums", language, row)
    lines.append(Spelling(language).value("moit_factors", "made_of_it", "moit_factor(sums)"))
    stored, total = _stored(technique, "factors", "made_of_it")
    return run(kit, sums, [*lines, *stored], total)


def through_factors(technique, language: str, held, z, alpha) -> np.ndarray:
    """Transmittance of fragments at z with opacity alpha, by their pixels' factors (n, k)."""
    kit, spelling = include(technique, language), Spelling(language)
    row = held.shape[1] + 2
    lines, at = filled(technique, "factors", "factors", language, row)
    asked = f"{spelling.given(at, 1, row)}, {spelling.given(at + 1, 1, row)}"
    lines.append(f"made[i] = moit_transmittance(factors, {asked});")
    return run(kit, np.column_stack([held, z, alpha]), lines, 1)[:, 0]


def accumulated_second(technique, language: str, sums, z, alpha) -> np.ndarray:
    """(n, k): what each fragment at z adds to targets of the second pass, given what its pixel
    keeps of the first (n, j)."""
    kit, spelling = include(technique, language), Spelling(language)
    row = sums.shape[1] + 2
    lines, at = filled(technique, "sums", "sums", language, row)
    asked = f"{spelling.given(at, 1, row)}, {spelling.given(at + 1, 1, row)}"
    call = f"moit_accumulate_second(moit_factor(sums), {asked})"
    stored, total = _stored(technique, "seconds", "added")
    lines = [*lines, spelling.value("moit_seconds", "added", call), *stored]
    return run(kit, np.column_stack([sums, z, alpha]), lines, total)


def through_second(technique, language: str, sums, seconds, z, alpha) -> np.ndarray:
    """Transmittance of fragments at z, by what their pixels keep of both passes (n, j), (n, k)."""
    kit, spelling = include(technique, language), Spelling(language)
    row, first = sums.shape[1] + seconds.shape[1] + 2, sums.shape[1]
    lines, _ = filled(technique, "sums", "sums", language, row)
    more, at = filled(technique, "seconds", "seconds", language, row, first)
    asked = f"{spelling.given(at, 1, row)}, {spelling.given(at + 1, 1, row)}"
    call = f"moit_transmittance(moit_factor_second(sums, seconds), {asked})"
    given = np.column_stack([sums, seconds, z, alpha])
    return run(kit, given, [*lines, *more, f"made[i] = {call};"], 1)[:, 0]


def resolved(technique, language: str, sums, colours=None, **options) -> np.ndarray:
    """(n, 4): premultiplied colour and coverage."""
    kit = include(technique, language, **options)
    spelling = Spelling(language)
    given = sums if colours is None else np.concatenate([sums, colours], 1)
    row = given.shape[1]
    lines, at = filled(technique, "sums", "sums", language, row)
    first = "" if colours is None else spelling.given(at, 4, row) + ", "
    name = "moit_resolve_color" if colours is None else "moit_resolve"
    lines.append(spelling.value("vec4", "found", f"{name}({first}sums)"))
    lines += [f"made[i * 4u + {k}u] = found[{k}];" for k in range(4)]
    return run(kit, given, lines, 4)


def texels(technique, language: str, pixel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of small targets: column and row of the first texel that a pixel (n, 2), a column and a row,
    lies between, and the shares (n, 4) of the four."""
    kit, spelling = include(technique, language), Spelling(language)
    at = spelling.given(0, 2, 2)
    lines = [spelling.value("vec2", "first", f"moit_texel_before({at})")]
    lines += [spelling.value("vec4", "shares", f"moit_shares_of_texels({at})")]
    lines += [f"made[i * 6u + {k}u] = first[{k}];" for k in range(2)]
    lines += [f"made[i * 6u + {k + 2}u] = shares[{k}];" for k in range(4)]
    found = run(kit, pixel.astype(np.float32), lines, 6)
    return found[:, :2].astype(int), found[:, 2:]


def read_between(
    technique, language: str, corners, shares, struct: str = "sums", own=None
) -> np.ndarray:
    """(n, k): what pixels read of four texels (n, 4, k); own: (n,) of totals, to scale it to."""
    kit, spelling = include(technique, language), Spelling(language)
    row, at, lines = corners[0].size + 4 + (own is not None), 0, []
    for name in "abcd":
        more, at = filled(technique, struct, name, language, row, at)
        lines += more
    call = "moit_between" + "_second" * (struct == "seconds")
    call += f"(a, b, c, d, {spelling.given(at, 4, row)})"
    given = [corners.reshape(len(corners), -1), shares]
    if own is not None:
        call, given = f"moit_scaled_to({call}, {spelling.given(at + 4, 1, row)})", [*given, own]
    stored, total = _stored(technique, struct, "found")
    lines += [spelling.value(f"moit_{struct}", "found", call), *stored]
    return run(kit, np.column_stack(given), lines, total)
