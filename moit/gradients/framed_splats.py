"""Pictures of splats whose numbers are a framework's arrays, and the way back to these."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.camera import Camera
from moit.geometry.splats import OF_DEGREE_0, Splats
from moit.gradients import scenes

Array = NDArray[Any]

NAMES = ("means", "scales", "rotations", "opacities")


def harmonics_of(colors: Any, sh: Any) -> Any:
    """(N, K, 3) of the one that is given, in the framework's arithmetic; TypeError for both or
    neither."""
    if (colors is None) == (sh is None):
        raise TypeError("colors, sh: expected one of the two")
    return (colors[:, None] - 0.5) / OF_DEGREE_0 if sh is None else sh


def check_camera(camera: Any) -> None:
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")


def drawn(
    arrays: Sequence[Array],
    camera: Camera,
    size: tuple[int, int],
    technique: str,
    convention: str,
    threads: int | None,
) -> tuple[Array, Any]:
    """The picture and its pullback; arrays: means, scales, rotations, opacities, harmonics, and the
    background."""
    *numbers, harmonics, behind = arrays
    means, scales, rotations, opacities = numbers
    splats = Splats(means, scales, rotations, opacities, sh=harmonics, convention=convention)
    return scenes.render(splats, camera, size, technique, background=behind, threads=threads)


def pulled(picture: tuple[Array, Any], seed: Array, rotations: Array) -> list[Array]:
    """By each of the arrays; rotations: quaternions as they were given, of any length, of which
    Splats makes ones of length 1."""
    by = picture[1](seed)
    turns = by.rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    return [by.means, by.scales, turns, by.opacities, by.sh, by.background]
