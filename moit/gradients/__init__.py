"""Derivatives of pictures and transmittances, backwards: for fitting by gradient descent.

Each function answers as the one of the same name in `moit` does, and gives a pullback beside: a
function from the derivatives of a loss by the answer to those by what the answer is made of.
Those named `_jvp` go forwards: from how fragments move to how the answer does.
"""

from __future__ import annotations

from moit.gradients.composites import (
    Gradients,
    composite,
    total_transmittance,
    transmittance,
)
from moit.gradients.forward import composite_jvp, total_transmittance_jvp
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
    "composite_jvp",
    "moments_bounds",
    "moments_transmittance",
    "rasterize",
    "render",
    "total_transmittance",
    "total_transmittance_jvp",
    "transmittance",
]
