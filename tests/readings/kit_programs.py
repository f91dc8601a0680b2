"""Kits whose passes change arrays by atomics, run pass by pass on pictures of a case's pixels."""

from __future__ import annotations

import numpy as np

from moit.kit.gathered import SHADING, SMALL, THREADS
from moit.kit.memory import with_memory
from readings import kits
from readings.kit_blocks import Picture


def through(technique, language: str, case) -> tuple[np.ndarray, Picture]:
    """Transmittance of fragments of a picture of these pixels, by the text."""
    kit = kits.include(technique, language)
    picture = Picture(case, technique.block_side)
    memory = {
        one.name: np.full(_size(one.size, picture), one.clear or 0, np.uint32) for one in kit.memory
    }
    n = picture.fragments_there
    pixel = case.pixel[:n]
    row, column = np.divmod(pixel, picture.width)
    sums = np.zeros((picture.pixels, 0), np.float32)
    if kit.held:
        sums = case.summed(kits.accumulated(technique, language, case.depth, case.alpha))
        sums = sums[: picture.pixels]
    found = None
    for program in kit.programs:
        if program.where == THREADS:
            given = np.arange(_size(program.threads, picture), dtype=np.float32)[:, None]
            _run(technique, kit, program, given, picture, memory)
            continue
        given = [column, row, case.depth[:n], case.alpha[:n], *sums[pixel].T]
        if program.where == SMALL:
            texel = np.full(picture.pixels, -1)
            texel[picture.of_texel] = np.arange(len(picture.of_texel))
            drawn = texel[pixel] >= 0
            given[1], given[0] = np.divmod(texel[pixel], picture.texels[0])
            given = [one[drawn] for one in given]
        made = _run(technique, kit, program, np.stack(given, 1).astype(np.float32), picture, memory)
        if program.name == SHADING:
            found = made[:, 0]
    assert found is not None
    return found, picture


def _size(formula: str, picture: Picture) -> int:
    known = {"WIDTH": picture.width, "HEIGHT": picture.height, "ceil": lambda x: int(np.ceil(x))}
    return int(eval(formula, {"__builtins__": {}}, known))


def _run(technique, kit, program, given: np.ndarray, picture: Picture, memory) -> np.ndarray:
    language, row = kit.language.name, given.shape[1]
    spelling = kits.Spelling(language)
    whole = {"wgsl": "u32"}.get(language, "uint")
    pair = {"glsl": "uvec2", "wgsl": "vec2<u32>"}.get(language, "uint2")
    place = f"{pair}({', '.join(f'{whole}({spelling.given(k, 1, row)})' for k in range(2))})"
    lines, sums = [], ""
    if "{sums}" in program.call:
        lines, _ = kits.filled(technique, "sums", "sums", language, row, 4)
        sums = "sums"
    call = "moit_" + program.call.format(
        place=place,
        thread=f"{whole}({spelling.given(0, 1, row)})",
        z=f"moit_warped({spelling.given(2, 1, row)})",
        alpha=spelling.given(3, 1, row),
        sums=sums,
    )
    size = f"{pair}({picture.width}{'u' if language != 'metal' else ''}, {picture.height})"
    call = call.replace(", size", f", {size}").replace(", alpha", f", {spelling.given(3, 1, row)}")
    call = with_memory(call, kit.touching, "") if language == "metal" else call
    shades = program.name == SHADING
    lines.append(f"made[i] = {call};" if shades else f"{call};")
    # threads beyond the last fill a group
    inside = " ".join(lines)
    return kits.run(kit, given, [f"if (i < {len(given)}u) {{ {inside} }}"], int(shades), memory)
