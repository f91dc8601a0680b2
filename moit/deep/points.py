"""Deep samples as coloured points in space."""

from __future__ import annotations

import math
import numbers
import os
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import path_name
from moit.checks.exceptions import FragmentsError
from moit.deep.opened import Deep, Opened, bands_of, opened
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_channels import COLOR
from moit.formats.deep_rows import DeepRows
from moit.geometry.camera import Camera
from moit.reports.pictures import srgb8
from moit.system.files import writing
from moit.system.progress import Progress

Doubles = NDArray[np.float64]

POINT = np.dtype(
    [(name, "<f4") for name in "xyz"] + [(name, "u1") for name in ("red", "green", "blue", "alpha")]
)
DIGITS = 20  # of the number of points, which the header says before it is known


def to_points(
    path: Deep,
    output: str | os.PathLike[str],
    camera: Camera | None = None,
    *,
    least_alpha: float = 0.0,
    part: int | str | None = None,
    layer: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> int:
    """Writes the samples of a deep OpenEXR file as a .ply of coloured points; returns how many.

    path, part, layer : as `read_deep`.
    output : a binary .ply with x, y, z as float and red, green, blue (encoded as sRGB) and alpha as
        uchar. It appears whole or not at all.
    camera : the one that the image was taken by; its picture is the display window. None: the one
        that the header says, by worldToCamera and worldToNDC as renderers write them.
    least_alpha : in [0, 1]; samples of less are left out, as are those at infinity.
    memory, progress : as `moit.deep.merge`.

    A point lies in the middle of its pixel, at a sample's Z along the view, of a volume in the
    middle between Z and ZBack. Its colour is the sample's, not multiplied by alpha, 0.5 where the
    file has none.

    Raises FragmentsError where no camera is given and the header has none, else as `read_deep`.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.to_points("panes.exr", "panes.ply", moit.Camera())
    54
    """
    if camera is not None and not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")
    if isinstance(least_alpha, bool) or not isinstance(least_alpha, numbers.Real):
        raise TypeError(f"least_alpha: expected a number, got {type(least_alpha).__name__}")
    if not 0 <= float(least_alpha) <= 1:
        raise ValueError(f"least_alpha: expected a number in [0, 1], got {least_alpha}")
    with opened(path, part, layer) as seen, writing(path_name(output)) as file:
        unproject = _by_header(seen) if camera is None else _by_camera(camera, seen)
        place = _write_header(file)
        count, top = 0, seen.origin[0]
        for (rows,) in bands_of([seen], top, top + seen.shape[0], memory, progress):
            points = _points(seen, rows, unproject, float(least_alpha))
            file.write(points.tobytes())
            count += len(points)
        file.seek(place)
        file.write(f"{count:0{DIGITS}d}".encode())
    return count


def _write_header(file: BinaryIO) -> int:
    """Returns where the number of points is to be."""
    start = b"ply\nformat binary_little_endian 1.0\ncomment by moit\nelement vertex "
    lines = [f"property float {name}" for name in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue", "alpha")]
    file.write(start + b"0" * DIGITS + b"\n" + "\n".join([*lines, "end_header", ""]).encode())
    return len(start)


def _points(seen: Opened, rows: DeepRows, unproject: Any, least_alpha: float) -> NDArray[Any]:
    own = seen.samples(rows)
    alpha = own.alpha.astype(np.float64).mean(axis=0)
    depth = own.front.astype(np.float64)
    if own.back is not None:
        depth = 0.5 * depth + 0.5 * own.back
    kept = (alpha >= least_alpha) & (np.abs(depth) < float(np.finfo(np.float32).max) / 4)
    pixel = np.repeat(np.arange(len(rows.offsets) - 1), np.diff(rows.offsets))[kept]
    y, x = np.divmod(pixel, rows.shape[1])
    found = np.zeros(len(pixel), POINT)
    places = unproject(x + rows.origin[1] + 0.5, y + rows.origin[0] + 0.5, depth[kept])
    for name, values in zip("xyz", places.T, strict=True):
        found[name] = values
    color = np.full((len(pixel), 3), 0.5)
    names = seen.part.names
    if "R" in names:
        for c, role in enumerate(COLOR):
            light = seen.light(rows, names[role])[kept].astype(np.float64)
            covers = own.alpha[c if len(own.alpha) > 1 else 0][kept]
            color[:, c] = np.divide(light, covers, out=light.copy(), where=covers > 0)
    for name, values in zip(("red", "green", "blue"), srgb8(color[None])[0].T, strict=True):
        found[name] = values
    found["alpha"] = np.rint(255 * alpha[kept])
    return found


def _on_screen(seen: Opened, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
    """Places on the display window, as [-1, 1] to the right and up."""
    frame = seen.header.frame()
    (top, left), (height, width) = frame.display_origin, frame.display_shape
    return 2 * (x - left) / width - 1, 1 - 2 * (y - top) / height


def _by_camera(camera: Camera, seen: Opened) -> Any:
    height, width = seen.header.frame().display_shape
    aspect = seen.header.frame().pixel_aspect
    vertical = 1 / math.tan(camera.fov_y / 2)
    across = vertical * height / (width * aspect)
    right, up, forward = camera.axes

    def unproject(x: Doubles, y: Doubles, depth: Doubles) -> Doubles:
        u, v = _on_screen(seen, x, y)
        sides = (u / across)[:, None] * right + (v / vertical)[:, None] * up + forward
        points: Doubles = np.array(camera.eye) + depth[:, None] * sides
        return points

    return unproject


def _by_header(seen: Opened) -> Any:
    """By the matrices of a header, for row vectors: a point in the camera's space, with z = depth,
    is where the projection leads to the pixel."""
    metadata = seen.header.frame().metadata
    found = []
    for name in ("worldToCamera", "worldToNDC"):
        value = metadata.get(name)
        if not (isinstance(value, tuple) and len(value) == 16):
            raise FragmentsError(
                f"camera: {seen.name!r} has no {name} of 4 x 4 numbers in its header; needed a "
                "Camera"
            )
        found.append(np.array(value, np.float64).reshape(4, 4))
    try:
        to_world = np.linalg.inv(found[0])
    except np.linalg.LinAlgError:
        raise FragmentsError(f"camera: worldToCamera of {seen.name!r} has no inverse") from None
    m = to_world @ found[1]

    def unproject(x: Doubles, y: Doubles, depth: Doubles) -> Doubles:
        u, v = _on_screen(seen, x, y)
        # (X, Y, depth, 1) m = (u w, v w, ., w), of which X and Y are unknown
        a, b = m[0, 0] - u * m[0, 3], m[1, 0] - u * m[1, 3]
        c, d = m[0, 1] - v * m[0, 3], m[1, 1] - v * m[1, 3]
        e = u * (depth * m[2, 3] + m[3, 3]) - (depth * m[2, 0] + m[3, 0])
        f = v * (depth * m[2, 3] + m[3, 3]) - (depth * m[2, 1] + m[3, 1])
        whole = a * d - b * c
        points = np.stack([(e * d - b * f) / whole, (a * f - e * c) / whole, depth], axis=1)
        world: Doubles = points @ to_world[:3, :3] + to_world[3, :3]
        return world

    return unproject
