"""Pictures with small parts on the CPU: fragments at each size, summed up and joined by the core.

McGuire, "Weighted Blended Order-Independent Transparency", 2015, a post: draws of low resolution
go into textures of their own, which are combined when composited, whatever lies in front of what.
"""

from __future__ import annotations

import dataclasses
import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import Technique
from moit.fragments.fragments import Fragments
from moit.geometry.squares import Parts, Squares
from moit.rendering.rasterizing import Shot

Array = NDArray[Any]
NOTHING = np.float32(1.0)  # the depth where there is no opaque surface
OPAQUE = np.float32(1.0)  # alpha


def pixels_of(f: Fragments) -> NDArray[np.int64]:
    """The pixel of each fragment."""
    return np.repeat(np.arange(len(f.offsets) - 1), np.diff(f.offsets))


@dataclasses.dataclass
class MixedPicture:
    """One picture.

    timings, memory : as `moit.Rendering` has them.
    """

    parts: Parts
    shot: Shot
    span: tuple[float, float]
    timings: dict[str, float] = dataclasses.field(default_factory=dict)
    memory: dict[str, int] = dataclasses.field(default_factory=dict)

    def render(self, technique: Technique, background: Array, depth_aware: bool) -> Array:
        """(height, width, 4) float32."""
        start = time.perf_counter()
        size, camera, threads = self.shot.size, self.shot.camera, self.shot.threads
        whole = self.shot.take(self.parts.transparent[1])
        occluders, behind = self._occluders(background, whole)
        fragments, hiding = {1: self._transparent(whole, occluders)}, {1: occluders}
        for side, meshes in self.parts.small.items():
            squares = Squares(size, side)
            hiding[side] = squares.occluders(occluders, alternating=depth_aware)
            coarse = squares.camera(camera)
            small = dataclasses.replace(self.shot, camera=coarse, size=squares.size).take(meshes)
            fragments[side] = self._transparent(small, hiding[side])
        between = time.perf_counter()
        pictures = []
        for side, f in fragments.items():
            sums = _core.target_sums(f, technique.fields_for(f), threads)
            pictures.append((side, sums, hiding[side]))
            name = "targets" if side == 1 else "small targets"
            self._add(name, sums.nbytes + hiding[side].nbytes)
        fields = technique.fields_for_core(np.dtype(np.float32))
        image = _core.join_targets(fields, pictures, depth_aware, behind, threads)
        self.timings |= {"rasterize": between - start, "composite": time.perf_counter() - between}
        return image

    def _occluders(self, background: Array, whole: Fragments) -> tuple[NDArray[np.float32], Array]:
        """Depth and colour of opaque surfaces, (height, width) and (height, width, 3).

        whole : transparent triangles of full size, which may be opaque somewhere.
        """
        width, height = self.shot.size
        depth = np.full(height * width, NOTHING)
        behind = np.empty((height * width, 3))
        behind[:] = background.reshape(-1, 3)
        opaque, cutouts = self.shot.take(self.parts.opaque), self.shot.take(self.parts.cutouts)
        for f in (opaque, whole, cutouts):
            assert f.color is not None
            solid = np.flatnonzero(f.alpha == OPAQUE)
            pixel = pixels_of(f)[solid]
            away = f.depth[solid] * self.occluder_scale
            first = np.arange(len(solid))
            if (pixel[1:] == pixel[:-1]).any():
                order = np.lexsort((first, away, pixel))
                first = order[np.diff(pixel[order], prepend=-1) != 0]
            first = first[away[first] < depth[pixel[first]]]
            depth[pixel[first]] = away[first]
            behind[pixel[first]] = f.color[solid[first]]
        return depth.reshape(height, width), behind.reshape(height, width, 3)

    def _transparent(self, f: Fragments, occluders: Array) -> Fragments:
        """What opaque surfaces do not hide, and are not themselves."""
        assert f.color is not None
        hides = occluders.reshape(-1)[pixels_of(f)]
        stays = (f.depth * self.occluder_scale <= hides) & (f.alpha != OPAQUE)
        offsets = np.concatenate([[0], np.cumsum(stays)])[f.offsets]
        left = Fragments(
            offsets,
            np.clip(f.depth[stays], *self.span),  # only rounding moves any
            f.alpha[stays],
            f.color[stays],
            shape=f.shape,
            depth_range=self.span,
            dtype=np.float32,
        )
        self._add("fragments", left.offsets.nbytes + 20 * len(left))
        return left

    @property
    def occluder_scale(self) -> np.float32:
        """A power of two below 1 / far, in which depths of opaque surfaces are held."""
        return np.float32(2.0 ** -(math.frexp(self.shot.camera.far)[1] + 1))

    def _add(self, name: str, size: int) -> None:
        self.memory[name] = self.memory.get(name, 0) + size
