"""How small each mesh is drawn."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh, altered

FACTORS = (1, 2, 4, 8)

Resolution = int | Sequence[int] | Mapping[int, int]


def factors_of(resolution: Resolution, meshes: int) -> list[int]:
    """One for each of so many meshes. Raises TypeError and ValueError."""
    if isinstance(resolution, Mapping):
        found = [1] * meshes
        for place, factor in resolution.items():
            at = _whole(place, "resolution: expected numbers of meshes, from 0,")
            if not -meshes <= at < meshes:
                raise ValueError(f"resolution: expected one of {meshes} meshes, got {at}")
            found[at] = _factor(factor, f"resolution[{at}]")
        return found
    if isinstance(resolution, Sequence | np.ndarray) and not isinstance(resolution, str | bytes):
        if len(resolution) != meshes:
            raise ValueError(
                f"resolution: expected one for each of {meshes} meshes, got {len(resolution)}"
            )
        return [_factor(factor, f"resolution[{i}]") for i, factor in enumerate(resolution)]
    return [_factor(resolution, "resolution")] * meshes


def _factor(value: Any, name: str) -> int:
    factor = _whole(value, f"{name}: expected one of 1, 2, 4 and 8,")
    if factor not in FACTORS:
        raise ValueError(f"{name}: expected one of 1, 2, 4 and 8, got {factor}")
    return factor


def _whole(value: Any, expected: str) -> int:
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise TypeError(f"{expected} got {value!r:.80}")
    return int(value)


@dataclasses.dataclass(frozen=True)
class Squares:
    """The squares of `side` pixels that a picture of `whole` (width, height) is cut into.

    Where a side does not divide the picture's, they reach beyond it, at both ends alike.
    """

    whole: tuple[int, int]
    side: int

    @property
    def size(self) -> tuple[int, int]:
        """How many there are, across and down: (width, height) of the small picture."""
        width, height = self.whole
        return -(-width // self.side), -(-height // self.side)

    @property
    def before(self) -> tuple[int, int]:
        """Pixels of the first squares beyond the picture, to the left and above. A square has those
        pixels whose middle it holds."""
        (width, height), (across, down) = self.whole, self.size
        return (across * self.side - width + 1) // 2, (down * self.side - height + 1) // 2

    def camera(self, camera: Camera) -> Camera:
        """What sees, in a picture of a pixel a square, what `camera` sees of the whole."""
        height, reach = self.whole[1], self.size[1] * self.side
        if reach == height:
            return camera
        wide = 2 * math.atan(math.tan(camera.fov_y / 2) * reach / height)
        return dataclasses.replace(camera, fov_y=wide)

    def occluders(self, depth: NDArray[np.float32], alternating: bool) -> NDArray[np.float32]:
        """Of depths of opaque surfaces (height, width) those that squares have: the farthest.

        alternating : every other square has the nearest, so that of four that meet two have one.
        """
        found = self._each(depth, 0.0, np.maximum)
        if alternating:
            odd = np.indices(found.shape).sum(axis=0) % 2 == 1
            found[odd] = self._each(depth, np.inf, np.minimum)[odd]
        return found

    def _each(
        self, depth: NDArray[np.float32], filler: float, choose: np.ufunc
    ) -> NDArray[np.float32]:
        """Of a square's pixels what `choose` does; filler: what it never chooses."""
        (left, top), (width, height), side = self.before, self.size, self.side
        padded = np.full((height * side, width * side), np.float32(filler))
        padded[top : top + self.whole[1], left : left + self.whole[0]] = depth
        rows = padded[::side].copy()
        for k in range(1, side):
            choose(rows, padded[k::side], out=rows)
        found = rows[:, ::side].copy()
        for k in range(1, side):
            choose(found, rows[:, k::side], out=found)
        return found


@dataclasses.dataclass(frozen=True)
class Parts:
    """A scene by how its triangles are drawn.

    opaque : opaque triangles, at full size.
    transparent : the other triangles of meshes of each factor that there is; that of 1 always.
    cutouts : of those drawn small what may be opaque somewhere; it is drawn at full size there.
    """

    opaque: list[Mesh]
    transparent: dict[int, list[Mesh]]
    cutouts: list[Mesh]

    @property
    def small(self) -> dict[int, list[Mesh]]:
        return {side: some for side, some in self.transparent.items() if side > 1}


def parts_of(meshes: list[Mesh], factors: list[int]) -> Parts:
    parts = Parts([], {1: []}, [])
    for mesh, factor in zip(meshes, factors, strict=True):
        clear = mesh.transparent
        most = mesh.alpha[mesh.triangles].reshape(-1, 3).max(axis=1, initial=0)
        _add(parts.opaque, mesh, ~clear)
        if clear.any():
            _add(parts.transparent.setdefault(factor, []), mesh, clear)
        if factor > 1:
            _add(parts.cutouts, mesh, clear & (most == 1))
    return parts


def _add(to: list[Mesh], mesh: Mesh, triangles: NDArray[np.bool_]) -> None:
    if triangles.all():
        to.append(mesh)
    elif triangles.any():
        to.append(altered(mesh, triangles=mesh.triangles[triangles]))
