"""Derivatives of pictures and transmittances, backwards: for fitting by gradient descent.

Each function answers as the one of the same name in `moit` does, and gives a pullback beside: a
function from the derivatives of a loss by the answer to those by what the answer is made of.
"""

from __future__ import annotations

from moit.gradients.composites import (
    Gradients,
    composite,
    total_transmittance,
    transmittance,
)
from moit.gradients.meshes import MeshGradients, SceneGradients
from moit.gradients.moments import MomentGradients, moments_bounds, moments_transmittance
from moit.gradients.scenes import SplatGradients, rasterize, render

__all__ = [
    "Gradients",
    "MeshGradients",
    "MomentGradients",
    "SceneGradients",
    "SplatGradients",
    "composite",
    "moments_bounds",
    "moments_transmittance",
    "rasterize",
    "render",
    "total_transmittance",
    "transmittance",
]
