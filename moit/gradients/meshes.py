"""From fragments back to the colours and opacities of triangles and of the images on them.

Fragments are linear in these, so what is asked of the rasteriser is the factors: it draws the same
triangles again, in colours that say which triangle a fragment is of and where on it it lies.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.rasterizer import rasterized
from moit.gradients.texels import telling_levels, to_texels, white

Array = NDArray[Any]

MOST_TRIANGLES = 1 << 24  # which a float32 tells from one another


@dataclasses.dataclass(frozen=True, eq=False)
class MeshGradients:
    """Derivatives of a loss by what a mesh looks like, float32.

    color : (V, 3); of a colour that is one for all the sum.
    alpha : (V,); 0 where alpha_cutoff decides.
    texture : (H, W, 4), by the texels' linear colour and alpha; None where the mesh has none.

    >>> glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> f, pullback = moit.gradients.rasterize(glass, moit.Camera(), (16, 12))
    >>> by = pullback(f.depth * 0, f.alpha * 0 + 1, f.color * 0)  # of the sum of alpha
    >>> bool(np.isclose(by.meshes[0].alpha.sum(), len(f)))
    True
    """

    color: Array
    alpha: Array
    texture: Array | None


@dataclasses.dataclass(frozen=True, eq=False)
class SceneGradients:
    """Derivatives of a loss by a scene of meshes.

    meshes : of each mesh, in draw order.
    background : of the shape that it was given in; None where there was none.

    >>> glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> image, pullback = moit.gradients.render([glass], moit.Camera(), (16, 12), "power4")
    >>> by = pullback(image)
    >>> by.meshes[0].color.shape, by.background.shape
    ((3, 3), (3,))
    """

    meshes: tuple[MeshGradients, ...]
    background: Array | None = None


class DrawnMeshes:
    """Meshes as one picture sees them, checked.

    Raises MeshError for what has no derivatives.
    """

    def __init__(
        self,
        meshes: Sequence[Mesh],
        camera: Camera,
        size: tuple[int, int],
        lights: Any,
        threads: int,
    ) -> None:
        self.meshes = list(meshes)
        self._how = camera, size, threads, lights
        for i, mesh in enumerate(self.meshes):
            if mesh.transmission:
                raise MeshError(
                    f"scene[{i}].transmission: there are derivatives of meshes without; found "
                    f"{mesh.transmission}"
                )
        if sum(len(mesh.triangles) for mesh in self.meshes) > MOST_TRIANGLES:
            raise MeshError(f"scene: expected at most {MOST_TRIANGLES} triangles")

    def _draw(self, meshes: list[Mesh]) -> Fragments:
        return rasterized(meshes, *self._how)

    def fragments(self) -> Fragments:
        return self._draw(self.meshes)

    def pull(self, f: Fragments, d_alpha: Array, d_color: Array) -> tuple[MeshGradients, ...]:
        """By each mesh, from the derivatives by alpha and color of `fragments`, (N,), (N, 3)."""
        triangle, weights, seen = self._places()
        # light and image, by which colour and alpha of vertices are multiplied
        factors = self._draw([_but(one, color=1.0, alpha=_there(one)) for one in self.meshes])
        shine = _color_of(factors) * d_color
        # what is opaque stays so
        by_alpha = np.where(f.alpha == 1, 0, d_alpha)
        textured = any(mesh.texture is not None for mesh in self.meshes)
        lit, levels = (self._lit(), self._levels()) if textured else (None, None)
        found, first = [], 0
        for mesh in self.meshes:
            own = np.flatnonzero((triangle >= first) & (triangle < first + len(mesh.triangles)))
            corners, w = mesh.triangles[triangle[own] - first], weights[own]
            first += len(mesh.triangles)
            share = np.divide(
                factors.alpha[own], seen[own], out=np.zeros(len(own)), where=seen[own] > 0
            )
            opacity = by_alpha[own] * share * (mesh.alpha_cutoff is None)
            color = [_gathered(corners, w, shine[own, c], len(mesh.vertices)) for c in range(3)]
            alpha = _gathered(corners, w, opacity, len(mesh.vertices))
            texels = None
            if mesh.texture is not None and mesh.uv is not None:
                assert lit is not None and levels is not None
                by = np.empty((len(own), 4))
                vertex = (mesh.color[corners] * w[..., None]).sum(axis=1)
                by[:, :3] = d_color[own] * vertex * (_color_of(lit)[own] if mesh.lit else 1)
                solid = mesh.alpha_cutoff is not None
                by[:, 3] = 0 if solid else by_alpha[own] * (mesh.alpha[corners] * w).sum(axis=1)
                place = (mesh.uv[corners] * w[..., None]).sum(axis=1)
                texels = to_texels(mesh.texture, place, levels[own], by)
            found.append(MeshGradients(np.stack(color, axis=1).astype(np.float32), alpha, texels))
        return tuple(found)

    def _places(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Of each fragment its triangle, counted through all meshes; the weights of its corners,
        (N, 3); and what their opacities (`_there`) are there."""
        told, opacities, first = [], [], 0
        for mesh in self.meshes:
            count = len(mesh.triangles)
            color = np.zeros((count, 3, 3), np.float32)
            color[:, 1, 0] = color[:, 2, 1] = 1
            color[:, :, 2] = first + np.arange(count)[:, None]
            told.append(_apart(mesh, color))
            opacities.append(_there(mesh)[mesh.triangles])
            first += count
        found = _color_of(self._draw(told)).astype(np.float64)
        triangle = np.rint(found[:, 2]).astype(np.int64)
        second, third = found[:, 0], found[:, 1]
        weights = np.stack([1 - second - third, second, third], axis=1)
        every = np.concatenate([*opacities, np.zeros((0, 3))])
        return triangle, weights, (every[triangle] * weights).sum(axis=1)

    def _lit(self) -> Fragments:
        """Fragments whose colour is the light on white."""
        plain = [one.texture and white(one.texture) for one in self.meshes]
        pairs = zip(self.meshes, plain, strict=True)
        return self._draw([_but(one, color=1.0, texture=image) for one, image in pairs])

    def _levels(self) -> Array:
        """Of each fragment the level that its image is read at."""
        told = [one.texture and telling_levels(one.texture) for one in self.meshes]
        pairs = zip(self.meshes, told, strict=True)
        some = [_but(one, color=1.0, texture=image, lit=False) for one, image in pairs]
        return _color_of(self._draw(some))[:, 0].astype(np.float64)


