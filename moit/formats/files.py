"""Files of fragments (.npz)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from moit.checks.arguments import path_name
from moit.checks.exceptions import FragmentsError
from moit.formats.exr_headers import packed_frame, unpacked_frame
from moit.formats.limits import TooMuchMemory, memory_for
from moit.formats.npz import members
from moit.fragments.fragments import Fragments
from moit.fragments.frame import Frame
from moit.system.files import writing

NEEDED = ("offsets", "depth", "alpha", "shape", "depth_range", "origin")
OPTIONAL = ("color", "transmission", "back", "emission", "deviation")


def save(path: str | os.PathLike[str], f: Fragments) -> None:
    """Writes `f` to an .npz file, which `load` and `numpy.load` read.

    path : used as it is; no ending is added. The file appears whole or not at all.

    Raises TypeError where `f` is not Fragments, OSError where the file cannot be written.

    >>> moit.save("panes.npz", moit.scenes.load("panes", (8, 6)))
    >>> moit.load("panes.npz").shape
    (6, 8)
    """
    if not isinstance(f, Fragments):
        raise TypeError(f"f: expected Fragments, got {type(f).__name__}")
    held: dict[str, Any] = {"offsets": f.offsets, "depth": f.depth, "alpha": f.alpha}
    held |= {name: getattr(f, name) for name in OPTIONAL if getattr(f, name) is not None}
    held["shape"] = np.array(f.shape, np.int64)
    held["depth_range"] = np.array(f.depth_range, np.float64)
    held["origin"] = np.array(f.origin, np.int64)
    if f.frame is not None:
        held["frame"] = np.frombuffer(packed_frame(f.frame), np.uint8)
    with writing(path) as file:
        np.savez(file, **held)


def load(path: str | os.PathLike[str], *, memory: int | None = None) -> Fragments:
    """The Fragments that `save` wrote, checked as any others; pickled objects are not read.

    memory : bytes that its arrays may take, which compressed ones do not show; by default 1 GiB,
        or 64 times the file's size where that is more.

    Raises FragmentsError for a file that holds something else, is damaged or needs more memory,
    OSError for one that cannot be read.

    >>> moit.save("panes.npz", moit.scenes.load("panes", (8, 6)))
    >>> moit.load("panes.npz").shape
    (6, 8)
    """
    name = path_name(path)
    with open(name, "rb") as file:
        most = memory_for(memory, os.fstat(file.fileno()).st_size)
        try:
            found = members(file, (*NEEDED, *OPTIONAL, "frame"), most)
        except TooMuchMemory as error:
            raise FragmentsError(f"{name!r}: {error.with_argument()}") from None
        except ValueError as error:
            raise FragmentsError(f"{name!r}: not a readable .npz of Fragments: {error}") from error
    for key in NEEDED:
        if key not in found:
            raise FragmentsError(f"{name!r}: not an .npz of Fragments: there is no {key!r} in it")
    arrays = [found.pop(key) for key in ("offsets", "depth", "alpha")]
    packed = found.pop("frame", None)
    try:
        return Fragments(*arrays, frame=_frame(packed), **found)
    except FragmentsError as error:
        raise type(error)(f"{name!r}: {error}") from None


def _frame(packed: Any) -> Frame | None:
    if packed is None:
        return None
    try:
        return unpacked_frame(packed.astype(np.uint8, casting="equiv").tobytes())
    except (TypeError, ValueError) as error:
        raise FragmentsError(f"frame: {error}") from error
