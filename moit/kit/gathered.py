"""Kits whose passes change arrays of words by atomics: which passes there are, over geometry and
over threads, and how their shaders call the text."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from moit.kit.memory import with_memory

# What a pass draws or runs: geometry to targets of blocks, geometry to the picture's, threads.
SMALL, PICTURE, THREADS = "small", "picture", "threads"
SHADING = "shading"  # the pass that draws to targets of colours


@dataclasses.dataclass(frozen=True)
class Program:
    """A pass that calls the text.

    name : of the pass.
    where : SMALL, PICTURE or THREADS.
    call : of the text, by its own names, "" for none; {place}: of a fragment, in pixels of what is
        drawn to; {thread}: its number; {z}: warped depth; {sums}: what a pixel's targets have. Of
        the pass that shades it gives transmittance.
    threads : how many, by WIDTH and HEIGHT of the picture; "" of fragments.
    about : what the table says of it.
    captures : likewise a call that gives what is added to the first targets.
    parted : transmittance is two numbers, of what goes to the first target of colours and of what
        goes to the second.
    """

    name: str
    where: str
    call: str
    threads: str = ""
    about: str = ""
    captures: str = ""
    parted: bool = False

    @property
    def functions(self) -> tuple[str, ...]:
        """Of the text, that it calls."""
        return tuple(one.partition("(")[0] for one in (self.captures, self.call) if one)


_PLACES = {
    "glsl": ("uvec2(gl_FragCoord.xy)", "ivec2(gl_FragCoord.xy)", "gl_GlobalInvocationID.x"),
    **dict.fromkeys(("hlsl", "slang"), ("uint2(position.xy)", "int2(position.xy)", "thread.x")),
    "metal": ("uint2(position.xy)", "uint2(position.xy)", "index"),
    "wgsl": ("vec2<u32>(position.xy)", "vec2<i32>(position.xy)", "thread.x"),
}
# WGSL has no early depth test: what is hidden would be counted. `opaque` is the depth bound.
_HIDDEN = (
    "if (position.z >= textureLoad(opaque, vec2<i32>(position.xy), 0)) { discard; }"
    " // WGSL tests late"
)


def tests_by_itself(language: str, program: Program) -> bool:
    """Whether a pass has to look at the depth of what is opaque, as no test comes first."""
    return language == "wgsl" and program.where != THREADS and program.name != SHADING


def called(language: str, call: str, touching: Sequence[str], held: Sequence[str]) -> str:
    """A call, as the shader of a pass has it."""
    place, pixel, thread = _PLACES[language]
    textures = "".join(f"{one}, " for one in held) if language == "metal" else ""
    text = "moit_" + call.format(
        place=place,
        thread=thread,
        z="moit_warped(depth)",
        sums=f"moit_fetched({textures}{pixel})",
    )
    return with_memory(text, touching, "") if language == "metal" else text


def program_lines(
    language: str,
    program: Program,
    touching: Sequence[str],
    held: Sequence[str],
    shaded: Sequence[str],
) -> list[str]:
    """What the shader of a pass has; held, shaded: names of targets."""
    text = called(language, program.call, touching, held)
    if program.name == SHADING:
        return shading_lines(language, program, text, shaded)
    lines = [_HIDDEN] if tests_by_itself(language, program) else []
    if program.captures:
        let = "let sums" if language == "wgsl" else "moit_sums sums"
        lines.append(f"{let} = {called(language, program.captures, touching, held)};")
        lines += [f"{one} = sums.{one};" for one in held]
    return [*lines, *([f"{text};"] if program.call else [])]


def shading_lines(
    language: str, program: Program, through: str, shaded: Sequence[str]
) -> list[str]:
    """What a fragment adds to targets of colours, by the call that gives transmittance."""
    pair = "vec2" if language == "glsl" else "float2"
    let = "let" if language == "wgsl" else pair if program.parted else "float"
    first = f"{let} through = {through};"
    if program.parted:
        parts = zip(shaded, "xy", strict=True)
        return [first, *(f"{one} = moit_shaded(color, alpha, through.{x});" for one, x in parts)]
    lines = [first, f"{shaded[0]} = moit_shaded(color, alpha, through);"]
    return [*lines, *(f"{one} = alpha;" for one in shaded[1:])]


# Of each function that a pass calls the arrays that it reads, and those that it changes.
Touched = Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]


def program_rows(
    programs: Sequence[Program], touched: Touched, held: list[str], shaded: list[str]
) -> list[dict[str, Any]]:
    """The passes but the resolve, as the table has them."""
    return [_row(one, touched, held, shaded) for one in programs]


def _row(one: Program, touched: Touched, held: list[str], shaded: list[str]) -> dict[str, Any]:
    shades = one.name == SHADING
    calls = [f"moit_{function}" for function in one.functions]
    found = [touched.get(call, ((), ())) for call in calls]
    reads, changes = (list(dict.fromkeys(sum(part, ()))) for part in zip(*found, strict=True))
    calls += ["moit_shaded"] * shades
    reads_sums = "{sums}" in one.call
    draws = "all transparent geometry, in any order"
    if one.where == SMALL:
        draws += ", to targets of blocks"
    row: dict[str, Any] = {
        "name": one.name,
        "draws": f"threads: {one.threads}" if one.where == THREADS else draws,
        "targets": [*changes, *(shaded if shades else held if one.captures else [])],
        "reads": [*reads, *(held if reads_sums else [])],
        "calls": calls,
        "depth": {"test": None if one.where == THREADS else "less", "write": False},
    }
    return (
        row
        | ({"threads": one.threads} if one.threads else {})
        | ({"about": one.about} if one.about else {})
    )
