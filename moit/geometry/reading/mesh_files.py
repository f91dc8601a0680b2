"""Mesh files by their endings."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable

from moit.checks.arguments import path_name
from moit.checks.exceptions import MeshError
from moit.geometry.meshes import Mesh
from moit.geometry.reading.gltf import read_gltf
from moit.geometry.reading.obj import read_obj
from moit.geometry.reading.others import read_by_trimesh, read_off, read_stl
from moit.geometry.reading.parts import Part, joined_parts, meshes_of_parts
from moit.geometry.reading.ply import read_ply

Reader = Callable[[str], tuple[list[Part], list[str]]]
READERS: dict[str, Reader] = {
    ".gltf": read_gltf,
    ".glb": read_gltf,
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".off": read_off,
}


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """The mesh of a file: glTF 2.0 (.gltf, .glb), OBJ with its MTL, PLY, STL, OFF,
    and by trimesh what else that reads.

    Parts of a file become one mesh, in their order; a file of several textures has no such, and
    `read_meshes` gives a mesh of each part.

    Of glTF: the scene's meshes where its nodes have them, with their base colour: factor times
    texture times COLOR_0, where alphaMode says so with alpha; where that is black, with what they
    emit: factor times strength times texture. Of OBJ: Kd, d or Tr, map_Kd, map_d, and colours after
    positions; Kd and these are linear. Colours of other files are decoded from sRGB. What has none
    is grey and opaque. Polygons are cut into triangles, concave ones and those with holes too.
    Positions far from 0 keep their digits: `Mesh.origin`. Where a file has no normals, glTF has its
    facets', others have smooth ones.

    A UserWarning names what would look otherwise in other programs: emission beside a base colour,
    bumps, and the like.

    Raises FileNotFoundError where there is no such file, MeshError (a ValueError) where it cannot
    be read or holds no triangles, and ImportError, naming the extra, where a package is missing
    that the file needs.

    >>> with open("triangle.obj", "w") as file:
    ...     _ = file.write("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> moit.read_mesh("triangle.obj").triangles.shape
    (1, 3)
    """
    name = path_name(path)
    parts = _parts(name)
    try:
        return meshes_of_parts([joined_parts(parts)])[0]
    except MeshError as error:
        raise MeshError(f"{name!r}: {error}") from None


def read_meshes(path: str | os.PathLike[str]) -> list[Mesh]:
    """The meshes of a file, in draw order: a scene, as `moit.rasterize` and `moit.render` take it.

    Of glTF one for each primitive of each node, of OBJ one for each run of triangles of one
    texture, of other files one. All have one origin. Files, warnings and errors are those of
    `read_mesh`.

    >>> with open("triangle.obj", "w") as file:
    ...     _ = file.write("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> [mesh.triangles.shape for mesh in moit.read_meshes("triangle.obj")]
    [(1, 3)]
    """
    name = path_name(path)
    parts = _parts(name)
    try:
        return meshes_of_parts(parts)
    except MeshError as error:
        raise MeshError(f"{name!r}: {error}") from None


def _parts(name: str) -> list[Part]:
    if not os.path.exists(name):
        raise FileNotFoundError(f"path: there is no file {name!r}")
    reader = READERS.get(os.path.splitext(name)[1].lower(), read_by_trimesh)
    try:
        parts, lacking = reader(name)
    except MeshError as error:
        raise MeshError(f"{name!r}: {error}") from None
    if not any(len(part.triangles) for part in parts):
        also = f" (not read: {', '.join(lacking)})" if lacking else ""
        raise MeshError(f"{name!r}: expected triangles, found none{also}")
    if lacking:
        warnings.warn(f"{name!r}: not drawn: {', '.join(lacking)}", UserWarning, stacklevel=3)
    return parts
