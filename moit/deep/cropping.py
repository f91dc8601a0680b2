"""Windows of deep files."""

from __future__ import annotations

import os
from collections.abc import Sequence

from moit.checks.windows import origin_of, size_of
from moit.deep.opened import Deep, bands_of, opened
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_output import deep_output
from moit.system.progress import Progress


def crop(
    path: Deep,
    output: str | os.PathLike[str],
    shape: Sequence[int],
    origin: Sequence[int],
    *,
    part: int | str | None = None,
    compression: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes the samples of a window of a deep OpenEXR file, with all their channels, to the bit.

    path, part : as `read_deep`. No layer is chosen: a file may lack any channel.
    shape : (height, width) of the window, which becomes the data window.
    origin : (y, x) of its first pixel on the display, in the file's coordinates. Pixels that the
        file has none of are empty. The display window stays.
    output, compression, memory, progress : as `moit.deep.merge`.

    Raises ValueError for a window of no pixels, or of none that the file has; else as `read_deep`
    and `write_deep`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.crop("panes.exr", "part.exr", (2, 3), (1, 4))
    >>> moit.read_deep("part.exr").shape, moit.read_deep("part.exr").origin
    ((2, 3), (1, 4))
    """
    (height, width), (top, left) = size_of(shape), origin_of(origin)
    with opened(path, part, all_layers=True) as seen:
        (y, x), (own_height, own_width) = seen.origin, seen.shape
        meets = max(top, y) < min(top + height, y + own_height) and max(left, x) < min(
            left + width, x + own_width
        )
        if not meets:
            raise ValueError(
                f"origin: {seen.name!r} has pixels from (y, x) = {(y, x)} to "
                f"{(y + own_height - 1, x + own_width - 1)}; found none of them in a window of "
                f"{height} x {width} from {(top, left)}"
            )
        place = seen.place((height, width), (top, left))
        with deep_output(os.fspath(output), place, seen.types, compression) as out:
            for (rows,) in bands_of([seen], top, top + height, memory, progress, width):
                out.put(rows.columns(left, width))
