"""Scenes to fragments, for users: arguments are checked here, once."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import GpuError
from moit.checks.windows import picture_size
from moit.engines import gpu_of
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.drawing import Drawable, Scene, Shares
from moit.geometry.glass import share_through
from moit.geometry.grids import Volume
from moit.geometry.light import Lights, light_numbers, throw_shadows
from moit.geometry.meshes import Mesh, drawables_of
from moit.geometry.rasterizer import (
    MOST_SIDE,
    Picture,
    rasterized,
    transparent_range,
)
from moit.system.environment import thread_count
from moit.system.progress import Progress, Steps, steps

if TYPE_CHECKING:
    from moit.gpu.device import Device
    from moit.gpu.listed import Listed
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any


def rasterize(
    scene: Scene,
    camera: Camera,
    size: tuple[int, int],
    *,
    lights: Lights = (),
    coplanar: float | None = None,
    antialias: bool = False,
    device: str | Device = "cpu",
    threads: int | None = None,
    progress: Progress = True,
) -> Fragments:
    """The fragments of a picture of triangles: float32, in draw order.

    scene : a Mesh, or several in the order in which they are drawn.
    size : (width, height), each from 1 to 16,384.

    lights : up to eight `moit.Light`, or pairs of where a light from far away travels, (3,) not 0,
        and its linear colour, (3,) not negative. Colour 1 is as bright as the light there is
        without any: white, from the upper left behind the eye. A quarter of it comes from
        everywhere, whatever shines; a Light's shadows take nothing of that.
    coplanar : of surfaces whose depths in a pixel differ by no more than this (0 or more, in units
        of depth), draw order says which is in front: the first, as where depths are equal. They
        get one depth, that of their nearest opaque surface or else of the nearest of them; of
        opaque ones the first is kept, and it does not hide transparent ones so near to it. So give
        a decal before what it lies on, or make it transparent. It costs room for all that is
        hidden. None: depths are as they are, and rounding decides.
    antialias : each pixel that something touches has a fragment of it, whose alpha counts by the
        share of the pixel that is covered; what is opaque is then transparent at its edges. Points
        and lines by 64 samples a pixel; triangles by areas (see `moit.Mesh`), on the CPU. Not with
        coplanar.
    device : "cpu", "gpu", or a moit.gpu.Device; the result is the same but for what a GPU divides
        and takes roots of less exactly.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors.
    progress : True, False, or a callable (done, total, label) of shadow maps and the picture.

    One fragment for each pixel whose middle a triangle covers, seen from either side; of an edge
    that two triangles share, one of them has what lies on it (the top-left rule, on vertices
    snapped to 1/256 pixel as GPUs do). Attributes are interpolated perspective-correctly; colour
    is lit by Lambert's law on both sides. Depth is the
    distance along the view. Of opaque triangles the nearest alone is kept, first in its pixel, and
    hides what is behind it.

    depth_range is that of the bounding sphere of the transparent triangles, as far as near and far
    leave it, so that it moves smoothly with the camera; opaque fragments beyond it are held at its
    ends, where they hide and are hidden as before.

    The result is the same bits for any number of threads. Raises TypeError and ValueError.

    >>> glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> f = moit.rasterize(glass, moit.Camera(), (8, 6))
    >>> f.shape
    (6, 8)
    """
    parts = drawables_of(scene)
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")
    size = picture_size(size, MOST_SIDE)
    numbers = light_numbers(lights, camera)
    gpu = gpu_of(device)
    workers = thread_count(threads)
    tolerance = _tolerance(coplanar)
    truth("antialias", antialias)
    if antialias and gpu is not None and any(isinstance(one, Mesh) for one in parts):
        raise GpuError(
            "antialias: coverage of pixels is the CPU's where triangles are drawn; needed "
            "device='cpu'"
        )
    if antialias and tolerance is not None:
        raise ValueError("coplanar: expected None with antialias")
    if tolerance is not None and any(map(share_through, parts)):
        raise ValueError("coplanar: expected None for meshes with transmission")
    if tolerance is not None and any(isinstance(one, Volume) for one in parts):
        raise ValueError("coplanar: expected None for volumes")
    with steps(progress, maps_to_make(lights) + 1, "rasterize", patient=True) as done:
        shadowed = with_shadows(lights, parts, workers, done)
        done.now("fragments")
        shot = Shot(camera, size, shadowed, numbers, gpu, workers, tolerance, antialias)
        f = shot.take(parts)
        done("fragments")
    return f


def _tolerance(coplanar: float | None) -> float | None:
    if coplanar is None:
        return None
    array = as_array(coplanar, "coplanar")
    if array.dtype.kind not in "fiu" or array.shape != ():
        raise TypeError(f"coplanar: expected a number or None, got {coplanar!r:.80}")
    tolerance = float(finite(array, "coplanar", np.float64))
    if tolerance < 0:
        raise ValueError(f"coplanar: found {tolerance}; needed a number that is not negative")
    return tolerance


@dataclasses.dataclass(frozen=True, eq=False)
class Shot:
    """How a picture is taken, checked.

    lights : those that throw shadows have maps; light_numbers : the same as numbers, (n, 6).
    gpu : None: on the CPU.
    """

    camera: Camera
    size: tuple[int, int]
    lights: Lights
    light_numbers: NDArray[np.float64]
    gpu: Device | None
    threads: int
    coplanar: float | None = None
    antialias: bool = False

    def take(self, scene: Sequence[Drawable]) -> Fragments:
        """The fragments of a scene."""
        if self.gpu is not None:
            return self.list(self.gpu, scene).whole()
        return rasterized(
            scene,
            self.camera,
            self.size,
            self.threads,
            self.light_numbers,
            self._shares(),
            self.coplanar,
            self.antialias,
        )

    def list(self, gpu: Device, scene: Sequence[Drawable]) -> Listed:
        """The same as a GPU lists them, in bands of rows."""
        from moit.gpu.listed import Listed
        from moit.gpu.meshes import Drawing

        span = transparent_range(scene, self.camera, self.antialias)
        with gpu:
            drawing = Drawing(
                gpu,
                scene,
                self.camera,
                *self.size,
                lights=self.light_numbers,
                threads=self.threads,
                shadowing=self.lights,
                lists_opaque=self.coplanar is not None,
                antialias=self.antialias,
            )
        return Listed(drawing, span, self.coplanar)

    def begin(self, scene: Sequence[Drawable]) -> Picture:
        """The same in bands of rows, on the CPU, where coplanar is None."""
        lit = (self.light_numbers, self._shares())
        frame = self.camera.frame(self.size, self.threads, *lit, antialias=self.antialias)
        return Picture(scene, self.camera, frame)

    def _shares(self) -> Shares | None:
        if not throw_shadows(self.lights):
            return None
        from moit.shadows.reaching import reached_in_picture

        return reached_in_picture(self.lights, self.camera, self.size, self.threads)


def maps_to_make(lights: Lights) -> int:
    """How many maps `with_shadows` makes."""
    if not throw_shadows(lights):
        return 0
    from moit.shadows.reaching import lacks_map

    return sum(map(lacks_map, lights))


def with_shadows(lights: Lights, scene: Sequence[Drawable], threads: int, done: Steps) -> Lights:
    """The same lights, those that throw shadows with maps of this scene or their own."""
    if not throw_shadows(lights):
        return lights
    from moit.shadows.reaching import with_maps

    return with_maps(lights, scene, threads, done)
