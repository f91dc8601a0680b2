"""What a page says of the arrays that fragments share."""

from __future__ import annotations

from collections.abc import Sequence

from moit.gpu_costs.predicting import RESOLUTION
from moit.kit.memory import Memory


def memory_table(listed: Sequence[Memory]) -> str:
    width, height = RESOLUTION
    size = f"MB at {width} x {height}"
    lines = [f"| array | words | {size} | clear | what |", "| --- | --- | --: | --- | --- |"]
    for one in listed:
        clear = "-" if one.clear is None else f"0x{one.clear:08x}" if one.clear > 9 else one.clear
        bytes = f"{4e-6 * one.words_a_pixel * width * height:.4g}" if one.words_a_pixel else "-"
        lines.append(f"| {one.name} | {one.size} | {bytes} | {clear} | {one.about} |")
    return "\n".join(lines)


_ARE_TESTED = (
    "Passes over geometry write no depth and are tested against what is opaque; their shaders {} "
    "so that this comes first, or hidden fragments count."
)
_EARLY = {
    "glsl": _ARE_TESTED.format("say `layout(early_fragment_tests) in;`"),
    **dict.fromkeys(("hlsl", "slang"), _ARE_TESTED.format("are `[earlydepthstencil]`")),
    "metal": _ARE_TESTED.format("are `[[early_fragment_tests]]`"),
    "wgsl": "WGSL has no word that puts depth tests before writes to buffers, so shaders that "
    "write look at depth themselves: `opaque` is the depth target of what is opaque, as a "
    "`texture_depth_2d`, in passes of blocks that which `farthest` writes. Where depth is reversed "
    "`>=` becomes `<=`.",
}


def early_tests(language: str) -> str:
    """How hidden fragments are kept from counting."""
    return _EARLY[language]


def how_bound(language: str, listed: Sequence[Memory]) -> str:
    """Where arrays are bound, and how an engine says otherwise."""
    names = [one.name for one in listed]
    if language == "metal":
        given = ", ".join(f"buffers[{i}]" for i in range(len(names)))
        return (
            "Arrays are arguments of an entry point (`device atomic_uint *`), and all functions "
            "that read or change them are given `mem`: "
            f"`moit_memory mem = {{{given}}};`, which are {', '.join(names)}."
        )
    if language == "wgsl":
        return (
            "Arrays are `var<storage, read_write>` of `atomic<u32>` in the same group, at "
            + ", ".join(f"`MOIT_BINDING_{one.upper()}`" for one in names)
            + "; a pipeline binds those that it reads or changes."
        )
    kind = "BINDING" if language == "glsl" else "REGISTER"
    macros = [f"`MOIT_{kind}_{one.upper()}`" for one in names]
    moved = "4, set = 1" if language == "glsl" else "u0, space1"
    return (
        f"Arrays are bound at {', '.join(macros)}; to move them define all of these before the "
        f"include (`#define MOIT_{kind}_{names[0].upper()} {moved}`). To keep words elsewhere "
        "define `MOIT_OWN_MEMORY` and the functions that stand there."
    )
