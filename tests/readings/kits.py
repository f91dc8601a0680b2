"""What texts that `moit.export` writes make of numbers: each function by itself, in any language,
as readings/kit_runners.py runs it."""

from __future__ import annotations

from functools import cache

import numpy as np

from moit.kit.including import LANGUAGES, Include, include_of
from moit.kit.recipes import recipe_of
from moit.kit.tokens import Member, items_of, members_of
from readings.kit_runners import Spelling, run

SIZES = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}


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
