"""Meshes of other libraries as arguments of ours, known by what they have; none is imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError, PrimitiveError
from moit.geometry.normals import smooth_normals
from moit.geometry.polygons import cut
from moit.geometry.textures import Texture
from moit.reports.pictures import from_srgb

# Of what has no colour. An odd number, kept: it is what a byte of 178 stands for.
GREY = float(from_srgb(np.array(178 / 255)))

Arguments = dict[str, Any]


def foreign_meshes(value: Any) -> list[Arguments] | None:
    """The arguments of each Mesh that a foreign object holds, in order; None where it is no mesh.

    trimesh.Trimesh and trimesh.Scene, pyvista.PolyData, and what has their attributes.
    """
    if isinstance(value, str | bytes | np.ndarray | Sequence):
        return None
    if hasattr(value, "geometry") and hasattr(value, "dump"):  # trimesh.Scene, placed by its graph
        return [found for part in value.dump() for found in foreign_meshes(part) or []]
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        return [_of_trimesh(value)]
    if hasattr(value, "points") and hasattr(value, "faces"):
        return [_of_polydata(value)]
    return None


def foreign_cells(
    value: Any, kind: str
) -> tuple[NDArray[Any], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64] | None] | None:
    """Points of a pyvista.PolyData, or of what has its attributes; which of them its cells have,
    one after the other, and how many each; and colours of points, None where it has none.

    kind : "verts" or "lines". None where it has no such cells.
    """
    if isinstance(value, str | bytes | np.ndarray | Sequence):
        return None
    if not (hasattr(value, "points") and hasattr(value, kind)):
        return None
    points = np.asarray(value.points)
    which, sizes = unpadded(np.asarray(getattr(value, kind)).reshape(-1), kind)
    if which.size and not 0 <= which.min() <= which.max() < len(points):
        raise PrimitiveError(f"{kind}: found indices beyond the {len(points)} points")
    return points, which, sizes, _own_colors(value)


def foreign_grid(
    value: Any,
) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.float64]] | None:
    """Numbers (X, Y, Z), spacing and origin of a pyvista.ImageData, or of what has its attributes:
    its active scalars of points; None where it is none.
    """
    if isinstance(value, str | bytes | np.ndarray | Sequence):
        return None
    if not all(hasattr(value, name) for name in ("dimensions", "spacing", "origin")):
        return None
    size = tuple(int(n) for n in value.dimensions)
    scalars = getattr(getattr(value, "point_data", None), "active_scalars", None)
    if scalars is None:
        raise PrimitiveError("grid: found no active scalars of points; needed some")
    numbers = np.asarray(scalars)
    if numbers.shape != (int(np.prod(size)),):
        raise PrimitiveError(
            f"grid: found active scalars of shape {numbers.shape}; needed one for each of "
            f"{int(np.prod(size))} points"
        )
    along_x_first = numbers.reshape(size[::-1]).transpose(2, 1, 0)
    return along_x_first, np.asarray(value.spacing, float), np.asarray(value.origin, float)


def _of_trimesh(mesh: Any) -> Arguments:
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    visual: Any = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    cached = getattr(getattr(mesh, "_cache", None), "cache", {})  # what a file held, for one
    normals = cached.get("vertex_normals")
    if normals is None or len(normals) != len(vertices):
        normals = smooth_normals(vertices, faces)
    found: Arguments = {"vertices": vertices, "triangles": faces, "normals": normals}
    found["color"] = (GREY, GREY, GREY)
    if kind == "vertex":
        found["color"] = of_bytes(np.asarray(visual.vertex_colors))
    elif kind == "face":  # each of one colour, whatever its neighbours have
        shades = of_bytes(np.repeat(np.asarray(visual.face_colors), 3, axis=0))
        corners = faces.reshape(-1)
        found = {
            "vertices": vertices[corners],
            "triangles": np.arange(len(corners)).reshape(-1, 3),
            "normals": np.asarray(normals)[corners],
            "color": shades,
        }
    elif kind == "texture":
        found |= _of_material(visual.material, getattr(visual, "uv", None))
    return found


def _of_material(material: Any, uv: Any) -> Arguments:
    """Of trimesh's SimpleMaterial (colours as on a screen) and PBRMaterial (linear ones)."""
    found: Arguments = {}
    physical = hasattr(material, "baseColorTexture")
    image = material.baseColorTexture if physical else getattr(material, "image", None)
    factor = material.baseColorFactor if physical else getattr(material, "diffuse", None)
    if image is not None and uv is not None:
        mode = "RGBA" if "A" in image.getbands() or "transparency" in image.info else "RGB"
        found["texture"] = Texture(np.asarray(image.convert(mode)), color_space="srgb")
        found["uv"] = np.asarray(uv, np.float64) * (1, -1) + (0, 1)  # v runs up there
        found["color"] = (1.0, 1.0, 1.0)
    if factor is not None and (physical or image is None):
        shade = np.asarray(factor)
        whole = shade.dtype.kind in "iu"
        found["color"] = of_bytes(shade) if not physical else shade / 255.0 if whole else shade
    elif physical and image is None:
        found["color"] = (1.0, 1.0, 1.0)
    if physical:
        mode = getattr(material, "alphaMode", None) or "OPAQUE"
        found |= cut_or_blended(found, mode, getattr(material, "alphaCutoff", None))
    return found


