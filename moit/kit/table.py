"""The table beside an include, as JSON: passes, targets, words, bindings: what to set up."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from moit.catalog import Technique
from moit.catalog.targets import Target
from moit.kit.gathered import SMALL, program_rows
from moit.kit.including import Include
from moit.kit.interfaces import blend, format_names
from moit.kit.memory import table_of_memory
from moit.kit.recipe import HASHED, PEELED, Recipe, State
from moit.kit.rounds import passes_of
from moit.kit.small_targets import MEANS, farthest_pass
from moit.system.version import VERSION


def table_of(technique: Technique, recipe: Recipe, include: Include) -> dict[str, Any]:
    """What an engine sets up, as JSON can hold it."""
    targets = [
        *include.held,
        *include.means,
        *include.second,
        *include.shaded,
        *include.extents,
    ]
    bound = [*(["words"] if include.state else []), *(name for name, _ in targets)]
    passes = [*_geometry_passes(include)]
    own_total = [include.own_total] if include.own_total else []
    resolved = [one for one in bound if one not in dict(include.extents)]
    passes.append(
        {
            "name": "resolve",
            "draws": "the whole picture, once",
            "targets": ["the picture"],
            "reads": resolved
            if include.resolve_reads_sums
            else [*(name for name, _ in include.shaded), *own_total],
            "calls": ["moit_resolved"],
            "depth": {"test": None, "write": False},
            "blend": blend("over"),
        }
    )
    factors = [
        {"name": one.name, "format": format_names(format)}
        for one, format in zip(include.factors, include.factor_formats, strict=True)
    ]
    return {
        "moit": VERSION,
        "technique": str(technique),
        "language": include.language.name,
        "include": include.name,
        "digest": include.digest,
        "source": technique.source,
        "targets": [
            _target(name, target, side)
            for part, side in (
                (include.held, 1 if include.means else include.side),
                ((*include.means, *include.second), include.side),
                (include.shaded, 1),
                (include.extents, 1),
            )
            for name, target in part
        ],
        "bytes_a_pixel": _bytes_a_pixel(include),
        "bindings": {name: i for i, name in enumerate(bound)},
        **({"words": _words(include.state)} if include.state else {}),
        **({"memory": table_of_memory(include.memory, len(bound))} if include.memory else {}),
        **({"buffers": [one.table for one in include.buffers]} if include.buffers else {}),
        "passes": passes,
        "factors": factors,
        "options": [{"name": one.name, "value": one.value} for one in include.options],
    }


def _bytes_a_pixel(include: Include) -> float:
    kept = (*include.held, *include.second)
    colours = (*include.shaded, *include.extents)
    held, shaded = (sum(_bytes(one) for _, one in part) for part in (kept, colours))
    if include.programs:
        return held + shaded + 4 * sum(one.words_a_pixel for one in include.memory)
    if include.means:
        return held + sum(_bytes(one) for _, one in include.means) / include.side**2 + shaded
    if include.side > 1:
        return held / include.side**2 + shaded
    if include.state:
        return held + shaded + 4 * len(include.state.clears)
    if include.shape == HASHED:
        return shaded  # depth is that of the opaque picture
    if include.shape == PEELED:
        return held + shaded + 8 + 2 * 4  # a layer, and depth of this round and the one before
    return held + (shaded + 4) * include.count if include.shape else held + shaded


def _words(state: State) -> dict[str, Any]:
    """The array of textures that fragments change in order."""
    return {
        "format": format_names("r32ui"),
        "layers": len(state.clears),
        "clear": list(state.clears),
        "access": "read and written in the order of triangles",
    }


def _geometry_passes(include: Include) -> Iterator[dict[str, Any]]:
    held = [name for name, _ in include.held]
    if include.programs:
        if any(one.where == SMALL for one in include.programs):
            yield farthest_pass()
        shaded = [name for name, _ in include.shaded]
        yield from program_rows(include.programs, include.touched, held, shaded)
        return
    if include.shape:
        yield from passes_of(include.shape, include.count, include.shaded[0][0], bool(include.held))
        return
    through = [one for one in include.calls if one.startswith("moit_transmittance")]
    through = through[-1:] if include.state else through[:1]
    if include.state:
        calls = ["moit_loaded", "moit_inserted", "moit_store"]
        yield _geometry("insert", include.held, ["words"], calls) | {
            "targets": ["words", *held],
            "order": "triangles",
        }
        held = ["words"]
    elif include.held:
        if include.side > 1 and not include.means:
            yield farthest_pass()
        own = [name for name, _ in include.extents]
        if own:
            yield _geometry("extents", include.extents, [], ["moit_extents_of"]) | {
                "about": "Finds the least and the greatest depth of each pixel's fragments."
            }
        yield _geometry("absorbance", include.held, own, ["moit_accumulate"])
        if include.means:
            yield _means(include, held)
            held = [name for name, _ in include.read_by_shading]
        held += own
        if include.second:
            calls = ["moit_factor", "moit_accumulate_second"]
            yield _geometry("second absorbance", include.second, held, calls)
            held = [*held, *(name for name, _ in include.second)]
            through = ["moit_factor_second", *through]
    else:
        yield _geometry("shading", include.shaded, [], ["moit_accumulate_color"])
        return
    if include.shaded:
        read = [*held, *(one.name for one in include.buffers if one.file)]
        yield _geometry("shading", include.shaded, read, [*through, "moit_shaded"])


def _geometry(
    name: str, drawn: Iterable[tuple[str, Target]], reads: list[str], calls: list[str]
) -> dict[str, Any]:
    return {
        "name": name,
        "draws": "all transparent geometry, in any order",
        "targets": [one for one, _ in drawn],
        "reads": reads,
        "calls": calls,
        "depth": {"test": "less", "write": False},
    }


def _means(include: Include, held: list[str]) -> dict[str, Any]:
    """The pass that makes means of blocks."""
    return {
        "name": MEANS,
        "draws": "all of the small targets, once",
        "targets": [name for name, _ in include.means],
        "reads": held,
        "calls": ["moit_mean"],
        "depth": {"test": None, "write": False},
        "about": "Writes the mean of each block's pixels, without blending.",
    }


def _target(name: str, target: Target, side: int) -> dict[str, Any]:
    return {
        "name": name,
        **({"block_side": side} if side > 1 else {}),
        "format": format_names(target.format),
        "clear": target.clear,
        "blend": blend(target.blend),
        "bytes_a_pixel": _bytes(target),
    }


def _bytes(target: Target) -> int:
    channels = target.format.rstrip("0123456789f")
    return len(channels) * {"8": 1, "16": 2, "16f": 2, "32f": 4}[target.format[len(channels) :]]


def json_of(table: Mapping[str, Any]) -> str:
    return json.dumps(table, indent=2) + "\n"
