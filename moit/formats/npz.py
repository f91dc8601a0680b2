"""Arrays of .npz files that others may have made: nothing is unpickled or believed unseen."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Collection
from typing import Any, BinaryIO

from numpy.lib import format as npy

# Deflate makes nothing smaller than this: a member that claims more is not read.
BEST_COMPRESSION = 1032


def members(file: BinaryIO, names: Collection[str], most: float = math.inf) -> dict[str, Any]:
    """Those of the arrays `names` that are there, each read only where its size is what its
    header says, and at most `most` bytes.

    Raises ValueError, and what zipfile and NumPy raise for damaged files, which is many kinds.
    """
    found = {}
    with zipfile.ZipFile(file) as archive:
        infos = {info.filename: info for info in archive.infolist()}
        for name in names:
            info = infos.get(f"{name}.npy")
            if info is None:
                continue
            if info.file_size > most:
                raise ValueError(f"{name} has {info.file_size} bytes")
            with archive.open(info) as member:
                version = npy.read_magic(member)
                if version not in ((1, 0), (2, 0)):
                    raise ValueError(f"{name} is written in format {version}, not 1.0 or 2.0")
                read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
                shape, _, dtype = read(member)
                said = math.prod(shape) * dtype.itemsize
                there = info.file_size - member.tell()
                possible = BEST_COMPRESSION * (info.compress_size + 1)
                if not dtype.hasobject and (said != there or there > possible):
                    raise ValueError(f"{name} should be {said} bytes long and is not")
                member.seek(0)
                found[name] = npy.read_array(member, allow_pickle=False)
    return found
