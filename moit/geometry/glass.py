"""Meshes that let coloured light through, drawn as others are, twice."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.drawing import Emitted, Frame
from moit.geometry.meshes import Mesh, altered

# What is opaque but lets coloured light through hides nothing: it is drawn with this alpha.
NOT_QUITE_ONE = np.float32(1 - 2.0**-24)


def share_through(one: Any) -> float:
    """The share of light that passes through a part of a scene, tinted by its colour."""
    return one.transmission if isinstance(one, Mesh) else 0.0


def emit_glass(meshes: Sequence[Mesh], frame: Frame) -> tuple[Emitted, NDArray[np.float32]]:
    """(offsets, depth, alpha, color) and transmission (N, 3) of meshes of one transmission.

    A fragment's transmission is that share of its base colour, without light, and its colour is
    what remains of it, lit.
    """
    share = meshes[0].transmission
    bare = [
        altered(mesh, alpha=np.minimum(mesh.alpha, NOT_QUITE_ONE), transmission=0.0)
        for mesh in meshes
    ]
    offsets, depth, alpha, color = Mesh.emit(bare, frame)
    unlit = [altered(mesh, lit=False) for mesh in bare]
    base = Mesh.emit(unlit, dataclasses.replace(frame, shares=None))[3]
    alpha = np.where(alpha >= NOT_QUITE_ONE, np.float32(1), alpha)
    passed = np.clip(share * base, 0, 1).astype(np.float32)
    return (offsets, depth, alpha, ((1 - share) * color).astype(np.float32)), passed


def as_shadows_see(scene: Sequence[Any]) -> list[Any]:
    """The same, whose glass is as transparent as it is on the mean of its channels."""
    return [
        altered(
            one,
            alpha=one.alpha * (1 - one.transmission * np.clip(one.color, 0, 1).mean(axis=1)),
            transmission=0.0,
        )
        if share_through(one)
        else one
        for one in scene
    ]
