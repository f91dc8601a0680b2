"""Triangle meshes, made of arrays."""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite, integers
from moit.checks.exceptions import MeshError
from moit.checks.unchanging import Unchanging
from moit.geometry.attributes import Attributes
from moit.geometry.drawing import Drawable, Emitted, Frame
from moit.geometry.foreign import foreign_meshes
from moit.geometry.normals import facet_normals
from moit.geometry.textures import FILTERS, WHITE, WRAPS, Texture

Array = NDArray[Any]
MOST_VERTICES = 2**31 - 1
OF_MESH = Attributes(MeshError)

# So many times farther from 0 than it is large, float32 starts to move a mesh's vertices visibly:
# it has 24 bits, of which six are then lost.
FAR_AWAY = 64.0


class Mesh(Unchanging):
    """Triangles with a colour and an opacity.

    vertices : (V, 3) positions, finite; or a mesh of another library, without triangles: a
        trimesh.Trimesh, a pyvista.PolyData, or what has vertices and faces as one of these does.
        Other arguments take the place of what it has.
    triangles : (T, 3) integers: the vertices of each triangle. Both sides are seen.
    color : (3,) for all or (V, 3): linear, not multiplied by alpha, finite, not negative. A fourth
        number is alpha.
    alpha : a number for all or (V,): opacity in [0, 1], times color's. A triangle is opaque where
        it is 1 at all three corners.
    normals : (V, 3), of any length; None: each triangle is flat.
    uv : (V, 2) finite: where vertices lie on the texture, (0, 0) its upper left corner, v down.
    texture : what multiplies colour and alpha, point by point; a triangle is then opaque where it
        is so at its corners and the texture everywhere. Needs uv.
    alpha_cutoff : None, or a number that is not negative: what has less alpha is not there, the
        rest is opaque (glTF's MASK).
    lit : whether light falls on it; else its colour is what is seen.
    transmission : in [0, 1], the share of light that passes where there is something, tinted: a
        fragment's transmission is this share of its own colour, and its colour the rest of that
        (glTF's KHR_materials_transmission, without refraction). Not with alpha_cutoff.
    origin : (3,) where in the scene position (0, 0, 0) of `vertices` lies. None: vertices are
        positions in the scene, and where they are of float64 (or integers) and far from 0, an
        origin near them is subtracted before they become float32.
    color_space : "linear", or "srgb" for colours in [0, 1] that are to be decoded. Those of uint8
        and uint16 are shares of 255 and 65535, of other integers of 255, and need "srgb".
        Alpha is linear always.

    With `antialias` a pixel has a fragment of each surface that touches it, whose alpha counts by
    the area of the pixel that is covered. Triangles that share a corner (or an edge, whichever way
    they turn) are one surface where the picture sees them from one side: areas add up, so that
    edges between neighbours are not seen, and a closed opaque surface stays opaque. Depth and
    colour are those of the middles of areas, weighted by these.

    Between vertices all is interpolated. Arrays are held as read-only float32 and int32 copies;
    `vertices` are relative to `origin`, `points` are positions in the scene.
    Raises MeshError (a ValueError) or TypeError that name the argument.

    >>> glass = moit.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    >>> glass.vertices.shape, glass.triangles.shape
    ((3, 3), (1, 3))
    >>> far = moit.Mesh([[5e6, 0, 0], [5e6 + 1, 0, 0], [5e6, 1, 0]], [[0, 1, 2]])
    >>> far.origin.tolist(), far.vertices[1].tolist()
    ([5000000.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    """

    __slots__ = (
        "alpha",
        "alpha_cutoff",
        "color",
        "lit",
        "normals",
        "origin",
        "texture",
        "transmission",
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
    transmission: float
    origin: NDArray[np.float64]

    def __init__(
        self,
        vertices: ArrayLike | Any,
        triangles: ArrayLike | None = None,
        color: ArrayLike = (0.7, 0.7, 0.7),
        alpha: ArrayLike = 1.0,
        normals: ArrayLike | None = None,
        *,
        uv: ArrayLike | None = None,
        texture: Texture | None = None,
        alpha_cutoff: float | None = None,
        lit: bool = True,
        transmission: float = 0.0,
        origin: ArrayLike | None = None,
        color_space: str = "linear",
    ) -> None:
        if triangles is None:
            given = _arrays_of_one(vertices)
            if given is None:
                raise TypeError(
                    "triangles: needed (T, 3) integers; without them vertices must be a mesh, as "
                    f"a trimesh.Trimesh is, got {type(vertices).__name__}"
                )
            others: dict[str, Any] = {"color": color, "alpha": alpha, "normals": normals, "uv": uv}
            others |= {"texture": texture, "alpha_cutoff": alpha_cutoff, "lit": lit}
            others |= {"transmission": transmission, "origin": origin, "color_space": color_space}
            asked = {name: one for name, one in others.items() if one is not USUAL[name]}
            # mypy: whatever a class derived from this one takes
            self.__init__(**(given | asked))  # type: ignore[misc]
            return
        place, start = _placed(vertices, origin)
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
        shades, own = OF_MESH.shades(color, color_space, count)
        opacity = OF_MESH.opacities(alpha, "alpha", count)
        if own is not None:
            opacity = opacity * own
        directions = None
        if normals is not None:
            directions = OF_MESH.numbers(normals, "normals")
            if directions.shape != place.shape:
                raise MeshError(f"normals: expected shape {place.shape}, got {directions.shape}")
        places = None
        if uv is not None:
            places = OF_MESH.numbers(uv, "uv")
            if places.shape != (count, 2):
                raise MeshError(f"uv: expected shape {(count, 2)}, got {places.shape}")
        if texture is not None and not isinstance(texture, Texture):
            raise TypeError(f"texture: expected a Texture or None, got {type(texture).__name__}")
        if texture is not None and places is None:
            raise MeshError("texture: needed uv, which says where on it vertices lie; got None")
        passed = OF_MESH.each(transmission, "transmission", (), 1)
        OF_MESH.check(passed, "transmission", (passed >= 0) & (passed <= 1), "a number in [0, 1]")
        if passed[0] and alpha_cutoff is not None:
            raise MeshError("transmission: what is cut out by alpha_cutoff is opaque; needed 0")
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
            "transmission": float(passed[0]),
            "origin": start,
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
        at = f", origin {tuple(self.origin.tolist())}" if self.origin.any() else ""
        return f"Mesh({sizes}, alpha {alpha}{at})"

    @property
    def transparent(self) -> NDArray[np.bool_]:
        """(T,) whether each triangle lets light through somewhere; holes by alpha_cutoff do not
        count: what is there beside them is opaque."""
        if self.alpha_cutoff is not None:
            return np.zeros(len(self.triangles), np.bool_)
        if self.transmission or (self.texture is not None and self.texture.transparent):
            return np.ones(len(self.triangles), np.bool_)
        found: NDArray[np.bool_] = (self.alpha[self.triangles].reshape(-1, 3) < 1).max(
            axis=1, initial=False
        )
        return found

    @property
    def worn(self) -> tuple[Texture | None, float | None, bool, float]:
        """What says how it looks beside its vertices."""
        return self.texture, self.alpha_cutoff, self.lit, self.transmission

    @property
    def wears_something(self) -> bool:
        return self.worn != (None, None, True, 0.0)

    # As a moit.geometry.drawing.Drawable

    @property
    def points(self) -> Array:
        """(V, 3) positions in the scene: float64 where there is an origin."""
        return self.vertices + self.origin if self.origin.any() else self.vertices

    @property
    def transparent_points(self) -> Array:
        found: Array = self.points[corners_of(self, self.transparent)]
        return found

    @classmethod
    def emit(cls, several: Sequence[Mesh], frame: Frame) -> Emitted:
        origin = common_origin(several, frame.eye)
        if frame.lists_opaque:  # which materials alone can ask for
            mesh = mesh_arrays(several, origin, all_worn=True, listed=1)
        else:
            mesh = mesh_arrays(several, origin)
        drawn = (mesh, seen_in(frame, origin), *frame.size, frame.threads, frame.lights)
        arrays = _core.rasterize(*drawn, None, frame.antialias)
        if frame.shares is not None:
            arrays = _core.rasterize(*drawn, frame.shares(*arrays[:3]), frame.antialias)
        return arrays


Meshes = Mesh | Sequence[Mesh]
USUAL = {name: one.default for name, one in inspect.signature(Mesh).parameters.items()}


def altered(mesh: Mesh, **changes: Any) -> Mesh:
    """The mesh with other arrays or options, the rest as it is."""
    return Mesh(**{name: getattr(mesh, name) for name in Mesh.__slots__} | changes)


def drawables_of(scene: Any, name: str = "scene", kind: Any = Drawable) -> list[Any]:
    """The parts of a scene, in draw order; meshes of other libraries as Meshes.

    kind : of which each must be.
    """
    several = isinstance(scene, Sequence) and not isinstance(scene, str | bytes)
    found = scene if several else [scene]
    parts: list[Any] = []
    needed = "a Mesh" if kind is Mesh else "a Mesh, Splats, Points, Lines or a Volume"
    for i, one in enumerate(found):
        if isinstance(one, kind):
            parts.append(one)
            continue
        given = foreign_meshes(one)
        if given is None and not several:
            raise TypeError(f"{name}: expected {needed} or several, got {type(scene).__name__}")
        if given is None:
            raise TypeError(f"{name}[{i}]: expected {needed}, got {type(one).__name__}")
        parts += [Mesh(**arrays) for arrays in given]
    return parts


def meshes_of(scene: Any, name: str = "scene") -> list[Mesh]:
    """The meshes of a scene, in draw order."""
    return drawables_of(scene, name, Mesh)


def near_origin(least: Array, most: Array) -> NDArray[np.float64]:
    """(3,) float64: an origin for what lies between (3,) least and most; 0 unless far from 0."""
    extent = float((most - least).max())
    middle = least / 2 + most / 2
    if not 0 < FAR_AWAY * extent < float(np.abs(middle).max()):
        return np.zeros(3)
    # a multiple of a power of two, which parts of a scene that lie side by side often share
    step = 2.0 ** math.ceil(math.log2(extent))
    return np.asarray(np.round(middle / step) * step)


def corners_of(mesh: Mesh, some: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """(V,) whether a vertex is a corner of a triangle, or of one of those that `some` (T,) says."""
    found = np.zeros(len(mesh.vertices), bool)
    found[mesh.triangles if some is None else mesh.triangles[some]] = True
    return found


def common_origin(meshes: Sequence[Mesh], eye: ArrayLike) -> NDArray[np.float64]:
    """(3,): what to put meshes together at: their origin if they share one, else the eye.

    From there float32 is finer than what the eye can tell apart: a vertex moves by less than 1e-7
    of its distance.
    """
    origins = {tuple(mesh.origin.tolist()) for mesh in meshes}
    if len(origins) > 1:
        return np.array(eye, np.float64)
    return np.array(origins.pop() if origins else (0.0, 0.0, 0.0))


def seen_in(frame: Frame, origin: NDArray[np.float64]) -> tuple[Any, ...]:
    """What the core is told of who looks at vertices that are relative to `origin`."""
    axes = (tuple(axis.tolist()) for axis in frame.axes)
    eye = tuple((np.array(frame.eye) - origin).tolist())
    return (eye, *axes, frame.scale, frame.near, frame.far)


def mesh_arrays(
    meshes: Sequence[Mesh],
    origin: NDArray[np.float64],
    firsts: dict[Texture, int] | None = None,
    all_worn: bool = False,
    **changes: float,
) -> tuple[Any, ...]:
    """All as one, in order, as the core draws them: (vertices, normals, color, alpha, triangles),
    and where any wears something (uv, rows of materials, these, their texels).

    origin : what the vertices are then relative to.
    firsts : where the texels of each texture begin, for who draws elsewhere.
    all_worn : those that wear nothing get a material that changes nothing, too.
    changes : of all materials' numbers, by name.
    """
    meshes = with_normals(meshes)
    arrays = joined(meshes, origin)
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
    """The numbers of a moit_material of csrc/moit_geometry.h, in their order."""
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


def joined(
    meshes: Sequence[Mesh], origin: NDArray[np.float64]
) -> tuple[Array, Array | None, Array, Array, Array]:
    """All as one, in order: (vertices, normals, color, alpha, triangles), without what they wear.

    origin : what the vertices are then relative to.

    Where any has normals, the facets of the others get vertices of their own that have theirs.
    """
    meshes = [_moved(mesh, origin) for mesh in with_normals(meshes)]
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
    return altered(
        mesh,
        vertices=place,
        triangles=np.arange(len(corners)).reshape(-1, 3),
        color=mesh.color[corners],
        alpha=mesh.alpha[corners],
        normals=facet_normals(place.reshape(-1, 3, 3)).repeat(3, axis=0),
        uv=None if mesh.uv is None else mesh.uv[corners],
    )


def _moved(mesh: Mesh, origin: NDArray[np.float64]) -> Mesh:
    """Relative to another origin."""
    if (mesh.origin == origin).all():
        return mesh
    place = mesh.vertices + (mesh.origin - origin)
    return altered(mesh, vertices=finite(place, "vertices", np.float32), origin=origin)


def _arrays_of_one(value: Any) -> dict[str, Any] | None:
    """The arguments that make one Mesh of a foreign one; None where it is none."""
    given = foreign_meshes(value)
    if given is not None and len(given) != 1:
        raise MeshError(
            f"vertices: {type(value).__name__} holds {len(given)} meshes; needed one. A scene may "
            "be all of them: rasterize and render take it as it is"
        )
    return None if given is None else given[0]


def _placed(
    vertices: ArrayLike, origin: ArrayLike | None
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Positions in float32 and what they are relative to."""
    place = OF_MESH.numbers(vertices, "vertices")
    if place.ndim != 2 or place.shape[1] != 3 or len(place) > MOST_VERTICES:
        raise MeshError(f"vertices: expected shape (V, 3), got {place.shape}")
    if origin is not None:
        start = as_array(origin, "origin")
        if start.dtype.kind not in "fiu" or start.shape != (3,):
            raise MeshError(f"origin: expected three real numbers, got {origin!r:.80}")
        return place, OF_MESH.finite(start, "origin", np.float64).copy()
    given = as_array(vertices, "vertices")
    if not given.size or (given.dtype.kind == "f" and given.dtype.itemsize <= 4):
        return place, np.zeros(3)
    exact = np.asarray(given, np.float64)
    start = near_origin(exact.min(axis=0), exact.max(axis=0))
    return ((exact - start).astype(np.float32) if start.any() else place), start


def _cutoff(value: float | None) -> float | None:
    if value is None:
        return None
    cutoff = OF_MESH.numbers(value, "alpha_cutoff")
    if cutoff.shape != () or not cutoff >= 0:
        raise MeshError(f"alpha_cutoff: expected a number that is not negative, got {value!r:.80}")
    return float(cutoff)  # as texels are: equal is equal
