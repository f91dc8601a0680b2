"""OpenImageIO as moit uses it: it survives a fork, and what it wrote is looked at."""

from __future__ import annotations

import functools
import os
from typing import Any

from numpy.typing import NDArray

from moit.checks.exceptions import in_one_line
from moit.system.files import lost
from moit.system.whole import is_whole

# OpenImageIO's attributes for threads, and what each is without threads of its own.
WITHOUT_THREADS = {"exr_threads": -1, "threads": 1}


@functools.cache
def image_library() -> Any:
    """The module OpenImageIO.

    A child of fork has none of the threads that the library waits for, and would wait for ever.
    So it ends them before a fork, and the parent gets new ones; a child works without: there it
    cannot begin any.
    """
    import OpenImageIO as oiio

    kept: dict[str, int] = {}

    def before() -> None:
        for name, value in WITHOUT_THREADS.items():
            kept[name] = oiio.get_int_attribute(name)
            oiio.attribute(name, value)
        oiio.ImageOutput.create("openexr")  # the attribute for its threads is heeded only here

    def in_parent() -> None:
        for name, value in kept.items():
            oiio.attribute(name, value)

    if hasattr(os, "register_at_fork"):
        os.register_at_fork(before=before, after_in_parent=in_parent)
    return oiio


def complaint(source: Any) -> str:
    """What the library, or a file of it, has to complain of, in one line; then it is forgotten.

    It quotes what stands in files, which need not be Unicode; its package raises of such words.
    """
    try:
        said: str = source.geterror()
    except UnicodeDecodeError as error:
        said = error.object.decode(errors="backslashreplace")
    return in_one_line(said)


class Written:
    """A file that OpenImageIO writes row by row.

    part : where to, as `replacing` gives it, .exr or .png. name : what it is to become.

    Raises OSError that names `name` for all that goes wrong, also where the library says that it
    wrote what it lost.
    """

    def __init__(self, part: str, name: str, spec: Any) -> None:
        self.part, self.name, self.row = part, name, spec.y
        oiio = image_library()
        file = oiio.ImageOutput.create(part)
        if file is None:
            raise OSError(f"{name!r}: {complaint(oiio)}")
        self.file = file
        self._must(file.open(part, spec))

    def put(self, rows: NDArray[Any]) -> None:
        """The next rows, as the file holds them."""
        begin, self.row = self.row, self.row + len(rows)
        self._must(self.file.write_scanlines(begin, self.row, 0, rows))

    def give_up(self) -> None:
        self.file.close()  # complains of rows that are missing
        complaint(self.file)

    def finish(self) -> None:
        self._must(self.file.close())
        if not is_whole(self.part):
            raise lost(self.part, self.name, "what OpenImageIO wrote is not whole")

    def _must(self, done: bool) -> None:
        if not done:
            said = complaint(self.file) or "OpenImageIO does not say why"
            self.give_up()
            raise lost(self.part, self.name, said)
