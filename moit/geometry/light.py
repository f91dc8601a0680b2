"""Lights of a picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.catalog import Technique, technique
from moit.geometry.camera import Camera, Vector, vector

MOST_LIGHTS = _core.numbers()["MOST_LIGHTS"]


@runtime_checkable
class CastShadows(Protocol):
    """What casters let through of a light: `moit.ShadowMap`."""

    technique: Technique

    def transmittance(
        self, points: ArrayLike, alpha: ArrayLike | None = None, *, threads: int | None = None
    ) -> NDArray[Any]:
        """(N,) in [0, 1]: the share that comes to points (N, 3) of surfaces of these opacities."""


@dataclasses.dataclass(frozen=True)
class Light:
    """A light from far away.

    direction : (3,) where it travels, not 0.
    color : (3,) linear, not negative; 1 is as bright as the light that there is without any.
    shadows : what the picture's own triangles let through of it: a technique or its name, as
        `moit.ShadowMap` takes it, or a ShadowMap of other casters. With the technique's
        `exclude_self` a surface is not in the shadow of itself. None: the light reaches everything.

    Raises TypeError and ValueError that name the argument.

    >>> moit.Light((0, -1, 0), color=(1, 0.5, 0.25)).color
    (1.0, 0.5, 0.25)
    """

    direction: Vector
    color: Vector = (1.0, 1.0, 1.0)
    shadows: str | Technique | CastShadows | None = None

    def __post_init__(self) -> None:
        for name in ("direction", "color"):
            object.__setattr__(self, name, vector(getattr(self, name), name))
        if not float(np.linalg.norm(self.direction)) > 0:
            raise ValueError("direction: expected a direction that is not 0")
        if min(self.color) < 0:
            raise ValueError(f"color: expected numbers that are not negative, got {self.color}")
        if not isinstance(self.shadows, CastShadows | None):
            technique(self.shadows)


Lights = Sequence[Light | tuple[ArrayLike, ArrayLike]]


def throw_shadows(lights: Lights) -> bool:
    return any(isinstance(light, Light) and light.shadows is not None for light in lights)


def light_numbers(lights: Lights, camera: Camera) -> NDArray[np.float64]:
    """(n, 6): where each light travels as the camera sees it, of length 1, and its colour."""
    if isinstance(lights, str | bytes) or not isinstance(lights, Sequence):
        raise TypeError(f"lights: expected a sequence, got {type(lights).__name__}")
    if len(lights) > MOST_LIGHTS:
        raise ValueError(f"lights: expected at most {MOST_LIGHTS}, got {len(lights)}")
    rows = np.zeros((len(lights), 6))
    for i, light in enumerate(lights):
        try:
            direction, color = (light.direction, light.color) if isinstance(light, Light) else light
        except (TypeError, ValueError):
            raise TypeError(
                f"lights[{i}]: expected a direction and a colour, got {light!r:.80}"
            ) from None
        travels = np.array(vector(direction, f"lights[{i}][0]"))
        length = float(np.linalg.norm(travels))
        if not length > 0:
            raise ValueError(f"lights[{i}][0]: expected a direction that is not 0")
        rows[i, :3] = camera.axes @ (travels / length)
        rows[i, 3:] = vector(color, f"lights[{i}][1]")
        if (rows[i, 3:] < 0).any():
            raise ValueError(f"lights[{i}][1]: expected numbers that are not negative")
    return rows
