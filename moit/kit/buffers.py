"""Numbers too many for a shader's constants: a uniform buffer that is filled from a file beside the
include, in each language; in Metal constants, which lie in memory there."""

from __future__ import annotations

import dataclasses
import textwrap
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True)
class Buffer:
    """An array of vec4 that a text reads.

    name : of the array, as the text has it.
    rows : (n, 4) of float32.
    file : that has them, little-endian, row by row; "" where the text itself does.
    binding : where it is bound, unless an engine says otherwise.
    """

    name: str
    rows: NDArray[np.float32]
    file: str
    binding: int

    @property
    def content(self) -> bytes:
        """Of the file."""
        return self.rows.astype("<f4").tobytes()

    @property
    def table(self) -> dict[str, Any]:
        """As JSON can hold it."""
        return {
            "name": self.name,
            "kind": "uniform",
            "file": self.file,
            "bytes": self.rows.nbytes,
            "element": "4 floats of 32 bits, little-endian",
            "elements": len(self.rows),
            "binding": self.binding,
        }


def buffer_of(
    language: str, name: str, rows: NDArray[np.float32], stem: str, binding: int
) -> Buffer:
    kind = name.removeprefix("MOIT_").lower()
    file = "" if language == "metal" else f"moit_{stem}_{kind}.bin"
    register = 0 if language in ("hlsl", "slang") else binding
    return Buffer(name, rows, file, register)


def declared(language: str, buffer: Buffer) -> str:
    """What declares it in an include."""
    name, size = buffer.name, len(buffer.rows)
    own = name.lower()
    if language == "metal":
        numbers = [", ".join(str(one) for one in row) for row in buffer.rows]
        made = ", ".join(f"float4({one})" for one in numbers)
        lines = textwrap.wrap(made, 96, break_on_hyphens=False)
        return "\n".join(
            [f"constant float4 {name}[{size}] = {{", *(f"    {one}" for one in lines), "};"]
        )
    if language == "wgsl":
        return "\n".join(
            [
                f"// The bytes of {buffer.file}. A pipeline that does not read them binds nothing.",
                f"const {name}_BINDING = {buffer.binding};",
                f"@group(MOIT_GROUP) @binding({name}_BINDING) var<uniform> {name}: "
                f"array<vec4<f32>, {size}>;",
            ]
        )
    macro, place, block = _BLOCKS[language]
    return "\n".join(
        [
            f"// The bytes of {buffer.file}, as a uniform buffer. To read others define",
            f"// {name} as an array of {size} {'vec4' if language == 'glsl' else 'float4'}.",
            f"#ifndef {name}",
            f"#ifndef {name}_{macro}",
            f"#define {name}_{macro} {place}{buffer.binding}",
            "#endif",
            block.format(f"{name}_{macro}", own, size),
            f"#define {name} {own}",
            "#endif",
        ]
    )


_CBUFFER = "REGISTER", "b", "cbuffer {1}_buffer : register({0}) {{\n    float4 {1}[{2}];\n}}"
_BLOCKS = {
    "glsl": (
        "BINDING",
        "",
        "layout(std140, binding = {0}) uniform {1}_buffer {{\n    vec4 {1}[{2}];\n}};",
    ),
    "hlsl": _CBUFFER,
    "slang": _CBUFFER,
}


def bound_as(language: str, buffer: Buffer) -> str:
    """What the page says of it."""
    name = buffer.name
    if not buffer.file:
        return (
            f"`{name}` has {len(buffer.rows)} rows of 4 numbers, in the text: constants of a Metal "
            "library lie in memory, as a buffer does."
        )
    moved = {
        "glsl": f"`#define {name}_BINDING 0, set = 1` before the include moves it",
        "wgsl": f"`{name}_BINDING` in the text moves it",
    }.get(language, f"`#define {name}_REGISTER b0, space1` before the include moves it")
    elsewhere = "" if language == "wgsl" else f"; `#define {name}` names another array"
    place = "register b" if language in ("hlsl", "slang") else "binding "
    return (
        f"`{name}` is a uniform buffer of {buffer.rows.nbytes} bytes at {place}{buffer.binding}, "
        f"filled once with `{buffer.file}` as it is (floats of 32 bits, little-endian, four a "
        f"row). {moved}{elsewhere}. Only the pass that shades reads it."
    )