def cut_or_blended(found: Arguments, mode: str, cutoff: float | None) -> Arguments:
    """glTF's alphaMode, as arguments that replace some of these."""
    if mode == "MASK":
        return {"alpha_cutoff": 0.5 if cutoff is None else float(cutoff)}
    if mode == "BLEND":
        return {}
    opaque: Arguments = {}
    color = np.asarray(found.get("color", (1.0, 1.0, 1.0)))
    if color.shape[-1] == 4:
        opaque["color"] = color[..., :3]
    texture = found.get("texture")
    if texture is not None and texture.transparent:
        opaque["texture"] = without_alpha(texture)
    return opaque


def without_alpha(texture: Texture) -> Texture:
    """The same colours, opaque everywhere."""
    return Texture(
        np.asarray(texture.image)[..., :3],
        color_space=texture.color_space,
        wrap=texture.wrap,
        filter=texture.filter,
    )


def _of_polydata(mesh: Any) -> Arguments:
    points = np.asarray(mesh.points)
    padded = np.asarray(mesh.faces).reshape(-1)
    for kind, name in (("lines", "Lines"), ("verts", "Points")):
        if not padded.size and np.size(getattr(mesh, kind, ())):
            raise MeshError(
                f"faces: found none, but {kind}; needed moit.{name}(mesh, pixels=..), made of these"
            )
    corners, sizes = unpadded(padded)
    if corners.size and not 0 <= corners.min() <= corners.max() < len(points):
        raise MeshError(f"faces: found indices beyond the {len(points)} points")
    triangles = corners[cut(points[corners].astype(np.float64), sizes)]
    found: Arguments = {"vertices": points, "triangles": triangles, "color": (GREY, GREY, GREY)}
    data = getattr(mesh, "point_data", None)
    normals = _named(data, "Normals")
    found["normals"] = smooth_normals(points, triangles) if normals is None else normals
    own = _own_colors(mesh)
    if own is not None:
        found["color"] = own
    return found


def _own_colors(mesh: Any) -> NDArray[np.float64] | None:
    """Of points, where they are active bytes: as pyvista shows such."""
    scalars = getattr(getattr(mesh, "point_data", None), "active_scalars", None)
    scalars = None if scalars is None else np.asarray(scalars)
    if scalars is not None and scalars.dtype == np.uint8 and scalars.shape[1:] in ((3,), (4,)):
        return of_bytes(scalars)
    return None


def of_bytes(shades: NDArray[Any], most: float = 255.0) -> NDArray[np.float64]:
    """Linear colours (..., 3) or (..., 4) of those on a screen, full at `most`; alpha is linear
    already."""
    found = np.asarray(shades, np.float64) / most
    found[..., :3] = from_srgb(found[..., :3])
    return found


def _named(data: Any, name: str) -> NDArray[Any] | None:
    try:
        return np.asarray(data[name])
    except (KeyError, TypeError):
        return None


def unpadded(
    padded: NDArray[Any], name: str = "faces"
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """VTK's faces (size, corners, size, corners ...) as all corners and (P,) sizes; so with other
    cells, whose name it is."""
    if padded.size and padded.dtype.kind not in "iu":
        raise TypeError(f"{name}: expected integers, got {padded.dtype}")
    flat = padded.astype(np.int64)
    size = int(flat[0]) if flat.size else 3
    if size > 0 and flat.size % (size + 1) == 0 and (flat[:: size + 1] == size).all():
        rows = flat.reshape(-1, size + 1)
        return rows[:, 1:].reshape(-1), np.full(len(rows), size)
    sizes, kept, at = [], np.ones(len(flat), np.bool_), 0
    while at < len(flat):
        if not 0 <= flat[at] < len(flat) - at:
            what = "a face" if name == "faces" else "a cell"
            raise MeshError(f"{name}[{at}]: found {what} of {flat[at]} corners; needed as many")
        sizes.append(int(flat[at]))
        kept[at] = False
        at += sizes[-1] + 1
    return flat[kept], np.array(sizes, np.int64)
