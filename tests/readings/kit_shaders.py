"""Fragment shaders as the page of a kit says to write them, in each language."""

from __future__ import annotations

import tempfile
from pathlib import Path

from moit.catalog.targets import Target
from moit.kit.gathered import SHADING, THREADS, Program, tests_by_itself
from moit.kit.including import Include
from moit.kit.small_targets import FARTHEST, MEANS
from moit.kit.usage import usage
from readings import kit_runners
from readings.compilers import from_slang, run_tool, tool

PIXELS = ("resolve", FARTHEST, MEANS)  # whose shaders are given no fragment
FIRST = ("absorbance", "insert")  # passes that add to `held`
CHANNELS = {"r": 1, "rg": 2, "rgba": 4}


def shaders(kit: Include) -> dict[str, str]:
    """Whole texts by pass."""
    return {name: _WHOLE[kit.language.name](kit, name, lines) for name, lines in usage(kit).items()}


def validate(kit: Include) -> None:
    """Raises where a tool that the machine has refuses one; skips where it lacks the tool."""
    for name, text in shaders(kit).items():
        _CHECKS[kit.language.name](text, "comp" if runs_threads(kit, name) else "frag")


def check(kit: Include, name: str, lines: list[str]) -> None:
    """The same of one pass, with other lines."""
    _CHECKS[kit.language.name](_WHOLE[kit.language.name](kit, name, lines))


def outputs(kit: Include, name: str) -> list[tuple[str, int]]:
    """What a pass sets, with how many numbers."""
    if name == "resolve":
        return [("picture", 4)]
    if name == "peeling":
        return [("layer", 4)]
    if name in ("coverage", FARTHEST):
        return []
    program = program_of(kit, name)
    if program and name != SHADING:
        return [(one, channels(target)) for one, target in kit.held if program.captures]
    others = {"second absorbance": kit.second, "extents": kit.extents, MEANS: kit.means}
    targets = others.get(name, kit.shaded)
    targets = kit.held if name in FIRST else targets
    return [(one, channels(target)) for one, target in targets]


def program_of(kit: Include, name: str) -> Program | None:
    """The pass that changes arrays by atomics, of this name."""
    return next((one for one in kit.programs if one.name == name), None)


def runs_threads(kit: Include, name: str) -> bool:
    program = program_of(kit, name)
    return program is not None and program.where == THREADS


def channels(target: Target) -> int:
    return CHANNELS[target.format.rstrip("0123456789f")]


# Textures that a shader has beside those of the include.
READ = {"peeling": "before", "under": "layer", FARTHEST: "opaque"}
DEPTHS = ("peeling", FARTHEST)  # whose texture is of depth


def _vector(prefix: str, size: int) -> str:
    return "float" if size == 1 else f"{prefix}{size}"


