"""What a device draws of each kind of `moit.geometry.drawing.Drawable`.

A kind is records in a buffer, a vertex shader that brings these to the screen, and a text that says
what one is in a pixel. All passes over pictures include that text where they say PRIMITIVE.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from numpy.typing import NDArray

from moit.checks.exceptions import GpuError
from moit.geometry.camera import Camera
from moit.geometry.glass import share_through
from moit.geometry.meshes import Mesh, texture_of, with_normals
from moit.geometry.rasterizer import screen_triangles
from moit.geometry.splats import Splats
from moit.geometry.splats import kind_of as kind_of_splats
from moit.geometry.strokes import Lines, Points, Strokes, kind_of
from moit.geometry.textures import Texture
from moit.gpu.splats import UnsortedSplats, primitive_of
from moit.gpu.strokes import StrokeParts

Array = NDArray[Any]


class Primitive(Protocol):
    """One kind.

    vertex : the vertex shader, `corners` calls a record.
    surface : the text; that of triangles, shaders/meshes/surface.glsl, names what passes call.
    """

    @property
    def vertex(self) -> str: ...
    @property
    def surface(self) -> str: ...
    @property
    def corners(self) -> int: ...

    def records(
        self, several: Sequence[Any], camera: Camera, width: int, height: int, threads: int | None
    ) -> Array:
        """(n,) structs as the text has them, in draw order. Fields `opaque`, 1 where alpha is 1
        everywhere, and `alpha`, (n, k) of which the greatest is that of the record."""

    # A kind whose text has more buffers than that of records, or whose records look at one another,
    # has `buffers(device, records, width, height)`, which gives them by their numbers; `records` is
    # the buffer of what the method above gave last. All of it is in one buffer then, and `named`
    # says in messages what records are.


@dataclasses.dataclass(frozen=True)
class Triangles:
    """Meshes, as the core projects, clips and snaps them."""

    vertex: str = "meshes/triangles.vert.glsl"
    surface: str = "meshes/surface.glsl"
    corners: int = 3

    def records(
        self, several: Sequence[Mesh], camera: Camera, width: int, height: int, threads: int | None
    ) -> Array:
        return screen_triangles(list(several), camera, width, height, threads)


@dataclasses.dataclass(frozen=True)
class TexturedTriangles:
    """Meshes that wear something. firsts : where the texels of each texture begin."""

    firsts: dict[Texture, int]
    vertex: str = "meshes/textured.vert.glsl"
    surface: str = "meshes/textured.glsl"
    corners: int = 3

    def records(
        self, several: Sequence[Mesh], camera: Camera, width: int, height: int, threads: int | None
    ) -> Array:
        return screen_triangles(list(several), camera, width, height, threads, self.firsts)


PRIMITIVES: dict[type, Primitive] = {
    Mesh: Triangles(),
    Splats: UnsortedSplats(),
    Points: StrokeParts(),
    Lines: StrokeParts(),
}


def texture_firsts(scene: Sequence[Any]) -> tuple[dict[Texture, int], int]:
    """Where the texels of each texture of a scene begin, one after the other, and their number."""
    firsts: dict[Texture, int] = {}
    count = 0
    for one in scene:
        if isinstance(one, Mesh) and one.wears_something and texture_of(one) not in firsts:
            firsts[texture_of(one)] = count
            count += len(texture_of(one).levels)
    return firsts, count


def lacking(scene: Sequence[Any], antialias: bool = False) -> str:
    """Why a scene cannot be drawn by a device; "" where it can."""
    if antialias and any(isinstance(one, Mesh) for one in scene):
        return "coverage of pixels is the CPU's where triangles are drawn"
    without = next((type(one) for one in scene if type(one) not in PRIMITIVES), None)
    if without is None and any(map(share_through, scene)):
        return "a mesh with transmission has no passes"
    return "" if without is None else f"{without.__name__} has no passes"


def is_thick(scene: Sequence[Any]) -> bool:
    """Whether fragments of a scene have deviations: lists of them can be drawn, and no passes of
    techniques know these."""
    return any(isinstance(one, Splats) and one.thick for one in scene)


def recorded(
    scene: Sequence[Any],
    camera: Camera,
    width: int,
    height: int,
    threads: int | None,
    firsts: dict[Texture, int],
    antialias: bool = False,
) -> Iterator[tuple[Primitive, Array]]:
    """The records of a scene, a run of one kind after the other; firsts : as `texture_firsts`.
    Raises GpuError."""
    if reason := lacking(scene, antialias):
        raise GpuError(f"scene: {reason} on a device; use device='cpu'")
    textured = TexturedTriangles(firsts)
    for kind, run in itertools.groupby(scene, type):
        some: Sequence[Any] = list(run)
        if kind is Mesh:  # facets get normals where any has, as where the core draws all as one
            some = with_normals(some)
        for variant, part in itertools.groupby(some, _variant):
            some, primitive = list(part), PRIMITIVES[kind]
            if variant and kind is Mesh:
                primitive = textured
            elif variant and kind is Splats:
                primitive = primitive_of(some[0])
            elif antialias and issubclass(kind, Strokes):
                primitive = StrokeParts(antialias)
            yield primitive, primitive.records(some, camera, width, height, threads)


def _variant(one: Any) -> Any:
    """What those of a kind have in common that are drawn together; "" where all do."""
    if isinstance(one, Splats):
        return kind_of_splats(one)
    if isinstance(one, Strokes):
        return kind_of(one)
    return "textured" if isinstance(one, Mesh) and one.wears_something else ""


def may_be_solid(records: Array) -> Array:
    """Those that may be opaque somewhere; elsewhere no rounding makes an alpha of 1."""
    found: Array = records[records["alpha"].max(axis=1, initial=0) > 1 - 1e-6]
    return found
