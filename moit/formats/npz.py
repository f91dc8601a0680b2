"""Arrays of .npz files that others may have made: nothing is unpickled or believed unseen."""

from __future__ import annotations

import errno
import math
import os
import struct
import sys
from collections.abc import Collection
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from moit.formats.limits import TooMuchMemory

if TYPE_CHECKING:
    import zipfile

# Deflate makes nothing smaller than this: a member that claims more is not read. Of the other
# methods no such bound is known, and NumPy writes none of them.
BEST_COMPRESSION = 1032
METHODS = (0, 8)  # stored and deflated, as the format numbers them

ENCRYPTED = 1  # of a member's flags

# Names of some ten arrays need a kilobyte; a list of a million members takes a gigabyte.
LONGEST_LIST = 1 << 20


def members(file: BinaryIO, names: Collection[str], memory: int) -> dict[str, Any]:
    """Those of the arrays `names` that are there: numbers and text.

    memory : bytes that all of them may take together. What each takes is known from its header,
        and asked before any is read; a header that the file cannot keep is not believed.

    Raises TooMuchMemory for more, ValueError for what is no such file: nothing else that zipfile,
    zlib and NumPy raise for damaged files, which is many kinds; OSError where it cannot be read.
    """
    try:
        return _members(file, names, memory)
    except (ValueError, MemoryError):
        raise
    except OSError as error:
        if error.errno == errno.EINVAL:  # a place before the file's beginning
            raise ValueError("its list of members is damaged") from error
        raise OSError(error.errno, error.strerror, file.name) from error
    except Exception as error:
        raise ValueError(str(error) or type(error).__name__) from error


def _members(file: BinaryIO, names: Collection[str], memory: int) -> dict[str, Any]:
    size = os.fstat(file.fileno()).st_size
    if _list_length(file, size) > LONGEST_LIST:
        raise ValueError(f"its list of members is longer than {LONGEST_LIST} bytes")
    import zipfile  # late: `import moit` stays quick

    with zipfile.ZipFile(file) as archive:
        infos = {info.filename: info for info in archive.infolist()}
        wanted = {name: infos[f"{name}.npy"] for name in names if f"{name}.npy" in infos}
        for name, info in wanted.items():
            if info.compress_type not in METHODS or info.flag_bits & ENCRYPTED:
                raise ValueError(f"{name} is neither stored nor deflated, or is encrypted")
        if sum(info.compress_size for info in wanted.values()) > size:
            raise ValueError("its members are longer than the file")
        needed = sum(info.file_size for info in wanted.values())
        if needed > memory:
            raise TooMuchMemory(needed, memory)
        for name, info in wanted.items():
            _check(archive, name, info)
        found = {}
        for name, info in wanted.items():
            with archive.open(info) as member:
                found[name] = _text_of_unicode(name, npy.read_array(member, allow_pickle=False))
    return found


def _check(archive: zipfile.ZipFile, name: str, info: zipfile.ZipInfo) -> None:
    """Raises ValueError unless an array's header says what its member has."""
    with archive.open(info) as member:
        version = npy.read_magic(member)
        if version not in ((1, 0), (2, 0)):
            raise ValueError(f"{name} is written in format {version}, not 1.0 or 2.0")
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        try:
            shape, _, dtype = read(member)
        except (MemoryError, RecursionError):  # what Python says of text that is nested deeply
            raise ValueError(f"{name} has a header that cannot be read") from None
        if dtype.kind not in "biufU" or dtype.subdtype is not None:
            raise ValueError(f"{name} holds {dtype!s:.80}; needed numbers or text")
        if any(isinstance(length, bool) or length < 0 for length in shape):
            raise ValueError(f"{name} has the shape {shape!r:.80}")
        said = math.prod(shape) * dtype.itemsize
        there = info.file_size - member.tell()
        if said != there or there > BEST_COMPRESSION * (info.compress_size + 1):
            raise ValueError(f"{name} should be {said} bytes long and is not")


def _text_of_unicode(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype.kind == "U" and array.size and array.itemsize:
        codes = np.frombuffer(array.tobytes(), np.dtype("u4").newbyteorder(array.dtype.byteorder))
        if codes.max() > sys.maxunicode:
            raise ValueError(f"{name} holds text that is not Unicode")
    return array


def _list_length(file: BinaryIO, size: int) -> int:
    """Bytes of the list of members at the end of a .zip (APPNOTE, 4.3.14 to 4.3.16)."""
    file.seek(max(0, size - (1 << 16) - 22))
    tail = file.read()
    at, length = tail.rfind(b"PK\5\6"), 0
    if at >= 0 and len(tail) >= at + 22:
        (length,) = struct.unpack_from("<I", tail, at + 12)
    locator = tail.rfind(b"PK\6\7")  # of a record with longer numbers
    if locator >= 0 and len(tail) >= locator + 20:
        said = struct.unpack_from("<Q", tail, locator + 8)[0]
        for place in (said, size - len(tail) + locator - 56):
            if 0 <= place <= size - 56:
                file.seek(place)
                record = file.read(56)
                if record.startswith(b"PK\6\6"):
                    length = max(length, struct.unpack_from("<Q", record, 40)[0])
    return int(length)
