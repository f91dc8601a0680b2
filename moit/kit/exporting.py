"""`moit.export`: a technique as a folder that an engine takes home."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Set
from contextlib import suppress
from typing import Any

import numpy as np

from moit.catalog import Technique
from moit.catalog import technique as technique_of
from moit.checks.arguments import one_of, path_name
from moit.kit.including import LANGUAGES, include_of
from moit.kit.page import page_of
from moit.kit.recipe import DEPTH_RANGE
from moit.kit.recipes import recipe_of
from moit.kit.table import json_of, table_of
from moit.system.files import writing_folder

TABLE = "targets.json"
PAGE = "README.md"


def export(
    technique: Technique | str,
    folder: str | os.PathLike[str],
    language: str = "glsl",
    *,
    depth_range: tuple[float, float] | None = None,
) -> list[str]:
    """Writes a technique as shader text that an engine includes, with a page about it.

    technique : one that has a kit, or its name; its options are the text's defaults.
    folder : to be made, empty, or of an export before; appears whole or not at all.
    language : "glsl", "hlsl", "wgsl", "metal" or "slang".
    depth_range : near and far of transparent geometry, in units of depth, finite with near < far,
        and positive but where depth is warped linearly or not at all: they make the two constants
        that warp depth, which an engine may set itself. None: 0.1 and 1000.

    In the folder are one include without dependencies, `targets.json` (formats, clear values, blend
    functions, passes, bindings) and `README.md`: how to call it, options, limits, measured error.
    Where a network's weights are too many for constants a fourth has the bytes of a uniform buffer.

    Returns the paths of the files. Raises ValueError where there is no such language, or the
    technique has no such text (the message says why, and which is nearest); FileExistsError
    where the folder holds other files.

    >>> files = moit.export("wboit", "kit", language="wgsl")
    >>> [one.split("/")[-1] for one in files]
    ['README.md', 'moit_wboit.wgsl', 'targets.json']
    """
    one_of("language", language, tuple(LANGUAGES))
    near, far = DEPTH_RANGE if depth_range is None else _two_numbers(depth_range)
    name = path_name(folder, "folder")
    _must_be_ours(name)
    found = technique_of(technique)
    _range_for(found, near, far)
    recipe = recipe_of(found, (near, far))
    include = include_of(found, recipe, LANGUAGES[language])
    contents: dict[str, str | bytes] = {
        include.name: include.text,
        TABLE: json_of(table_of(found, recipe, include)),
        PAGE: page_of(found, recipe, include),
    }
    contents |= {one.file: one.content for one in include.buffers if one.file}
    _write(name, contents)
    return [os.path.join(name, one) for one in sorted(contents)]


def _two_numbers(depth_range: Any) -> tuple[float, float]:
    try:
        if isinstance(depth_range, str | bytes | Set | Mapping):  # no order, or letters
            raise TypeError
        near, far = (float(one) for one in depth_range)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"depth_range: expected (near, far), got {depth_range!r:.80}") from None
    return near, far


def _range_for(technique: Technique, near: float, far: float) -> None:
    """Of what takes logarithms and quotients of depth, both are positive."""
    positive = technique.depth_warp not in ("linear", "none")
    least = 0 if positive else float("-inf")
    if not least < near < far < float("inf"):
        needed = "0 < near < far" if positive else "near < far"
        raise ValueError(f"depth_range: expected {needed}, both finite, got {(near, far)}")
    floats = np.finfo(np.float32)
    least, most = float(floats.tiny if positive else -floats.max), float(floats.max)
    if not (near >= least and far <= most and np.float32(near) < np.float32(far)):
        raise ValueError(
            f"depth_range: expected near and far that floats of a shader hold and tell apart, got "
            f"{(near, far)}"
        )


def _must_be_ours(folder: str) -> None:
    """Nothing that is not of an export before is ever replaced."""
    if not os.path.lexists(folder):
        return
    if not os.path.isdir(folder):
        raise FileExistsError(f"folder: {folder!r} is a file; needed a folder")
    found = set(os.listdir(folder))
    ours = set()
    with suppress(OSError, ValueError, TypeError, KeyError, RecursionError):
        with open(os.path.join(folder, TABLE), encoding="utf-8") as file:
            table = json.load(file)
        # a README.md alone, or another program's table, is no export
        if {"moit", "technique", "language", "digest"} <= table.keys():
            files = {one["file"] for one in table.get("buffers", ())}
            ours = {PAGE, TABLE, table["include"], *files}
    if others := sorted(found - ours):
        raise FileExistsError(
            f"folder: {folder!r} holds {others[0]!r}; needed a new or empty folder, or one of an "
            "export before"
        )


def _write(folder: str, contents: Mapping[str, str | bytes]) -> None:
    with writing_folder(folder) as part:
        for name, content in contents.items():
            with open(os.path.join(part, name), "xb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
