"""Deep files as flat pictures."""

from __future__ import annotations

import os

from moit.deep.opened import Deep, as_file
from moit.deep_composites import composite_deep
from moit.formats.deep_bands import USUAL_MEMORY
from moit.system.progress import Progress


def flatten(
    path: Deep,
    output: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes a deep OpenEXR file as a picture: exactly, as "sorted" composites it over black.

    path, part, layer, memory, progress : as `read_deep_bands`.
    output : .exr of light, multiplied by alpha, and alpha; or .png.

    Volumes are split and mixed where samples overlap. Windows and metadata are those of `path`.
    Raises as `moit.composite_deep`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.flatten("panes.exr", "flat.exr")
    >>> moit.read_image("flat.exr").shape
    (6, 8, 4)
    """
    with as_file(path) as name:
        composite_deep(
            name, output, "sorted", part=part, layer=layer, memory=memory, progress=progress
        )
