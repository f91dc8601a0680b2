"""Compute shaders around what is exported, so that a compiler sees each pass alone.

A text for engines has functions, one for each pass; what they take comes from storage buffers and
what they give goes to one, which is all that stands around them. Depth has been warped before:
that belongs to what a fragment takes in any case.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from moit.gpu_costs.frames import (
    ACCUMULATE,
    ACCUMULATE_SECOND,
    BETWEEN,
    BETWEEN_SECOND,
    COUNT,
    COVERAGE,
    FACTOR,
    FACTOR_SECOND,
    FUSED,
    INTEGRATE,
    MARK,
    MARK_SECOND,
    MEANS,
    PLACE,
    RESOLVE,
    TRANSMITTANCE,
)

# The functions by the passes that call them, of which a text's first counts; those of techniques of
# one pass have their own names.
FUNCTIONS = {
    MARK: ("moit_mark", "moit_keep", "moit_extend"),
    MARK_SECOND: ("moit_keep_rest",),
    COUNT: ("moit_count_slices",),
    PLACE: ("moit_place_slices",),
    COVERAGE: ("moit_covered_samples",),
    ACCUMULATE: (
        "moit_deposit",
        "moit_add",
        "moit_inserted",
        "moit_accumulate_color",
        "moit_accumulate",
    ),
    MEANS: ("moit_mean",),
    FACTOR: ("moit_factor_of_words", "moit_factor"),
    ACCUMULATE_SECOND: ("moit_accumulate_second",),
    FACTOR_SECOND: ("moit_factor_second",),
    BETWEEN: ("moit_between",),
    BETWEEN_SECOND: ("moit_between_second",),
    INTEGRATE: ("moit_integrate",),
    TRANSMITTANCE: ("moit_transmittance",),
    FUSED: ("moit_transmittance_of_words", "moit_transmittance_of_sums"),
    RESOLVE: ("moit_resolve_words", "moit_resolve_layers", "moit_resolve_color", "moit_resolve"),
}

# What arguments of a fragment are called, and their types.
FRAGMENT = {
    "row": "uint",
    "column": "uint",
    "z": "float",
    "depth": "float",
    "alpha": "float",
    "color": "vec3",
    "shaded_sum": "vec4",
    "kept_sum": "vec4",
    "rest_sum": "vec4",
    "let_through": "float",
    "total": "float",
    "share": "vec4",
    "pixel": "uvec2",
    "place": "uvec2",
    "texel": "ivec2",
    "size": "uvec2",
    "index": "uint",
}
UNIFORM = 61  # binding of the first
TEXTURES = 20  # binding of what stands for them
ARRAYS = 40  # binding of the first array that fragments share
# Loops over slices are counted as of so many.
LOOPED = 8
_BYTES = {"void": 0, "float": 4, "uint": 4, "uvec2": 8, "vec2": 8, "vec3": 12, "vec4": 16}
_BUFFER = "layout(std430, binding = {}) {}buffer buffer_{}_ {{ {} at_{}_[]; }};"


def probes(text: str) -> dict[str, str]:
    """A compute shader for each pass of which `text`, GLSL without #version, has the function.

    Raises ValueError where a function takes what no fragment and no pixel has.
    """
    found = {}
    for name, functions in FUNCTIONS.items():
        declared = [one for one in functions if _signature(text, one)]
        if declared:
            found[name] = _probe(text, declared[0], name == INTEGRATE)
    return found


def given_bytes(text: str, name: str) -> int:
    """What the function of a pass gives, in bytes, as floats of 32 bits."""
    given = [
        signature[0] for one in FUNCTIONS[name] if (signature := _signature(text, one)) is not None
    ]
    return _size(text, given[0])


def _size(text: str, kind: str) -> int:
    """Of a type, in bytes."""
    if kind in _BYTES:
        return _BYTES[kind]
    members = re.search(rf"^struct {kind} \{{(.*?)\}};", text, re.MULTILINE | re.DOTALL)
    assert members
    return sum(
        _size(text, one) * int(count or 1)
        for one, count in re.findall(r"(\w+) \w+(?:\[(\d+)\])?;", members[1])
    )


def _signature(text: str, function: str) -> tuple[str, list[tuple[str, str]]] | None:
    """The type of what a function gives, and its parameters as types and names."""
    found = re.search(rf"^(\w+)\s+{function}\(([^)]*)\)\s*\{{", text, re.MULTILINE)
    if found is None:
        return None
    parameters = [one.split() for one in found[2].split(",") if one.strip()]
    return found[1], [(words[-2], words[-1]) for words in parameters]


def _probe(text: str, function: str, loops: bool = False) -> str:
    signature = _signature(text, function)
    assert signature
    given, parameters = signature
    buffers, arguments = zip(*_taken(function, parameters), strict=True)
    binding = len(buffers)
    result = _BUFFER.format(binding, "writeonly ", binding, given, binding)
    here = "[gl_GlobalInvocationID.x]"
    call = f"{function}({', '.join(arguments)})"
    # storage buffers come first; what a kit reads from a uniform buffer comes behind them all
    block = re.findall(r"^#ifndef (\w+_BINDING)$", text, re.MULTILINE)
    arrays = re.findall(r"binding = (MOIT_BINDING_\w+)\) buffer", text)
    lines = [
        "#version 450",
        *(_textures(text) if function in FUNCTIONS[MEANS] else []),
        *(f"#define {one} {UNIFORM + i}" for i, one in enumerate(block)),
        *(f"#define {one} {ARRAYS + i}" for i, one in enumerate(arrays)),
        *([f"#define MOIT_SLOTS {LOOPED}"] if loops else []),
        "layout(local_size_x = 64) in;",
        text,
        *buffers,
        *([] if given == "void" else [result]),
        f"void main() {{ {'' if given == 'void' else f'at_{binding}_{here} = '}{call}; }}",
    ]
    return "\n".join(lines) + "\n"


def _textures(text: str) -> Iterator[str]:
    """What stands for textures, of which a text has macros: arrays, and how large they are."""
    size = f"layout(std430, binding = {TEXTURES}) readonly buffer sizes_ {{ ivec2 size_; }};"
    yield from (size, "#define MOIT_PIXELS size_", "#define MOIT_TEXELS size_")
    for i in re.findall(r"#define MOIT_FETCH_(\d+)\(", text):
        yield _BUFFER.format(
            TEXTURES + 1 + int(i), "readonly ", f"texture_{i}", "vec4", f"texel_{i}"
        )
        yield f"#define MOIT_FETCH_{i}(pixel) at_texel_{i}_[(pixel).y * size_.x + (pixel).x]"


def _taken(function: str, parameters: list[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """A buffer and an argument for each."""
    for binding, (kind, name) in enumerate(parameters):
        if FRAGMENT.get(name, kind) != kind or (name not in FRAGMENT and kind in FRAGMENT.values()):
            raise ValueError(f"{function}: no fragment and no pixel has {kind} {name}")
        stored = "vec4" if kind == "vec3" else kind
        here = "0" if name == "size" else "gl_GlobalInvocationID.x"  # all pixels have one
        argument = f"at_{binding}_[{here}]"
        yield (
            _BUFFER.format(binding, "readonly ", binding, stored, binding),
            f"{argument}.rgb" if kind == "vec3" else argument,
        )
