"""Deep files as one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.exceptions import FragmentsError
from moit.deep.opened import Deep, Opened, all_opened, bands_of
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_channels import COLOR, COLORED_ALPHA
from moit.formats.deep_output import deep_output
from moit.formats.deep_rows import DeepRows, side_by_side
from moit.fragments.fragments import Fragments
from moit.system.environment import thread_count
from moit.system.progress import Progress


def merge(
    paths: Iterable[Deep],
    output: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    compression: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes the samples of several deep OpenEXR files as one, each pixel's front to back.

    paths : at least one file, or Fragments, which are taken as `write_deep` writes them: as in all
        of these functions. The data window is the union of theirs; display window, pixel aspect
        and metadata are those of the first.
    output : the file, which appears whole or not at all.
    part, layer : of each, as `read_deep`. The other parts of the first file are copied as they are.
    compression : "zstd", "zips", "rle" or "none"; None: the first of them that the OpenEXR at hand
        has.
    memory : bytes that a band of rows may take, about; files may be larger than memory.
    progress : see `moit.compare`.

    No sample is changed, and none mixed or dropped, so what ids or layers there are stay: channels
    are those of all, 0 where a file lacks one, ZBack its Z, an alpha for each colour its A, and A
    their mean; the type is float where one has float. Samples at one depth keep the files' order.
    The order of the files and of merges changes nothing else: what is seen of a pixel hangs on its
    samples only.

    Raises FragmentsError where some have colour and others not, where colour, alpha or depth have
    other names in one than in another (layers, or Y for R, G and B), where a channel is a whole
    number in one and not in another, and for depths that are not numbers; else as `read_deep` and
    `write_deep`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.merge(["panes.exr", "panes.exr"], "twice.exr")
    >>> moit.inspect("twice.exr").parts[0].samples
    108
    """
    if isinstance(paths, str | os.PathLike | Fragments) or not isinstance(paths, Iterable):
        raise TypeError(f"paths: expected a list of paths, got {type(paths).__name__}")
    names = list(paths)
    if not names:
        raise ValueError("paths: expected at least one file, got none")
    with all_opened(names, part, layer) as inputs:
        roles = names_of(inputs)
        types = types_of(inputs)
        shape, origin = union_of(inputs)
        place = inputs[0].place(shape, origin)
        with deep_output(os.fspath(output), place, types, compression) as out:
            bottom, width = origin[0] + shape[0], shape[1]
            for bands in bands_of(inputs, origin[0], bottom, memory, progress, width):
                pairs = zip(inputs, bands, strict=True)
                alike = [
                    with_types(one, rows, types, roles).columns(origin[1], width)
                    for one, rows in pairs
                ]
                out.put(in_front_first(side_by_side(alike)[0], roles))


def names_of(inputs: Sequence[Opened]) -> dict[str, str]:
    """The channel of each role in a merge. What has a role in several files must have one name in
    all, as a reader of the merge takes one layer for the image."""
    colored = [bool({*COLOR} & {*one.part.names}) for one in inputs]
    if any(colored) and not all(colored):
        raise FragmentsError(
            f"merge: color must be present in all or in none; it is in "
            f"{inputs[colored.index(True)].name!r} and not in {inputs[colored.index(False)].name!r}"
        )
    found: dict[str, tuple[str, str]] = {}
    for one in inputs:
        for role, name in one.part.names.items():
            before, where = found.setdefault(role, (name, one.name))
            if before != name:
                raise FragmentsError(
                    f"merge: {role} is the channel {before!r} in {where!r}, and {name!r} in "
                    f"{one.name!r}; needed one name in all"
                )
    return {role: name for role, (name, _) in found.items()}


def types_of(inputs: Sequence[Opened]) -> dict[str, Any]:
    """The dtype of each channel of a merge."""
    types: dict[str, Any] = {}
    for one in inputs:
        for name, kind in one.types.items():
            held = types.setdefault(name, kind)
            if (held == np.uint32) != (kind == np.uint32):
                raise FragmentsError(
                    f"merge: {name} is a whole number in one file and not in another; that is "
                    f"{one.name!r}"
                )
            types[name] = np.promote_types(held, kind).type
    return types


def union_of(inputs: Sequence[Opened]) -> tuple[tuple[int, int], tuple[int, int]]:
    """(height, width) and (y, x) of the union of the data windows."""
    top, left = (min(one.origin[k] for one in inputs) for k in (0, 1))
    bottom, right = (max(one.origin[k] + one.shape[k] for one in inputs) for k in (0, 1))
    return (bottom - top, right - left), (top, left)


def with_types(
    one: Opened, rows: DeepRows, types: dict[str, Any], names: Mapping[str, str]
) -> DeepRows:
    """Rows of one of the files with the channels of all, of which `names` have roles. Raises
    FragmentsError for depths that have no order."""
    own = one.part.names
    for role in ("Z", "ZBack"):
        if role in own:
            one.depth(rows, own[role])
    stand_in: dict[str, NDArray[Any]] = {}
    if "ZBack" in names:
        stand_in[names["ZBack"]] = rows.channels[own["Z"]]
    if "AR" in names and "AR" not in own:
        stand_in |= {names[role]: rows.channels[own["A"]] for role in COLORED_ALPHA}
    if "A" in names and "A" not in own:
        colored = [rows.channels[own[role]] for role in COLORED_ALPHA]
        stand_in[names["A"]] = np.stack(colored).mean(axis=0, dtype=np.float64)

    def channel(name: str, kind: Any) -> NDArray[Any]:
        held = rows.channels.get(name, stand_in.get(name))
        return np.zeros(len(rows), kind) if held is None else held.astype(kind, copy=False)

    return rows.with_channels({name: channel(name, kind) for name, kind in types.items()})


def in_front_first(rows: DeepRows, names: Mapping[str, str]) -> DeepRows:
    """The same samples, each pixel's front to back, and by their ends; where both are the same they
    keep their order."""
    if _are_in_order(rows, names["Z"]):
        return rows
    channels, depth = dict(rows.channels), names["Z"]
    for name in (names.get("ZBack"), depth):  # the last decides
        if name is not None:
            key = channels[name].astype(np.float32, copy=False)
            order = _core.depth_order(rows.offsets, key, thread_count(None))
            channels = {one: array[order] for one, array in channels.items()}
    return rows.with_channels(channels)


def _are_in_order(rows: DeepRows, depth: str) -> bool:
    """Whether each pixel's samples are front to back and differ in depth: as most files are."""
    rises = np.empty(len(rows) + 1, np.bool_)
    rises[0] = rises[-1] = True
    np.less(rows.channels[depth][:-1], rows.channels[depth][1:], out=rises[1:-1])
    rises[rows.offsets] = True  # of two pixels nothing is asked
    return bool(rises.all())
