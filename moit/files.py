"""Files of fragments (.npz), and files that appear whole or not at all."""

from __future__ import annotations

import os
import secrets
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.exceptions import FragmentsError
from moit.fragments import Fragments

ARRAYS = ("offsets", "depth", "alpha", "color", "transmission")
FACTS = ("shape", "depth_range", "origin")
OPTIONAL = ("color", "transmission")


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[str]:
    """A path in the same folder and with the same ending to write to; it becomes `path` when the
    block ends, and is removed when it raises: readers see the old file or the new one."""
    target = os.path.realpath(os.fspath(path))
    folder, name = os.path.split(target)
    if os.path.isdir(target):
        raise IsADirectoryError(f"{os.fspath(path)!r} is a folder")
    stem, ending = os.path.splitext(name)
    part = os.path.join(folder, f".{stem}.{secrets.token_hex(6)}{ending}")
    try:
        yield part
        os.replace(part, target)
    except BaseException:
        with suppress(OSError):
            os.unlink(part)
        raise


def save(path: str | os.PathLike[str], f: Fragments) -> None:
    """Writes `f` to an .npz file that `load` and `numpy.load` read.

    The file appears whole or not at all. Raises OSError.
    """
    if not isinstance(f, Fragments):
        raise TypeError(f"f: expected Fragments, got {type(f).__name__}")
    held = {name: getattr(f, name) for name in ARRAYS if getattr(f, name) is not None}
    facts = {
        "shape": np.array(f.shape, np.int64),
        "depth_range": np.array(f.depth_range, np.float64),
        "origin": np.array(f.origin, np.int64),
    }
    with replacing(path) as part, open(part, "xb") as file:
        np.savez(file, **held, **facts)


def load(path: str | os.PathLike[str]) -> Fragments:
    """The Fragments that `save` wrote, checked as any others.

    Raises FragmentsError for what is not such a file or is damaged, OSError where it cannot be
    read.
    """
    name = os.fspath(path)
    with open(name, "rb") as file:
        try:
            found = _members(file)
        except (zipfile.BadZipFile, zlib.error, ValueError, EOFError, KeyError) as error:
            raise FragmentsError(f"{name!r}: not a readable .npz of Fragments: {error}") from error
    missing = [key for key in (*ARRAYS, *FACTS) if key not in found and key not in OPTIONAL]
    if missing:
        raise FragmentsError(
            f"{name!r}: not an .npz of Fragments: there is no {missing[0]!r} in it"
        )
    try:
        return Fragments(
            found["offsets"],
            found["depth"],
            found["alpha"],
            found.get("color"),
            transmission=found.get("transmission"),
            shape=found["shape"],
            depth_range=found["depth_range"],
            origin=found["origin"],
        )
    except FragmentsError as error:
        raise type(error)(f"{name!r}: {error}") from None


def _members(file: Any) -> dict[str, NDArray[Any]]:
    with np.load(file, allow_pickle=False) as archive:
        return {key: archive[key] for key in (*ARRAYS, *FACTS) if key in archive}
