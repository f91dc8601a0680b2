"""What a page says in the words of languages and programming interfaces: blend functions, outputs,
what a shader is given."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from moit.catalog import Technique
from moit.kit.gathered import THREADS
from moit.kit.including import Include
from moit.kit.interfaces import blend_rows
from moit.kit.usage import DEPTHS


def rows_of(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def blend_states(table: Mapping[str, Any]) -> list[str]:
    """The blend functions of targets and of the resolve, in the words of each interface."""
    states = [one["blend"] for one in (*table["targets"], table["passes"][-1])]
    triples = [(one["operation"], one["source"], one["destination"]) for one in states]
    names = [f"{source}, {destination}, {how}" for how, source, destination in triples]
    return [
        "The same for colour and for alpha:",
        rows_of(("interface", "where", *dict.fromkeys(names)), blend_rows(triples)),
    ]


_FIRST = {
    "glsl": "at `layout(location = 0)`",
    **dict.fromkeys(("hlsl", "slang"), "is SV_Target0"),
    "wgsl": "at `@location(0)`",
    "metal": "is `[[color(0)]]`",
}


def outputs(language: str) -> str:
    return (
        "A shader's outputs are the targets that its pass writes, in the order of the table: the "
        f"first {_FIRST[language]}."
    )


def what_depth_is(technique: Technique, language: str) -> str:
    if technique.depth_warp == "none" and technique.unit_range:
        return "Depth lies in [{:g}, {:g}] already, the nearest first.".format(
            *technique.unit_range
        )
    return (
        "Depth is the distance from the eye along the view axis, not what a depth buffer holds: in "
        f"perspective `{DEPTHS[language]}."
    )


# What calls name that a shader is given.
_POSITIONS = {
    "glsl": "",
    **dict.fromkeys(("hlsl", "slang"), " `position` is SV_Position"),
    "metal": " `position` is `[[position]]`",
    "wgsl": " `position` is `@builtin(position)`",
}
_THREADS = {
    "glsl": "",
    **dict.fromkeys(("hlsl", "slang"), ", `thread` SV_DispatchThreadID"),
    "metal": ", `index` `[[thread_position_in_grid]]`",
    "wgsl": ", `thread` `@builtin(global_invocation_id)`",
}


def what_is_given(include: Include) -> str:
    name = include.language.name
    threads = any(one.where == THREADS for one in include.programs)
    said = _POSITIONS[name] + _THREADS[name] * threads
    return said + "." * bool(said)