def _color_of(f: Fragments) -> Array:
    assert f.color is not None
    return f.color


def _there(mesh: Mesh) -> Array:
    """Opacities that are not 0, so that a factor can be told; where they decide what is there,
    as they are. What is opaque is so as before."""
    if mesh.alpha_cutoff is not None:
        return mesh.alpha
    return np.where(mesh.alpha > 0, mesh.alpha, np.float32(0.5))


def _but(mesh: Mesh, **changed: Any) -> Mesh:
    held = {
        "color": mesh.color,
        "alpha": mesh.alpha,
        "normals": mesh.normals,
        "uv": mesh.uv,
        "texture": mesh.texture,
        "alpha_cutoff": mesh.alpha_cutoff,
        "lit": mesh.lit,
        "origin": mesh.origin,
    } | changed
    if np.ndim(held["color"]) == 0:
        held["color"] = np.full(3, held["color"])
    return Mesh(mesh.vertices, mesh.triangles, **held)


def _apart(mesh: Mesh, color: Array) -> Mesh:
    """Unlit, in these colours of each triangle's corners, (T, 3, 3)."""
    corners = mesh.triangles.ravel()
    return Mesh(
        mesh.vertices[corners],
        np.arange(len(corners)).reshape(-1, 3),
        color.reshape(-1, 3),
        mesh.alpha[corners],
        uv=None if mesh.uv is None else mesh.uv[corners],
        texture=mesh.texture and white(mesh.texture),
        alpha_cutoff=mesh.alpha_cutoff,
        lit=False,
        origin=mesh.origin,
    )


def _gathered(corners: Array, weights: Array, by: Array, count: int) -> NDArray[np.float32]:
    """(count,): sums over fragments of what goes to their corners."""
    shares = (weights * by[:, None]).ravel()
    return np.bincount(corners.ravel(), shares, count).astype(np.float32)
