"""Kits whose passes change arrays by atomics, run pass by pass on pictures of a case's pixels."""

from __future__ import annotations

import numpy as np

from moit.catalog.targets import channels
from moit.kit.gathered import SHADING, SMALL, THREADS
from moit.kit.memory import with_memory
from readings import kit_runners, kits
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
    sums = np.zeros((picture.pixels, kits.numbers_of(technique, "sums") * bool(kit.held)))
    found = None
    for program in kit.programs:
        if program.where == THREADS:
            given = np.arange(_size(program.threads, picture), dtype=np.float32)[:, None]
            _run(technique, kit, program, given, picture, memory)
            continue
        given = [column, row, case.depth[:n], case.alpha[:n], *sums[pixel].T]
        if program.captures:
            terms = _captured(technique, kit, program, np.stack(given, 1), picture, memory)
            sums = _blended(terms, kit.held, picture)
        if not program.call:
            continue
        if program.where == SMALL:
            texel = np.full(picture.pixels, -1)
            texel[picture.of_texel] = np.arange(len(picture.of_texel))
            drawn = texel[pixel] >= 0
            given[1], given[0] = np.divmod(texel[pixel], picture.texels[0])
            given = [one[drawn] for one in given]
        made = _run(technique, kit, program, np.stack(given, 1).astype(np.float32), picture, memory)
        if program.name == SHADING:
            found = made.sum(axis=1)
    assert found is not None
    return found, picture


def _size(formula: str, picture: Picture) -> int:
    known = {"WIDTH": picture.width, "HEIGHT": picture.height, "ceil": lambda x: int(np.ceil(x))}
    return int(eval(formula, {"__builtins__": {}}, known))


def _blended(terms: np.ndarray, held, picture: Picture) -> np.ndarray:
    """(P, k) as targets hold what fragments add: those of half floats round after each."""
    n = picture.fragments_there
    case, pixel = picture.case, picture.case.pixel[:n]
    offsets = case.offsets[: picture.pixels]
    sums = np.add.reduceat(terms.astype(np.float64), offsets, axis=0).astype(np.float32)
    halves = [target.format for _, target in held for _ in range(channels(target.format))]
    halves = [one.endswith("16f") for one in halves]
    if any(halves):
        rounded = np.zeros((picture.pixels, sum(halves)), np.float16)
        place = np.arange(n) - case.offsets[pixel]
        for k in range(place.max() + 1):
            now = place == k
            added = rounded[pixel[now]] + terms[now][:, halves].astype(np.float64)
            rounded[pixel[now]] = added.astype(np.float16)
        sums[:, halves] = rounded
    return sums


def _captured(technique, kit, program, given: np.ndarray, picture: Picture, memory) -> np.ndarray:
    """(n, k): what each fragment adds to targets."""
    call = _call(kit, program.captures, given.shape[1], picture, "")
    stored, total = kits._stored(technique, "sums", "added")
    lines = [kit_runners.Spelling(kit.language.name).value("moit_sums", "added", call), *stored]
    inside = f"if (i < {len(given)}u) {{ {' '.join(lines)} }}"
    return kit_runners.run(kit, given.astype(np.float32), [inside], total, memory)


def _run(technique, kit, program, given: np.ndarray, picture: Picture, memory) -> np.ndarray:
    language, row = kit.language.name, given.shape[1]
    lines, sums = [], ""
    if "{sums}" in program.call:
        lines, _ = kits.filled(technique, "sums", "sums", language, row, 4)
        sums = "sums"
    call = _call(kit, program.call, row, picture, sums)
    shades = program.name == SHADING
    stored = ["made[i] = {0};"]
    if program.parted:
        stored = [
            kit_runners.Spelling(language).value("vec2", "through", "{0}"),
            "made[2u * i] = through.x;",
            "made[2u * i + 1u] = through.y;",
        ]
    lines += [one.format(call) for one in stored] if shades else [f"{call};"]
    # threads beyond the last fill a group
    inside = " ".join(lines)
    return kit_runners.run(
        kit,
        given,
        [f"if (i < {len(given)}u) {{ {inside} }}"],
        shades * (1 + program.parted),
        memory,
    )


def _call(kit, call: str, row: int, picture: Picture, sums: str) -> str:
    """Of the text, for a thread whose row has a column, a row, depth and alpha."""
    language = kit.language.name
    spelling = kit_runners.Spelling(language)
    whole = {"wgsl": "u32"}.get(language, "uint")
    pair = {"glsl": "uvec2", "wgsl": "vec2<u32>"}.get(language, "uint2")
    place = f"{pair}({', '.join(f'{whole}({spelling.given(k, 1, row)})' for k in range(2))})"
    call = "moit_" + call.format(
        place=place,
        thread=f"{whole}({spelling.given(0, 1, row)})",
        z=f"moit_warped({spelling.given(2, 1, row)})",
        alpha=spelling.given(3, 1, row),
        sums=sums,
    )
    size = f"{pair}({picture.width}{'u' if language != 'metal' else ''}, {picture.height})"
    for name, value in (
        ("size", size),
        ("depth", spelling.given(2, 1, row)),
        ("alpha", spelling.given(3, 1, row)),
    ):
        call = call.replace(f", {name}", f", {value}")
    return with_memory(call, kit.touching, "") if language == "metal" else call
