"""Where a picture is taken from."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arrays import as_array, finite
from moit.geometry.drawing import Frame, Scene, Shares, bounding_sphere
from moit.geometry.meshes import drawables_of

Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class Camera:
    """A pinhole camera, right-handed, y up.

    eye, target : (3,) where it is and what is in the middle of its picture; not the same.
    up : (3,) what points up in the picture; not along the view.
    fov_y : radians that the picture spans from bottom to top, in (0, pi).
    near, far : distances along the view between which things are seen, 0 < near < far.

    Raises TypeError and ValueError that name the argument.

    >>> camera = moit.Camera(eye=(0, 0, 5), near=1)
    >>> camera.eye, camera.near
    ((0.0, 0.0, 5.0), 1.0)
    """

    eye: Vector = (0.0, 0.0, 3.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov_y: float = math.pi / 4
    near: float = 0.1
    far: float = 100.0

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            object.__setattr__(self, name, vector(getattr(self, name), name))
        for name in ("fov_y", "near", "far"):
            object.__setattr__(self, name, _number(getattr(self, name), name))
        if not 0 < self.fov_y < math.pi:
            raise ValueError(f"fov_y: expected radians in (0, pi), got {self.fov_y}")
        if not 0 < self.near < self.far:
            raise ValueError(
                f"near, far: expected 0 < near < far, got near {self.near} and far {self.far}"
            )
        if self.eye == self.target:
            raise ValueError(f"target: expected another point than eye, got {self.target} for both")
        if not np.isfinite(self.axes).all():
            raise ValueError(f"up: expected a direction that is not along the view, got {self.up}")

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3): the directions right, up and forward in the picture, of length 1."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        length = np.linalg.norm(right)
        if not length > 1e-9 * float(np.linalg.norm(self.up)):
            return np.full((3, 3), np.nan)
        right = right / length
        return np.array([right, np.cross(right, forward), forward])

    def scale(self, size: tuple[int, int]) -> tuple[float, float]:
        """Factors of x / z and y / z for which a picture (width, height) spans [-1, 1]."""
        vertical = 1 / math.tan(self.fov_y / 2)
        return vertical * size[1] / size[0], vertical

    def matrices(self, size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(4, 4) matrices of the view and of the projection, as OpenGL's clip space has them.

        Both are for column vectors, clip = projection @ view @ (x, y, z, 1); GL wants their bytes
        column by column, `.T.astype("f4").tobytes()`.
        """
        right, up, forward = self.axes
        view = np.eye(4)
        view[:3, :3] = right, up, -forward
        view[:3, 3] = -view[:3, :3] @ np.array(self.eye)
        near, far = self.near, self.far
        across, along = self.scale(size)
        projection = np.diag([across, along, (near + far) / (near - far), 0.0])
        projection[2, 3] = 2 * near * far / (near - far)
        projection[3, 2] = -1
        return view, projection

    def frame(
        self,
        size: tuple[int, int],
        threads: int,
        lights: NDArray[np.float64] | None = None,
        shares: Shares | None = None,
        lists_opaque: bool = False,
        antialias: bool = False,
    ) -> Frame:
        """A picture (width, height) by this camera."""
        lights = np.zeros((0, 6)) if lights is None else lights
        seen = (self.eye, self.axes, self.scale(size), self.near, self.far)
        return Frame(*seen, size, lights, threads, shares, lists_opaque, antialias)

    def fit(self, scene: Scene) -> Camera:
        """The camera that looks the same way and has all of `scene` in a square picture.

        Its target becomes the middle of the scene's bounding sphere, which near and far enclose.
        """
        middle, radius = bounding_sphere([one.points for one in drawables_of(scene)])
        far = float(np.abs(middle).max())
        # a point has some size; what has one is as large as float64 can tell at that distance
        radius = max(radius, 1e-6, 1e-12 * far) if radius > 0 else 1e-6 * max(1.0, far)
        distance = 1.02 * radius / math.sin(self.fov_y / 2)
        eye = middle - distance * self.axes[2]
        return dataclasses.replace(
            self,
            eye=tuple(eye.tolist()),
            target=tuple(middle.tolist()),
            near=max(distance - 1.05 * radius, 1e-3 * distance),
            far=distance + 1.05 * radius,
        )


def vector(value: ArrayLike, name: str) -> Vector:
    """Three finite numbers."""
    array = as_array(value, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected three real numbers, got {array.dtype}")
    if array.shape != (3,):
        raise ValueError(f"{name}: expected shape (3,), got {array.shape}")
    x, y, z = finite(array, name, np.float64).tolist()
    return x, y, z


def _number(value: Any, name: str) -> float:
    array = as_array(value, name)
    if array.dtype.kind not in "fiu" or array.shape != ():
        raise TypeError(f"{name}: expected a number, got {value!r:.80}")
    return float(finite(array, name, np.float64))
