"""What is measured of a technique: on rays of a set, and on a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import metrics
from moit.catalog import Technique
from moit.fragments.fragments import Fragments
from moit.judging.bootstrap import Estimate, estimate
from moit.judging.draws import Draw
from moit.questions import composite, transmittance

Array = NDArray[Any]

PAN_FRAMES = 3  # of a camera that moves
ORDERS = 4  # in which the fragments of a ray arrive
STILL = 0.002  # what no channel of the exact picture changes by from frame to frame
JUMP = 0.02  # by which a picture should not change then

#: Of rays: colours over black, root mean square; transmittance before each fragment, root mean
#: square; how far colours are from their mean over orders of arrival, root mean square; and where
#: the exact picture is still, the root mean square of a change from frame to frame, and the share
#: of pixels that jump.
ON_RAYS = ("colour", "T", "order", "flicker", "jumps")
ON_SCENES = ("flip", "rmse")
#: Of a scene that the camera goes past: as of rays, where there are fragments.
ON_PANS = ("pan_flicker", "pan_jumps")


@dataclass(frozen=True)
class RayUnit:
    """Rays of a set. frames : as many as are looked at for motion."""

    draw: Draw
    letter: str
    pixels: int
    frames: int

    @property
    def name(self) -> str:
        return f"{self.letter}-{self.pixels}-{self.frames}"

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(f"{self.letter}_{one}" for one in ON_RAYS)

    def prepared(self) -> PreparedRays:
        moving = self.draw.rays(self.letter, self.pixels).frames(self.frames)
        return PreparedRays(moving, [moving[0].shuffled(1 + k) for k in range(ORDERS - 1)])


@dataclass(frozen=True)
class PreparedRays:
    """moving : the same rays in several frames. shuffled : the first in other orders."""

    moving: Sequence[Fragments]
    shuffled: Sequence[Fragments]

    @cached_property
    def _exact(self) -> Array:
        return _colours(self.moving, "sorted", "f8")

    @cached_property
    def _exact_T(self) -> Array:
        return transmittance(self.moving[0], "sorted", dtype="f8")

    @cached_property
    def _still(self) -> Array:
        """(frames - 1, P) where nothing should be seen to change."""
        return np.asarray(np.abs(np.diff(self._exact, axis=0)).max(axis=2) < STILL)

    def measured(self, one: Technique) -> dict[str, Estimate]:
        f = self.moving[0]
        seen = _colours(self.moving, one)
        off = ((seen[0] - self._exact[0]) ** 2).mean(axis=1)
        T = (transmittance(f, one).astype(np.float64) - self._exact_T) ** 2
        orders = np.concatenate([seen[:1], _colours(self.shuffled, one)])
        change = np.diff(seen, axis=0)
        times = self._still.sum(axis=0)
        flicker = ((change**2).mean(axis=2) * self._still).sum(axis=0)
        jumps = ((np.abs(change).max(axis=2) > JUMP) & self._still).sum(axis=0)
        numbers = (
            estimate(off, root=True),
            estimate(np.add.reduceat(T, f.offsets[:-1]), f.counts, root=True),
            estimate(orders.var(axis=0, ddof=1).mean(axis=1), root=True),
            estimate(flicker, times, root=True),
            estimate(jumps, times),
        )
        return dict(zip(ON_RAYS, numbers, strict=True))


def _colours(rays: Sequence[Fragments], one: Technique | str, dtype: str | None = None) -> Array:
    """(K, P, 3) of each, over black."""
    return _pictures(rays, one, dtype)[:, 0]


@dataclass(frozen=True)
class SceneUnit:
    """A scene at a size (width, height)."""

    draw: Draw
    scene: str
    size: tuple[int, int]

    @property
    def name(self) -> str:
        return f"{self.scene}-{size_name(self.size)}"

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(f"{one}_{size_name(self.size)}" for one in ON_SCENES)

    def prepared(self) -> PreparedScene:
        return PreparedScene(*self.draw.scene(self.scene, self.size))


@dataclass(frozen=True)
class PreparedScene:
    f: Fragments
    background: tuple[float, ...]

    @cached_property
    def _exact(self) -> Array:
        return composite(self.f, "sorted", background=self.background, dtype="f8")

    def measured(self, one: Technique) -> dict[str, Estimate]:
        image = composite(self.f, one, background=self.background)
        # A scene is one picture: how sure a mean over scenes is comes of all of them.
        return {
            name: Estimate(*[float(getattr(metrics, name)(image, self._exact))] * 3)
            for name in ON_SCENES
        }


@dataclass(frozen=True)
class PanUnit:
    """A scene of triangles at a size (width, height), in frames of a moving camera."""

    draw: Draw
    scene: str
    size: tuple[int, int]

    @property
    def name(self) -> str:
        return f"{self.scene}-pan-{size_name(self.size)}"

    @property
    def columns(self) -> tuple[str, ...]:
        return ON_PANS

    def prepared(self) -> PreparedPan:
        return PreparedPan(self.draw.panned(self.scene, self.size, PAN_FRAMES))


@dataclass(frozen=True)
class PreparedPan:
    moving: Sequence[Fragments]

    @cached_property
    def _still(self) -> Array:
        """(frames - 1, H, W) where something is seen through, and nothing seen to change."""
        exact = _pictures(self.moving, "sorted", "f8")
        any_ = np.stack([f.counts.reshape(exact.shape[1:3]) > 0 for f in self.moving])
        still = np.abs(np.diff(exact, axis=0)).max(axis=-1) < STILL
        return np.asarray(still & any_[1:] & any_[:-1])

    def measured(self, one: Technique) -> dict[str, Estimate]:
        change = np.diff(_pictures(self.moving, one), axis=0)[self._still]
        flicker = np.sqrt((change**2).mean()) if len(change) else 0.0
        jumps = (np.abs(change).max(axis=-1) > JUMP).mean() if len(change) else 0.0
        numbers = (Estimate(*[float(value)] * 3) for value in (flicker, jumps))
        return dict(zip(ON_PANS, numbers, strict=True))


def _pictures(frames: Sequence[Fragments], one: Technique | str, dtype: str | None = None) -> Array:
    """(K, H, W, 3) of each, over black."""
    return np.stack([composite(f, one, dtype=dtype)[..., :3].astype(float) for f in frames])


Unit = RayUnit | SceneUnit | PanUnit


def size_name(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"
