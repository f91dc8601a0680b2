"""Files of fragments (.npz), and files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from moit.checks.arguments import path_name
from moit.checks.exceptions import FragmentsError
from moit.formats.npz import members
from moit.fragments.fragments import Fragments

NEEDED = ("offsets", "depth", "alpha", "shape", "depth_range", "origin")
OPTIONAL = ("color", "transmission")


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[str]:
    """A path to write to, in the same folder and with the same ending as `path`.

    What was written there becomes `path` when the block ends and is removed when it raises:
    readers see the old file or the new one, never a part. A link stays and its target changes.
    """
    target = os.path.realpath(path_name(path))
    folder, name = os.path.split(target)
    if os.path.isdir(target):
        raise IsADirectoryError(errno.EISDIR, "cannot write a file over a folder", target)
    if os.path.exists(target) and not os.path.isfile(target):  # a device would be gone for all
        raise OSError(errno.EINVAL, "can replace nothing but a regular file", target)
    if not os.path.isdir(folder):
        raise FileNotFoundError(errno.ENOENT, "there is no such folder", folder)
    part = os.path.join(folder, f".moit-{secrets.token_hex(8)}{os.path.splitext(name)[1]}")
    try:
        yield part
        os.replace(part, target)
    except BaseException:
        with suppress(OSError):
            os.unlink(part)
        raise


def save(path: str | os.PathLike[str], f: Fragments) -> None:
    """Writes `f` to an .npz file, which `load` and `numpy.load` read.

    path : used as it is; no ending is added. The file appears whole or not at all.

    Raises TypeError where `f` is not Fragments, OSError where the file cannot be written.
    """
    if not isinstance(f, Fragments):
        raise TypeError(f"f: expected Fragments, got {type(f).__name__}")
    held: dict[str, Any] = {"offsets": f.offsets, "depth": f.depth, "alpha": f.alpha}
    held |= {name: getattr(f, name) for name in OPTIONAL if getattr(f, name) is not None}
    held["shape"] = np.array(f.shape, np.int64)
    held["depth_range"] = np.array(f.depth_range, np.float64)
    held["origin"] = np.array(f.origin, np.int64)
    with replacing(path) as part, open(part, "xb") as file:
        np.savez(file, **held)


def load(path: str | os.PathLike[str]) -> Fragments:
    """The Fragments that `save` wrote, checked as any others; pickled objects are not read.

    Raises FragmentsError for a file that holds something else or is damaged, OSError for one
    that cannot be read.
    """
    name = path_name(path)
    with open(name, "rb") as file:
        try:
            found = members(file, (*NEEDED, *OPTIONAL))
        except MemoryError:
            raise
        except Exception as error:  # zipfile and NumPy raise many kinds for damaged files
            raise FragmentsError(f"{name!r}: not a readable .npz of Fragments: {error}") from error
    for key in NEEDED:
        if key not in found:
            raise FragmentsError(f"{name!r}: not an .npz of Fragments: there is no {key!r} in it")
    arrays = (found["offsets"], found["depth"], found["alpha"], found.get("color"))
    facts = {key: found[key] for key in ("shape", "depth_range", "origin")}
    try:
        return Fragments(*arrays, transmission=found.get("transmission"), **facts)
    except FragmentsError as error:
        raise type(error)(f"{name!r}: {error}") from None