def _body(lines: list[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _glsl(kit: Include, name: str, lines: list[str]) -> str:
    if runs_threads(kit, name):
        return (
            "#version 450\n#define MOIT_NO_FETCH\n" + kit.text + "\nlayout(local_size_x = 64) in;\n"
            f"{_GLSL_SIZE}void main() {{\n{_body(lines)}\n}}\n"
        )
    declared = [
        f"layout(location = {i}) out {_vector('vec', size)} {one};"
        for i, (one, size) in enumerate(outputs(kit, name))
    ]
    head = "" if name == "absorbance" and kit.extents else _DEFINED.get(name, "")
    given = "" if name in PIXELS else _GLSL_GIVEN
    if kit.programs:
        early = "layout(early_fragment_tests) in;\n"
        given += _GLSL_SIZE + (early if name not in (SHADING, *PIXELS) else "")
    if name in READ:
        given += f"layout(binding = 8) uniform sampler2D {READ[name]};\n"
    targets = "\n".join(declared)
    return f"#version 450\n{head}{kit.text}\n{given}{targets}\nvoid main() {{\n{_body(lines)}\n}}\n"


_DEFINED = {
    "extents": "#define MOIT_NO_FETCH\n",
    "absorbance": "#define MOIT_NO_FETCH\n",
    "insert": "#define MOIT_INSERTS\n",
}
_GLSL_SIZE = "layout(binding = 20) uniform Size { uvec2 size; };\n"
_GLSL_GIVEN = """layout(location = 0) in float depth;
layout(location = 1) in float alpha;
layout(location = 2) in vec3 color;
"""


def _hlsl(kit: Include, name: str, lines: list[str]) -> str:
    size = "cbuffer Size : register(b8) { uint2 size; };\n" if kit.programs else ""
    if runs_threads(kit, name):
        return (
            f"#define MOIT_NO_FETCH\n{kit.text}\n{size}[numthreads(64, 1, 1)]\n"
            f"void main(uint3 thread : SV_DispatchThreadID) {{\n{_body(lines)}\n}}\n"
        )
    given = ["float4 position : SV_Position"]
    if name not in PIXELS:
        given += ["float depth : DEPTH", "float alpha : ALPHA", "float3 color : COLOR"]
    given += [
        f"out {_vector('float', size)} {one} : SV_Target{i}"
        for i, (one, size) in enumerate(outputs(kit, name))
    ]
    given += ["out uint mask : SV_Coverage"] if name == "coverage" else []
    given += ["out float farthest : SV_Depth"] if name == FARTHEST else []
    texture = f"Texture2D<float4> {READ[name]} : register(t8);\n" if name in READ else ""
    head = _DEFINED["insert"] if name == "insert" else ""
    inserts = name == "insert" or (program_of(kit, name) is not None and name != SHADING)
    early = "[earlydepthstencil] " if inserts and kit.language.name == "hlsl" else ""
    main = f"{early}void main({', '.join(given)}) {{\n{_body(lines)}\n}}\n"
    return f"{head}{kit.text}\n{texture}{size}{main}"


def _slang(kit: Include, name: str, lines: list[str]) -> str:
    stage = "compute" if runs_threads(kit, name) else "fragment"
    return _hlsl(kit, name, lines).replace("void main(", f'[shader("{stage}")] void main(')


def _wgsl(kit: Include, name: str, lines: list[str]) -> str:
    size = ["@group(1) @binding(1) var<uniform> size: vec2<u32>;"] if kit.programs else []
    if runs_threads(kit, name):
        head = (
            "@compute @workgroup_size(64)\nfn main(@builtin(global_invocation_id) thread: vec3u) {"
        )
        return "\n".join([kit.text, *size, head, _body(lines), "}\n"])
    made = outputs(kit, name)
    spelled = {1: "f32", 2: "vec2f", 4: "vec4f"}
    given = ["@builtin(position) position: vec4f"]
    if name not in PIXELS:
        given += [f"@location({i}) {one}: f32" for i, one in enumerate(("depth", "alpha"))]
        given.append("@location(2) color: vec3f")
    kinds = [(one, f"@location({i})", spelled[size]) for i, (one, size) in enumerate(made)]
    if name == "coverage":
        kinds = [("mask", "@builtin(sample_mask)", "u32")]
    if name == FARTHEST:
        kinds = [("farthest", "@builtin(frag_depth)", "f32")]
    program = program_of(kit, name)
    read = READ.get(name, "opaque" if program and tests_by_itself("wgsl", program) else "")
    kind = "texture_depth_2d" if name in DEPTHS or program else "texture_2d<f32>"
    return "\n".join(
        [
            kit.text,
            *([f"@group(1) @binding(0) var {read}: {kind};"] if read else []),
            *size,
            *(f"var<private> {one}: {spelled};" for one, _, spelled in kinds),
            *(["struct Made {"] if kinds else []),
            *(f"    {where} m{i}: {spelled}," for i, (_, where, spelled) in enumerate(kinds)),
            *(["}"] if kinds else []),
            f"@fragment fn main({', '.join(given)}){' -> Made' * bool(kinds)} {{",
            _body(lines),
            *([f"    return Made({', '.join(one for one, *_ in kinds)});"] if kinds else []),
            "}\n",
        ]
    )


def _metal(kit: Include, name: str, lines: list[str]) -> str:
    made = outputs(kit, name)
    given = ["float4 position", "float depth", "float alpha", "float3 color"]
    given += ["moit_memory mem", "uint2 size", "uint index"] if kit.programs else []
    program = program_of(kit, name)
    if kit.state:
        access = ", access::read_write" * (name == "insert")
        given.append(f"texture2d_array<uint{access}> words")
    if name in READ:
        kind = "depth2d" if name in DEPTHS else "texture2d"
        given.append(f"{kind}<float> {READ[name]}")
        given += ["thread float &farthest"] if name == FARTHEST else []
    elif name == "coverage":
        given.append("thread uint &mask")
    elif program:
        given += [f"texture2d<float> {one}" for one, _ in kit.held if "{sums}" in program.call]
    elif name in FIRST:
        given += [f"texture2d<float> {one}" for one, _ in kit.extents]
    elif name != "extents" and not (kit.state and name == "shading"):
        between = () if name == "second absorbance" else kit.second
        first = kit.read_by_shading if kit.means and name != MEANS else kit.held
        read = (*first, *kit.extents, *between, *(() if name == "shading" else kit.shaded))
        given += [f"texture2d<float> {one}" for one, _ in read if one not in dict(made)]
    given += [f"thread {_vector('float', size)} &{one}" for one, size in made]
    return f"{kit.text}\nvoid shader({', '.join(given)}) {{\n{_body(lines)}\n}}\n"


_WHOLE = {"glsl": _glsl, "hlsl": _hlsl, "slang": _slang, "wgsl": _wgsl, "metal": _metal}


def _checked_by_glslang(text: str, stage: str, *how: str) -> None:
    """And what it makes of it by spirv-val, and by SPIRV-Cross for other drivers."""
    glslang = tool("glslangValidator", "glslang-tools")
    validator, cross = (
        tool("spirv-val", "spirv-tools"),
        tool("spirv-cross", "spirv-cross"),
    )
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder, f"text.{stage}"), Path(folder, "text.spv")
        source.write_text(text)
        run_tool(glslang, *how, "-V", "-S", stage, source, "-o", binary)
        run_tool(validator, binary)
        run_tool(cross, "--hlsl", "--shader-model", "51", binary)
        run_tool(cross, "--msl", "--msl-version", "20000", binary)


def _check_glsl(text: str, stage: str = "frag") -> None:
    _checked_by_glslang(text, stage, "--auto-map-locations")


def _check_hlsl(text: str, stage: str = "frag") -> None:
    # glslang knows no rasterizer-ordered views; Slang, whose text is the same, does
    plain = "-DMOIT_ORDERED_TEXTURE=RWTexture2DArray<uint>"
    _checked_by_glslang(text, stage, "-D", "-e", "main", "--auto-map-bindings", plain)


def _check_wgsl(text: str, stage: str = "frag") -> None:
    kit_runners.wgpu_device().create_shader_module(code=text)


def _check_slang(text: str, stage: str = "frag") -> None:
    assert all(from_slang(text, {"frag": "fragment", "comp": "compute"}[stage], "hlsl", "glsl"))


def _check_metal(text: str, stage: str = "frag") -> None:
    with tempfile.TemporaryDirectory() as folder:
        kit_runners.compiled_metal(text, folder, "-fsyntax-only")


_CHECKS = {
    "glsl": _check_glsl,
    "hlsl": _check_hlsl,
    "wgsl": _check_wgsl,
    "slang": _check_slang,
    "metal": _check_metal,
}
