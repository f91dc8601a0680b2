"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from moit.checks.arguments import path_name


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


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a file that appears whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """The same of bytes."""
    with replacing(path) as part, open(part, "xb") as file:
        file.write(content)
