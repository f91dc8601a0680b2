"""Splats drawn by a GPU: the core brings them to the screen, passes make fragments of them.

As the reference rasteriser has it, no fragment is behind what lets less than 1e-4 through. Where
that is in each pixel a pass finds before anything is drawn, tile by tile through lists that the
core sorts; all other passes then draw in any order.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.exceptions import GpuError
from moit.geometry.camera import Camera
from moit.geometry.splats import Splats, joined, kind_of
from moit.gpu.bindings import (
    FRONT_TO_BACK,
    SEEN_UNTIL,
    SOFTWARE_ITERATIONS,
    SPLAT_TILE,
    TILE_FIRSTS,
    TRIANGLES,
    group_counts,
)
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu.device import Device

Array = NDArray[Any]

# moit_screen_splat of csrc/moit_geometry.h, and the struct of shaders/meshes/splats.glsl
_FIELDS = [
    ("x", np.float64),
    ("y", np.float64),
    ("spread", np.float64),
    ("square", np.float32, 3),
    ("along", np.float32, 6),
    ("depth", np.float32, 3),
    ("alpha", np.float32, 1),  # in its middle
    ("color", np.float32, 3),
    ("nearest", np.float32),
    ("z", np.float32),
    ("across", np.int32, 2),
    ("down", np.int32, 2),
    ("left", np.int32),
    ("top", np.int32),
    ("right", np.int32),
    ("bottom", np.int32),
    ("projected", np.int32),
    ("index", np.int32),
    ("opaque", np.int32),
]
SCREEN_SPLAT = np.dtype(_FIELDS, align=True)
SPLATS_AT_ONCE = SOFTWARE_ITERATIONS  # of a tile, that one pass goes through
BYTES_OF_AN_END = 12  # of a pixel


@dataclasses.dataclass(frozen=True)
class UnsortedSplats:
    """Those of which all fragments are there: each stands for itself."""

    surface: str = "meshes/splats_all.glsl"
    vertex: str = "meshes/splats.vert.glsl"
    corners: int = 6
    thick: bool = False

    def records(
        self,
        several: Sequence[Splats],
        camera: Camera,
        width: int,
        height: int,
        threads: int | None,
    ) -> Array:
        on_screen, _, _ = _screen_splats(several, camera, (width, height), threads)
        return on_screen[_seen(on_screen)]


def primitive_of(one: Splats) -> UnsortedSplats | ProjectedSplats:
    """What draws such; of the convention "3dgs" one for each run of a scene."""
    if one.convention == "3dgs":
        return ProjectedSplats()
    if one.convention == "exact":
        return UnsortedSplats("meshes/splats_along_rays.glsl", thick=one.thick)
    return UnsortedSplats()


@dataclasses.dataclass(frozen=True)
class ProjectedSplats(UnsortedSplats):
    """Those of the convention "3dgs", of one run of a scene.

    named : what records are, for messages. kept : "firsts" and "front to back" of the run.
    """

    surface: str = "meshes/splat_surface.glsl"
    named: str = "splats"
    kept: dict[str, Array] = dataclasses.field(default_factory=dict)

    def records(
        self,
        several: Sequence[Splats],
        camera: Camera,
        width: int,
        height: int,
        threads: int | None,
    ) -> Array:
        found = _screen_splats(several, camera, (width, height), threads)
        on_screen, self.kept["firsts"], front_to_back = found
        assert front_to_back is not None
        seen = _seen(on_screen)
        places = np.cumsum(seen, dtype=np.int32) - np.int32(1)
        self.kept["front to back"] = places[front_to_back]
        return on_screen[seen]

    def buffers(self, device: Device, records: Any, width: int, height: int) -> dict[int, Any]:
        """How far splats are seen in each pixel."""
        firsts, front_to_back = self.kept["firsts"], self.kept["front to back"]
        size = max(BYTES_OF_AN_END * width * height, front_to_back.nbytes)
        if size > device.storage_bytes:
            raise GpuError(
                f"scene: lists of splats take {size} bytes, and a buffer of {device.renderer} "
                f"holds {device.storage_bytes}; use a smaller size or device='cpu'"
            )
        ends = device.buffer(BYTES_OF_AN_END * width * height)
        starts = firsts.astype(np.uint32)
        lists = {
            TRIANGLES: records,
            SEEN_UNTIL: ends,
            TILE_FIRSTS: device.buffer(starts.nbytes, starts),
            FRONT_TO_BACK: device.buffer(
                max(front_to_back.nbytes, 16), front_to_back if front_to_back.size else None
            ),
        }
        program = device.program("meshes/seen_until.comp.glsl", DOUBLE=0)
        threads = (len(firsts) - 1) * SPLAT_TILE**2
        most = int(np.diff(firsts).max())
        for first in range(0, max(most, 1), SPLATS_AT_ONCE):
            device.dispatch(
                program,
                group_counts(threads),
                buffers=lists,
                uniforms={
                    "count": threads,
                    "picture": (width, height),
                    "block_side": 1,
                    "tile_columns": -(-width // SPLAT_TILE),
                    "from": first,
                    "most": SPLATS_AT_ONCE,
                },
            )
        return {SEEN_UNTIL: ends}


def _seen(on_screen: Array) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = on_screen["left"] < on_screen["right"]
    return found


def _screen_splats(
    several: Sequence[Splats], camera: Camera, size: tuple[int, int], threads: int | None
) -> tuple[Array, NDArray[np.int64], NDArray[np.int32] | None]:
    """All splats (N,) SCREEN_SPLAT, and those of tiles as `_core.screen_splats` has them."""
    frame = camera.frame(size, thread_count(threads))
    seen = (frame.eye, *frame.axes, frame.scale, frame.near, frame.far)
    number, _ = kind_of(several[0])
    records, firsts, front_to_back = _core.screen_splats(
        joined(list(several)), number, seen, *size, frame.threads
    )
    return records.view(SCREEN_SPLAT), firsts, front_to_back
