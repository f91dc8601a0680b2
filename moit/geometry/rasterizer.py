"""Scenes to fragments, on the CPU; what is given is checked already."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments.fragments import Fragments
from moit.fragments.merging import merge, union_of_their_ranges
from moit.geometry.camera import Camera
from moit.geometry.coplanar import by_draw_order
from moit.geometry.drawing import Drawable, Emitted, InBands, Shares, bounding_sphere
from moit.geometry.drawing import Frame as DrawingFrame
from moit.geometry.glass import emit_glass, share_through
from moit.geometry.meshes import Mesh, common_origin, joined, mesh_arrays, seen_in
from moit.geometry.textures import Texture
from moit.system.environment import thread_count

TILE = 16  # rows of pixels that what is in bands draws at once
MOST_SIDE = _core.numbers()["MOST_SIDE"]


def rasterized(
    scene: Sequence[Drawable],
    camera: Camera,
    size: tuple[int, int],
    threads: int,
    lights: NDArray[np.float64] | None = None,
    shares: Shares | None = None,
    coplanar: float | None = None,
    antialias: bool = False,
) -> Fragments:
    """The fragments of a picture, as `moit.rasterize` has them; lights and shares as a Frame's."""
    frame = camera.frame(size, threads, lights, shares, coplanar is not None, antialias)
    if coplanar is None:
        return Picture(scene, camera, frame).rows(0, size[1])
    emitted = [kind.emit(some, frame) for kind, _, some in _kinds(scene)]
    one = _merged(emitted, size) if len(emitted) > 1 else emitted[0]
    return in_range(one, transparent_range(scene, camera, antialias), size, coplanar)


def _kinds(scene: Sequence[Drawable]) -> list[tuple[Any, float, list[Any]]]:
    """Those of one class, and one share that goes through, that follow one another."""
    found = itertools.groupby(scene, lambda one: (type(one), share_through(one)))
    return [(kind, share, list(some)) for (kind, share), some in found] or [(Mesh, 0.0, [])]


class Picture:
    """The fragments of a picture, in bands of rows; what is not `InBands` is held as a whole."""

    def __init__(self, scene: Sequence[Drawable], camera: Camera, frame: DrawingFrame) -> None:
        self.size = frame.size
        self.span = transparent_range(scene, camera, frame.antialias)
        self.parts: list[Fragments | InBands] = []
        for kind, share, some in _kinds(scene):
            if share:
                arrays, through = emit_glass(some, frame)
                self.parts.append(in_range(arrays, self.span, self.size, None, through))
            elif hasattr(kind, "begin"):
                self.parts.append(kind.begin(some, frame))
            else:
                self.parts.append(in_range(kind.emit(some, frame), self.span, self.size))
        ranged = [
            one if isinstance(one, Fragments) else _with_the_range_of(one, self.span)
            for one in self.parts
        ]
        alone = len(ranged) == 1
        self.depth_range = (
            ranged[0].depth_range if alone else union_of_their_ranges(ranged, np.dtype(np.float32))
        )

    def bands(self, most: int) -> list[tuple[int, int]]:
        """Rows [top, bottom) of no more fragments than `most`, but at least one row; the whole
        where all fragments are there already. They end where tiles do, if they can."""
        width, height = self.size
        if all(isinstance(one, Fragments) for one in self.parts):
            return [(0, height)]
        samples = sum(
            np.diff(one.offsets[::width]) if isinstance(one, Fragments) else one.samples
            for one in self.parts
        )
        before = np.concatenate([[0], np.cumsum(samples)])
        found, top = [], 0
        while top < height:
            bottom = int(np.searchsorted(before, before[top] + most, side="right")) - 1
            if bottom < height and bottom // TILE * TILE > top:
                bottom = bottom // TILE * TILE
            bottom = min(max(bottom, top + 1), height)
            found.append((top, bottom))
            top = bottom
        return found

    def rows(self, top: int, bottom: int) -> Fragments:
        """Of rows [top, bottom), with the depth_range of the whole."""
        some = [self._rows_of(one, top, bottom) for one in self.parts]
        f = some[0] if len(some) == 1 else merge(some)
        return Fragments._of_checked(
            f.offsets, f._arrays(), f.shape, self.depth_range, (top, 0), f.frame
        )

    def _rows_of(self, part: Fragments | InBands, top: int, bottom: int) -> Fragments:
        width, height = self.size
        if not isinstance(part, Fragments):
            f = in_range(part.rows(top, bottom), self.span, (width, bottom - top))
            return Fragments._of_checked(
                f.offsets, f._arrays(), f.shape, f.depth_range, (top, 0), f.frame
            )
        if (top, bottom) == (0, height):
            return part
        offsets = part.offsets[top * width : bottom * width + 1]
        some = slice(offsets[0], offsets[-1])
        arrays: Any = tuple(None if one is None else one[some] for one in part._arrays())
        return Fragments._of_checked(
            offsets - offsets[0], arrays, (bottom - top, width), part.depth_range, (top, 0)
        )


