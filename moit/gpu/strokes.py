"""Points and lines drawn by a GPU: the core brings their parts to the screen, passes ask what each
covers of a pixel, and of parts that meet there make one layer, which the first of them draws."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.geometry.camera import Camera
from moit.geometry.strokes import Strokes, how_drawn, joined
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu.device import Device

Array = NDArray[Any]

# moit_screen_stroke of csrc/moit_geometry.h, and the struct of shaders/meshes/strokes.glsl
SCREEN_STROKE = np.dtype(
    [
        *((name, np.float64, 2) for name in ("x", "y", "radius", "along")),
        *((name, np.float64) for name in ("apart", "lean", "upright")),
        ("at", np.float64, 6),
        ("size", np.float64, 2),
        ("outside", np.float64, 2),
        *((name, np.float64) for name in ("over", "per_over", "start", "beyond")),
        ("color", np.float32, 6),
        ("opacity", np.float32, 2),
        ("alpha", np.float32, 1),  # the most of its stroke
        *(
            (name, np.int32)
            for name in (
                "holder", "everywhere", "left", "top", "right", "bottom", "stroke", "place",
                "opens", "closes", "other", "how", "opaque",
            )
        ),
    ],
    align=True,
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class StrokeParts:
    """Strokes that are drawn alike. antialias : by how much of each pixel they cover."""

    antialias: bool = False
    vertex: str = "meshes/strokes.vert.glsl"
    surface: str = "meshes/stroke_surface.glsl"
    corners: int = 6
    named: str = "parts of points and lines"

    def records(
        self,
        several: Sequence[Strokes],
        camera: Camera,
        width: int,
        height: int,
        threads: int | None,
    ) -> Array:
        frame = camera.frame((width, height), thread_count(threads))
        seen = (frame.eye, *frame.axes, frame.scale, frame.near, frame.far)
        how = how_drawn(several[0], self.antialias)
        found = _core.screen_strokes(joined(list(several)), how, seen, width, height)
        return found.view(SCREEN_STROKE)

    def buffers(self, device: Device, records: Any, width: int, height: int) -> dict[int, Any]:
        """None; but parts ask those before and behind them: all are in one buffer."""
        return {}


def looks_along(camera: Camera, width: int, height: int) -> dict[str, Any]:
    """Uniforms of their text, with moit_stroke_raster_of's steps."""
    spans = camera.scale((width, height))
    right, up = 1.0 / spans[0], -1.0 / spans[1]
    return {
        "sight": (-right, 2.0 * right / width, -up, 2.0 * up / height),
        "seen_range": (camera.near, camera.far),
        "spans": spans,
    }
