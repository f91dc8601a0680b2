"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

from moit.checks.arguments import path_name

# Why a disk takes no more, and what a message says of it.
NO_SPACE = {
    errno.ENOSPC: "no space left on its disk",
    errno.EDQUOT: "no space left in the user's quota",
    errno.EFBIG: "no space: larger than this process may write",
}

# How names begin of what is being written.
PART = ".moit-"

# How often a folder is tried to be put in place, where other processes do the same.
EXCHANGES = 100

# What `lost` tries to write to learn why a library could not.
TRIED = 1 << 16


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[str]:
    """A path to write to, in the same folder and with the same ending as `path`.

    What was written there becomes `path` when the block ends and is on the disk by then; it is
    removed when the block raises: readers see the old file or the new one, never a part, also
    after the machine stops. A link stays and its target changes. `writing` is for what is
    written by Python; libraries, which may lose an error of the system, are given this path, and
    whether they wrote all is asked before the block ends: `lost` is what to raise then.

    Raises OSError that names `path`.
    """
    target, part = _target_and_part(path)
    folder = os.path.dirname(target)
    try:
        yield part
        with open(part, "r+b") as file:
            _to_disk(file.fileno())
        os.replace(part, target)
    except BaseException as error:
        with suppress(OSError):
            os.unlink(part)
        if isinstance(error, OSError) and (error.errno in NO_SPACE or error.filename == part):
            text = NO_SPACE.get(error.errno or 0, error.strerror)
            raise OSError(error.errno, f"cannot be written: {text}", target) from error
        raise
    with suppress(OSError):  # not every system opens folders; the file itself is safe
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def _target_and_part(path: str | os.PathLike[str]) -> tuple[str, str]:
    """What is replaced, behind all links, and a name beside it to write to before."""
    target = os.path.realpath(path_name(path))
    folder, name = os.path.split(target)
    if os.path.isdir(target):
        raise IsADirectoryError(errno.EISDIR, "cannot write a file over a folder", target)
    if os.path.exists(target) and not os.path.isfile(target):  # a device would be gone for all
        raise OSError(errno.EINVAL, "can replace nothing but a regular file", target)
    if not os.path.isdir(folder):
        raise FileNotFoundError(errno.ENOENT, "there is no such folder", folder)
    ending = os.path.splitext(name)[1]
    return target, os.path.join(folder, f"{PART}{os.urandom(8).hex()}{ending}")


def must_be_writable(path: str | os.PathLike[str]) -> None:
    """Raises the OSError that `replacing` would, before what takes long is done for it: where the
    folder is not there, or takes no file, or `path` is nothing that a file may replace."""
    target, part = _target_and_part(path)
    try:
        # not open(), which without memory for a buffer fails when the file is there already
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
        os.unlink(part)
    except OSError as error:
        raise OSError(error.errno, f"cannot be written: {error.strerror}", target) from error


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file to write to, which becomes `path` as that of `replacing` does."""
    with replacing(path) as part, open(part, "xb") as file:
        yield file


def remove(path: str | os.PathLike[str]) -> None:
    """Removes a file, which another process may do at the same time."""
    with suppress(FileNotFoundError):
        os.unlink(path)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a file that appears whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """The same of bytes."""
    with writing(path) as file:
        file.write(content)


@contextmanager
def writing_folder(path: str | os.PathLike[str]) -> Iterator[str]:
    """A new folder to write files to, which becomes `path` when the block ends: the old one, with
    all that is in it, or the new one is there, but for an instant between two names in which there
    is neither. It is removed when the block raises.

    Raises OSError that names `path`; so for no name, which would be the folder this process works
    in, and for that folder and what it lies in: they would be gone under its feet.
    """
    if not path_name(path):
        raise FileNotFoundError(errno.ENOENT, "a folder needs a name", "")
    target = os.path.realpath(path_name(path))
    if _works_in(target):
        raise OSError(errno.EBUSY, "cannot replace the folder one works in; name another", target)
    around = os.path.dirname(target)
    if not os.path.isdir(around):
        raise FileNotFoundError(errno.ENOENT, "there is no such folder", around)
    part = os.path.join(around, f"{PART}{os.urandom(8).hex()}")
    old = f"{part}-old"
    try:
        os.mkdir(part)
        yield part
        for name in os.listdir(part):
            with open(os.path.join(part, name), "r+b") as file:
                _to_disk(file.fileno())
        _exchange(part, target, old)
    except BaseException as error:
        _remove_folder(part)
        if isinstance(error, OSError):
            text = NO_SPACE.get(error.errno or 0, error.strerror)
            raise OSError(error.errno, f"cannot be written: {text}", target) from error
        raise
    _remove_folder(old)


def _exchange(part: str, target: str, old: str) -> None:
    """`part` becomes `target`, and what was that becomes `old`; or all is as it was."""
    for left in reversed(range(EXCHANGES)):
        with suppress(FileNotFoundError):  # another process may have just taken it away
            os.rename(target, old)
        try:
            os.rename(part, target)
        except BaseException as error:  # Ctrl-C too
            again = isinstance(error, OSError) and error.errno in (errno.ENOTEMPTY, errno.EEXIST)
            if again and left:  # another process has just put its own there
                _remove_folder(old)
                continue
            with suppress(OSError):
                os.rename(old, target)
            raise
        return


def _works_in(folder: str) -> bool:
    """Whether this process's own folder is this one, or lies in it."""
    try:
        own = os.path.realpath(os.getcwd())
    except OSError:  # it is gone
        return False
    return os.path.commonpath([own, folder]) == folder


def lost(part: str, name: str, said: str) -> OSError:
    """What to raise where a library did not write all of `part`, which was to become `name`.

    said : what the library says of it, which seldom is the system's reason: that is found by
        trying to write some more. `part` is of no use afterwards.
    """
    try:
        with open(part, "ab", buffering=0) as file:
            left = TRIED
            while left:
                left -= file.write(bytes(left))
            os.fsync(file.fileno())
    except OSError as error:
        text = NO_SPACE.get(error.errno or 0, error.strerror)
        return OSError(error.errno, f"cannot be written: {text}", name)
    return OSError(f"{name!r}: {said}")


def _to_disk(opened: int) -> None:
    """Disks on a network and those that allocate late say only now that they are full."""
    try:
        os.fsync(opened)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # there is nothing to wait for
            raise


def _remove_folder(folder: str) -> None:
    """With all that is in it, as far as that goes."""
    import shutil  # late: `import moit` stays quick

    shutil.rmtree(folder, ignore_errors=True)