def _with_the_range_of(part: InBands, span: tuple[float, float] | None) -> Fragments:
    """Fragments whose depth_range is what all of the part's have."""
    near, far = part.depths
    depths = np.array([near, far] if near <= far else [], np.float32)
    alpha, color = np.full(len(depths), np.float32(0.5)), np.zeros((len(depths), 3), np.float32)
    return in_range((np.array([0, len(depths)]), depths, alpha, color), span, (1, 1))


def _merged(emitted: Sequence[Emitted], size: tuple[int, int]) -> Emitted:
    f = merge([in_range(arrays, None, size) for arrays in emitted])
    assert f.color is not None
    one: Emitted = (f.offsets, f.depth, f.alpha, f.color)
    if f.deviation is not None:
        return (*one, f.depth if f.back is None else f.back, f.deviation)
    return one if f.back is None else (*one, f.back)


def in_range(
    arrays: Emitted,
    span: tuple[float, float] | None,
    size: tuple[int, int],
    coplanar: float | None = None,
    transmission: NDArray[np.float32] | None = None,
) -> Fragments:
    """Emitted fragments, their depths in the range of what is transparent; coplanar : as
    `moit.rasterize` takes it, of all that is emitted."""
    if coplanar is not None:
        arrays = by_draw_order(arrays, coplanar)
    offsets, depth, alpha, color, *thick = arrays
    back = thick[0] if thick else None
    deviation = thick[1] if len(thick) > 1 else None
    width, height = size
    if span is not None:
        near, far = (float(np.float32(end)) for end in span)
        if depth.min(initial=near) < near or depth.max(initial=far) > far:
            inside = np.clip(depth, near, far)
            # only rounding moves transparent ones; opaque ones may be anywhere
            depth = np.where(alpha == 1, inside, np.clip(depth, *_widened(near, far)))
        back = None if back is None else np.maximum(np.clip(back, *_widened(near, far)), depth)
        last = depth if back is None else back
        span = (min(near, float(depth.min(initial=near))), max(far, float(last.max(initial=far))))
    return Fragments(
        offsets,
        depth,
        alpha,
        color,
        transmission=transmission,
        back=None if back is None or not (back > depth).any() else back,
        deviation=deviation,
        shape=(height, width),
        depth_range=span,
        dtype=np.float32,
    )


# moit_screen_triangle of csrc/moit_geometry.h, and the struct of shaders/meshes
SCREEN_TRIANGLE = np.dtype(
    [
        ("inverse_z", np.float64, 3),
        ("color", np.float64, (3, 3)),
        ("alpha", np.float64, 3),
        ("normal", np.float64, (3, 3)),
        ("x", np.int32, 3),
        ("y", np.int32, 3),
        ("opaque", np.int32),
        ("source", np.int32),
    ]
)
# moit_textured_triangle
TEXTURED_TRIANGLE = np.dtype(
    [
        *((name, SCREEN_TRIANGLE[name]) for name in SCREEN_TRIANGLE.names or ()),
        ("u", np.float64, 3),
        ("v", np.float64, 3),
        ("cutoff", np.float64),
        *(
            (name, np.int32)
            for name in (
                "first", "columns", "rows", "filtering", "wrap_u", "wrap_v", "lit", "masked"
            )
        ),
    ]
)  # fmt: skip


def screen_triangles(
    meshes: list[Mesh],
    camera: Camera,
    width: int,
    height: int,
    threads: int | None = None,
    firsts: dict[Texture, int] | None = None,
) -> NDArray[Any]:
    """The triangles that `rasterized` draws, in draw order: (n,) SCREEN_TRIANGLE.

    firsts : where the texels of each texture begin: (n,) TEXTURED_TRIANGLE; None: all meshes are
        without.
    """
    frame = camera.frame((width, height), thread_count(threads))
    origin = common_origin(meshes, frame.eye)
    arrays = joined(meshes, origin) if firsts is None else mesh_arrays(meshes, origin, firsts)
    seen = seen_in(frame, origin)
    found = _core.screen_triangles(arrays, seen, width, height, frame.threads)
    return found.view(SCREEN_TRIANGLE if firsts is None else TEXTURED_TRIANGLE)[:, 0]


def transparent_range(
    scene: Sequence[Drawable], camera: Camera, antialias: bool = False
) -> tuple[float, float] | None:
    """Depths of the bounding sphere of what lets light through; None where nothing does.

    antialias : the edges of all do.
    """
    points = [one.points if antialias else one.transparent_points for one in scene]
    points = [found for found in points if len(found)]
    if not points:
        return None
    middle, radius = bounding_sphere(points)
    distance = float(np.dot(camera.axes[2], middle - np.array(camera.eye)))
    near = min(max(distance - radius, camera.near), camera.far)
    far = max(min(distance + radius, camera.far), near)
    return near, far


def _widened(near: float, far: float) -> tuple[float, float]:
    """What float32 may make of depths of a range's ends."""
    slack = 1e-6 * far
    return near - slack, far + slack
