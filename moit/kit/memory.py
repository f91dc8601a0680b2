"""Arrays of words that all fragments share and change by atomics, in each language: how an include
declares them, and the functions by which a text reads and changes them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from moit.kit.layout import laid_out

# What a text may call of an array, as `add_words(i, x)`: all but "load" change it.
OPERATIONS = ("load", "store", "or", "add", "min", "max")


@dataclasses.dataclass(frozen=True)
class Memory:
    """An array of words of 32 bits.

    name : as the text has it, in `load_NAME`.
    size : how many words, as a page says it, by WIDTH and HEIGHT of the picture.
    about : what is in it.
    clear : of each word before every frame; None: a pass writes all.
    words_a_pixel : how many, of what is more than a few for a whole picture.
    """

    name: str
    size: str
    about: str
    clear: int | None = 0
    words_a_pixel: float = 0.0

    @property
    def functions(self) -> tuple[str, ...]:
        return tuple(f"{one}_{self.name}" for one in OPERATIONS)


def table_of_memory(listed: Sequence[Memory], first: int) -> list[dict[str, Any]]:
    """As JSON can hold it; the first one's binding."""
    return [
        {
            "name": one.name,
            "kind": "storage",
            "element": "a word of 32 bits",
            "elements": one.size,
            "clear": one.clear,
            "binding": first + i,
            "about": one.about,
        }
        for i, one in enumerate(listed)
    ]


def declared(language: str, listed: Sequence[Memory], text: str, first: int) -> str:
    """What declares arrays and those functions that a text calls. first : of bindings."""
    return "\n".join(_LANGUAGES[language](listed, text, first))


def _called(one: Memory, text: str) -> list[str]:
    return [op for op in OPERATIONS if re.search(rf"\bmoit_{op}_{one.name}\(", text)]


_GLSL_CALLS = {
    "load": "uint {0}(uint i) {{ return moit_{1}[i]; }}",
    "store": "void {0}(uint i, uint x) {{ moit_{1}[i] = x; }}",
    **{
        op: f"uint {{0}}(uint i, uint x) {{{{ return atomic{op.title()}(moit_{{1}}[i], x); }}}}"
        for op in OPERATIONS[2:]
    },
}
_HLSL_CALLS = _GLSL_CALLS | {
    op: "uint {0}(uint i, uint x) {{ uint was; "
    f"Interlocked{op.title()}(moit_{{1}}[i], x, was); return was; }}}}"
    for op in OPERATIONS[2:]
}
_METAL_CALLS = {
    "load": "inline uint moit_load(device atomic_uint *array, uint i) "
    "{ return atomic_load_explicit(array + i, memory_order_relaxed); }",
    "store": "inline void moit_store(device atomic_uint *array, uint i, uint x) "
    "{ atomic_store_explicit(array + i, x, memory_order_relaxed); }",
    **{
        op: f"inline uint moit_{op}(device atomic_uint *array, uint i, uint x) "
        f"{{ return atomic_fetch_{op}_explicit(array + i, x, memory_order_relaxed); }}"
        for op in OPERATIONS[2:]
    },
}
_WGSL_CALLS = {
    "load": "fn {0}(i: u32) -> u32 {{ return atomicLoad(&moit_{1}[i]); }}",
    "store": "fn {0}(i: u32, x: u32) {{ atomicStore(&moit_{1}[i], x); }}",
    **{
        op: "fn {0}(i: u32, x: u32) -> u32 "
        f"{{{{ return atomic{op.title()}(&moit_{{1}}[i], x); }}}}"
        for op in OPERATIONS[2:]
    },
}


def _calls(listed: Iterable[Memory], text: str, spelled: dict[str, str]) -> list[str]:
    lines = []
    for one in listed:
        for op in _called(one, text):
            line = spelled[op].format(f"moit_{op}_{one.name}", one.name)
            lines += laid_out(line, 2)
    return lines


_SHARED = "// Words that fragments share. To keep them elsewhere: MOIT_OWN_MEMORY, these functions."


Spelled = Callable[[Sequence[Memory], str, int], list[str]]


def _like_c(prefix: str, place: str, array: str, spelled: dict[str, str]) -> Spelled:
    def lines(listed: Sequence[Memory], text: str, first: int) -> list[str]:
        macros = [f"MOIT_{prefix}_{one.name.upper()}" for one in listed]
        # registers of unordered access lie behind those of targets in one table
        start = first if not place else 4
        return [
            _SHARED,
            "#ifndef MOIT_OWN_MEMORY",
            f"#ifndef {macros[0]}",
            *(f"#define {one} {place}{start + i}" for i, one in enumerate(macros)),
            "#endif",
            *(array.format(macro, one.name) for macro, one in zip(macros, listed, strict=True)),
            *_calls(listed, text, spelled),
            "#endif",
        ]

    return lines


def _metal(listed: Sequence[Memory], text: str, first: int) -> list[str]:
    members = " ".join(f"device atomic_uint *{one.name};" for one in listed)
    called = [op for op in OPERATIONS if re.search(rf"\bmoit_{op}\(mem\.", text)]
    return [
        "// Words that fragments share, arguments of an entry point as `device atomic_uint *`.",
        *laid_out(f"struct moit_memory {{ {members} }};"),
        *(line for op in called for line in laid_out(_METAL_CALLS[op], 2)),
    ]


def _wgsl(listed: Sequence[Memory], text: str, first: int) -> list[str]:
    return [
        "// Words that fragments share.",
        *(f"const MOIT_BINDING_{one.name.upper()} = {first + i};" for i, one in enumerate(listed)),
        *(
            f"@group(MOIT_GROUP) @binding(MOIT_BINDING_{one.name.upper()})\n"
            f"var<storage, read_write> moit_{one.name}: array<atomic<u32>>;"
            for one in listed
        ),
        *_calls(listed, text, _WGSL_CALLS),
    ]


_ARRAYS = "RWStructuredBuffer<uint> moit_{1} : register({0});"
_LANGUAGES = {
    "glsl": _like_c(
        "BINDING",
        "",
        "layout(std430, binding = {0}) buffer moit_{1}_buffer {{ uint moit_{1}[]; }};",
        _GLSL_CALLS,
    ),
    "hlsl": _like_c("REGISTER", "u", _ARRAYS, _HLSL_CALLS),
    "slang": _like_c("REGISTER", "u", _ARRAYS, _HLSL_CALLS),
    "metal": _metal,
    "wgsl": _wgsl,
}


def with_memory(text: str, touching: Iterable[str], own: str) -> str:
    """A declaration in Metal, whose functions are given the arrays: so are all that call these.

    touching : such functions; own : what the declaration declares.
    """
    names = "|".join(sorted(touching))

    def given(found: re.Match[str]) -> str:
        kind = "moit_memory " if found[1] == own else ""
        direct = re.fullmatch(rf"moit_({'|'.join(OPERATIONS)})_(\w+)", found[1])
        if direct and not kind:
            return f"moit_{direct[1]}(mem.{direct[2]}, "
        return f"{found[1]}({kind}mem{'' if found[2] else ', '}"

    return re.sub(rf"\b({names})\((?=(\))?)", given, text)
