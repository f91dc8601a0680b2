"""Lights of a picture."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from moit.geometry.camera import Vector, vector

if TYPE_CHECKING:
    from moit.catalog import Technique
    from moit.shadows.shadow_map import ShadowMap


@dataclasses.dataclass(frozen=True)
class Light:
    """A light from far away.

    direction : (3,) where it travels, not 0.
    color : (3,) linear, not negative; 1 is as bright as the light that there is without any.
    shadows : what the picture's own triangles let through of it: a technique or its name, as
        `moit.ShadowMap` takes it, or a ShadowMap of other casters. With the technique's
        `exclude_self` a surface is not in the shadow of itself. None: the light reaches everything.

    Raises TypeError and ValueError that name the argument.
    """

    direction: Vector
    color: Vector = (1.0, 1.0, 1.0)
    shadows: str | Technique | ShadowMap | None = None

    def __post_init__(self) -> None:
        for name in ("direction", "color"):
            object.__setattr__(self, name, vector(getattr(self, name), name))
        if not float(np.linalg.norm(self.direction)) > 0:
            raise ValueError("direction: expected a direction that is not 0")
        if min(self.color) < 0:
            raise ValueError(f"color: expected numbers that are not negative, got {self.color}")
        if self.shadows is None:
            return
        from moit.catalog import technique
        from moit.shadows.shadow_map import ShadowMap

        if not isinstance(self.shadows, ShadowMap):
            technique(self.shadows)
