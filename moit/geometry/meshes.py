"""Triangle meshes: made of arrays, or read from files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arguments import path_name, truth
from moit.checks.arrays import as_array, finite, integers
from moit.checks.exceptions import MoitError
from moit.geometry.drawing import Emitted, Frame, drawables_of
from moit.geometry.textures import FILTERS, WHITE, WRAPS, Texture

Array = NDArray[Any]
MOST_VERTICES = 2**31 - 1


class MeshError(MoitError, ValueError):
    """A mesh cannot be read, or its arrays do not make one.

    >>> issubclass(moit.MeshError, moit.MoitError)
    True
    """


class Mesh:
    """Triangles with a colour and an opacity.

    vertices : (V, 3) positions, finite.
    triangles : (T, 3) integers: the vertices of each triangle. Both sides are seen.
    color : (3,) for all or (V, 3): linear, not multiplied by alpha, finite, not negative.
    alpha : a number for all or (V,): opacity in [0, 1]. A triangle is opaque where it is 1 at all
        three corners.
    normals : (V, 3), of any length; None: each triangle is flat.
    uv : (V, 2) finite: where vertices lie on the texture, (0, 0) its upper left corner, v down.
    texture : what multiplies colour and alpha, point by point; a triangle is then opaque where it
        is so at its corners and the texture everywhere. Needs uv.
    alpha_cutoff : None, or a number that is not negative: what has less alpha is not there, the
        rest is opaque (glTF's MASK).
    lit : whether light falls on it; else its colour is what is seen.

    Between vertices all is interpolated. Arrays are held as read-only float32 and int32 copies.
    Raises MeshError (a ValueError) or TypeError that name the argument.

    >>> glass = moit.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> glass.vertices.shape, glass.triangles.shape
    ((3, 3), (1, 3))
    """

    __slots__ = (
        "alpha",
        "alpha_cutoff",
        "color",
        "lit",
        "normals",
        "texture",
        "triangles",
        "uv",
        "vertices",
    )

    vertices: Array
    triangles: Array
    color: Array
    alpha: Array
    normals: Array | None
    uv: Array | None
    texture: Texture | None
    alpha_cutoff: float | None
    lit: bool

    def __init__(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        color: ArrayLike = (0.7, 0.7, 0.7),
        alpha: ArrayLike = 1.0,
        normals: ArrayLike | None = None,
        *,
        uv: ArrayLike | None = None,
        texture: Texture | None = None,
        alpha_cutoff: float | None = None,
        lit: bool = True,
    ) -> None:
        place = _numbers(vertices, "vertices")
        if place.ndim != 2 or place.shape[1] != 3 or len(place) > MOST_VERTICES:
            raise MeshError(f"vertices: expected shape (V, 3), got {place.shape}")
        count = len(place)
        corners = integers(triangles, "triangles")
        if corners.size == 0 and corners.ndim < 2:
            corners = corners.reshape(0, 3)
        if corners.ndim != 2 or corners.shape[1] != 3:
            raise MeshError(f"triangles: expected shape (T, 3), got {corners.shape}")
        wrong = (corners < 0) | (corners >= count)
        if wrong.any():
            row, column = (int(i) for i in np.unravel_index(int(wrong.argmax()), wrong.shape))
            raise MeshError(
                f"triangles[{row}, {column}]: found {corners[row, column]}; needed one of "
                f"{count} vertices, from 0"
            )
        shades = _per_vertex(color, "color", (3,), count)
        _check(shades, "color", shades >= 0, "a number that is not negative")
        opacity = _per_vertex(alpha, "alpha", (), count)
        _check(opacity, "alpha", (opacity >= 0) & (opacity <= 1), "a number in [0, 1]")
        directions = None
        if normals is not None:
            directions = _numbers(normals, "normals")
            if directions.shape != place.shape:
                raise MeshError(f"normals: expected shape {place.shape}, got {directions.shape}")
        places = None
        if uv is not None:
            places = _numbers(uv, "uv")
            if places.shape != (count, 2):
                raise MeshError(f"uv: expected shape {(count, 2)}, got {places.shape}")
        if texture is not None and not isinstance(texture, Texture):
            raise TypeError(f"texture: expected a Texture or None, got {type(texture).__name__}")
        if texture is not None and places is None:
            raise MeshError("texture: needed uv, which says where on it vertices lie; got None")
        held = {
            "vertices": place,
            "triangles": corners.astype(np.int32),
            "color": shades,
            "alpha": opacity,
            "normals": directions,
            "uv": places,
            "texture": texture,
            "alpha_cutoff": _cutoff(alpha_cutoff),
            "lit": truth("lit", lit),
        }
        for name, value in held.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Mesh does not change: cannot set {name}")

    def __repr__(self) -> str:
        least, most = (float(f(self.alpha)) if len(self.alpha) else 0 for f in (np.min, np.max))
        alpha = f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"
        sizes = f"{len(self.vertices)} vertices, {len(self.triangles)} triangles"
        return f"Mesh({sizes}, alpha {alpha})"

    @property
    def transparent(self) -> NDArray[np.bool_]:
        """(T,) whether each triangle lets light through somewhere; holes by alpha_cutoff do not
        count: what is there beside them is opaque."""
        if self.alpha_cutoff is not None:
            return np.zeros(len(self.triangles), np.bool_)
        if self.texture is not None and self.texture.transparent:
            return np.ones(len(self.triangles), np.bool_)
        found: NDArray[np.bool_] = (self.alpha[self.triangles].reshape(-1, 3) < 1).max(
            axis=1, initial=False
        )
        return found

    @property
    def worn(self) -> tuple[Texture | None, float | None, bool]:
        """What says how it looks beside its vertices."""
        return self.texture, self.alpha_cutoff, self.lit

    @property
    def wears_something(self) -> bool:
        return self.worn != (None, None, True)

    # As a moit.geometry.drawing.Drawable

    @property
    def points(self) -> Array:
        return self.vertices

    @property
    def transparent_points(self) -> Array:
        found: Array = self.vertices[np.unique(self.triangles[self.transparent])]
        return found

    @classmethod
    def emit(cls, several: Sequence[Mesh], frame: Frame) -> Emitted:
        if frame.lists_opaque:  # which materials alone can ask for
            mesh = mesh_arrays(several, all_worn=True, listed=1)
        else:
            mesh = mesh_arrays(several)
        drawn = (mesh, seen_in(frame), *frame.size, frame.threads, frame.lights)
        arrays = _core.rasterize(*drawn)
        if frame.shares is not None:
            arrays = _core.rasterize(*drawn, frame.shares(*arrays[:3]))
        return arrays


Meshes = Mesh | Sequence[Mesh]


def altered(mesh: Mesh, **changes: Any) -> Mesh:
    """The mesh with other arrays or options, the rest as it is."""
    return Mesh(**{name: getattr(mesh, name) for name in Mesh.__slots__} | changes)


def meshes_of(scene: Any, name: str = "scene") -> list[Mesh]:
    """The meshes of a scene, in draw order."""
    return drawables_of(scene, name, Mesh)


def seen_in(frame: Frame) -> tuple[Any, ...]:
    """What the core is told of who looks."""
    axes = (tuple(axis.tolist()) for axis in frame.axes)
    return (frame.eye, *axes, frame.scale, frame.near, frame.far)


def mesh_arrays(
    meshes: Sequence[Mesh],
    firsts: dict[Texture, int] | None = None,
    all_worn: bool = False,
    **changes: float,
) -> tuple[Any, ...]:
    """All as one, in order, as the core draws them: (vertices, normals, color, alpha, triangles),
    and where any wears something (uv, rows of materials, these, their texels).

    firsts : where the texels of each texture begin, for who draws elsewhere.
    all_worn : those that wear nothing get a material that changes nothing, too.
    changes : of all materials' numbers, by name.
    """
    meshes = with_normals(meshes)
    arrays = joined(meshes)
    worn = [mesh for mesh in meshes if all_worn or mesh.wears_something]
    if not worn:
        return arrays
    row = {id(mesh): i for i, mesh in enumerate(worn)}
    which = [row.get(id(mesh), -1) for mesh in meshes]
    rows = [list((material_of(mesh, firsts) | changes).values()) for mesh in worn]
    return (
        *arrays,
        np.concatenate([texture_places(mesh) for mesh in meshes]),
        np.repeat(np.array(which, np.int32), [len(mesh.triangles) for mesh in meshes]),
        np.array(rows, np.float64),
        tuple(texture_of(mesh).levels for mesh in worn),
    )


def texture_of(mesh: Mesh) -> Texture:
    """A white one where it has none."""
    return mesh.texture or WHITE


def texture_places(mesh: Mesh) -> Array:
    """Its uv; all at one place where it has none."""
    return np.zeros((len(mesh.vertices), 2), np.float32) if mesh.uv is None else mesh.uv


def material_of(mesh: Mesh, firsts: dict[Texture, int] | None = None) -> dict[str, float]:
    """The numbers of a moit_material of csrc/moit.h, in their order."""
    texture = texture_of(mesh)
    height, width, _ = texture.texels.shape
    wrap_u, wrap_v = (WRAPS.index(one) for one in texture.wraps)
    return {
        "first": 0 if firsts is None else firsts[texture],
        "width": width,
        "height": height,
        "filtering": FILTERS.index(texture.filter),
        "wrap_u": wrap_u,
        "wrap_v": wrap_v,
        "transparent": texture.transparent,
        "masked": mesh.alpha_cutoff is not None,
        "cutoff": mesh.alpha_cutoff or 0.0,
        "lit": mesh.lit,
        "painted": True,
        "listed": False,
    }


def joined(meshes: Sequence[Mesh]) -> tuple[Array, Array | None, Array, Array, Array]:
    """All as one, in order: (vertices, normals, color, alpha, triangles), without what they wear.

    Where any has normals, the facets of the others get vertices of their own that have theirs.
    """
    meshes = with_normals(meshes)
    start = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    if start[-1] > MOST_VERTICES:
        raise MeshError(f"scene: expected at most {MOST_VERTICES} vertices, got {start[-1]}")
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    empty = np.zeros((0, 3), np.float32)
    return (
        np.concatenate([empty, *(mesh.vertices for mesh in meshes)]),
        np.concatenate(normals) if normals else None,
        np.concatenate([empty, *(mesh.color for mesh in meshes)]),
        np.concatenate([empty[:, 0], *(mesh.alpha for mesh in meshes)]),
        np.concatenate(
            [
                np.zeros((0, 3), np.int32),
                *(mesh.triangles + np.int32(i) for mesh, i in zip(meshes, start[:-1], strict=True)),
            ]
        ),
    )


def with_normals(meshes: Sequence[Mesh]) -> Sequence[Mesh]:
    """The same where none has normals."""
    if all(mesh.normals is None for mesh in meshes):
        return meshes
    return [mesh if mesh.normals is not None else _faceted(mesh) for mesh in meshes]


def _faceted(mesh: Mesh) -> Mesh:
    corners = mesh.triangles.reshape(-1)
    place = mesh.vertices[corners]
    a, b, c = place.reshape(-1, 3, 3).astype(np.float64).transpose(1, 0, 2)
    normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    return altered(
        mesh,
        vertices=place,
        triangles=triangles,
        color=mesh.color[corners],
        alpha=mesh.alpha[corners],
        normals=normals,
        uv=None if mesh.uv is None else mesh.uv[corners],
    )


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """The mesh of a file: OBJ, PLY, glTF (.gltf, .glb), STL or OFF, by trimesh.

    Parts of a file become one mesh. Vertex colours and materials' base colours become linear color
    and alpha; what has none is grey and opaque.

    Raises FileNotFoundError where there is no such file, MeshError (a ValueError) where it cannot
    be read or holds no triangles, and ImportError, naming the extra, where trimesh is missing.

    >>> with open("triangle.obj", "w") as file:
    ...     _ = file.write("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> moit.read_mesh("triangle.obj").triangles.shape
    (1, 3)
    """
    name = path_name(path)
    if not os.path.exists(name):
        raise FileNotFoundError(f"path: there is no file {name!r}")
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "read_mesh needs trimesh: pip install 'moit[mesh]' installs it"
        ) from error
    try:
        scene = trimesh.load_scene(name)
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh)]
        found = [_from_trimesh(part) for part in parts if len(part.faces)]
    except MeshError:
        raise
    except Exception as error:  # trimesh and its readers raise anything
        raise MeshError(f"{name!r}: cannot be read as a mesh: {error}") from error
    if not found:
        raise MeshError(f"{name!r}: expected triangles, found none")
    vertices, normals, color, alpha, triangles = joined(found)
    return Mesh(vertices, triangles, color, alpha, normals)


def _from_trimesh(part: Any) -> Mesh:
    visual = part.visual
    if visual.kind == "texture":
        visual = visual.to_color()
    shades = np.full((len(part.vertices), 4), 178, np.uint8)
    shades[:, 3] = 255
    if visual.kind in ("vertex", "face"):
        shades = np.asarray(visual.vertex_colors)
    share = shades[:, :3] / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return Mesh(part.vertices, part.faces, linear, shades[:, 3] / 255.0, part.vertex_normals)


def _numbers(value: ArrayLike, name: str) -> Array:
    array = as_array(value, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got {array.dtype}")
    try:
        return finite(array, name, np.float32).copy()
    except ValueError as error:
        raise MeshError(*error.args) from None


def _per_vertex(value: ArrayLike, name: str, one: tuple[int, ...], count: int) -> Array:
    array = _numbers(value, name)
    if array.shape == one:
        array = np.broadcast_to(array, (count, *one)).copy()
    if array.shape != (count, *one):
        raise MeshError(f"{name}: expected shape {one} or {(count, *one)}, got {array.shape}")
    return array


def _cutoff(value: float | None) -> float | None:
    if value is None:
        return None
    cutoff = _numbers(value, "alpha_cutoff")
    if cutoff.shape != () or not cutoff >= 0:
        raise MeshError(f"alpha_cutoff: expected a number that is not negative, got {value!r:.80}")
    return float(cutoff)  # as texels are: equal is equal


def _check(array: Array, name: str, good: NDArray[np.bool_], needed: str) -> None:
    if not good.all():
        at = np.unravel_index(int(np.argmin(good)), array.shape)
        place = ", ".join(str(int(i)) for i in at)
        raise MeshError(f"{name}[{place}]: found {array[at]}; needed {needed}")
