"""PLY, STL, OFF and whatever else trimesh reads."""

from __future__ import annotations

import numpy as np

from moit.checks.exceptions import MeshError
from moit.geometry.foreign import foreign_meshes
from moit.geometry.reading.parts import Part


def read_by_trimesh(path: str) -> tuple[list[Part], list[str]]:
    """The parts of a file, and that is all. Raises MeshError, which does not name the file yet."""
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "read_mesh needs trimesh: pip install 'moit[mesh]' installs it"
        ) from error
    try:
        given = foreign_meshes(trimesh.load_scene(path)) or []
    except MeshError:
        raise
    except Exception as error:  # trimesh and its readers raise anything
        raise MeshError(f"cannot be read as a mesh: {error}") from error
    return [_part(arguments) for arguments in given if len(arguments["triangles"])], []


def _part(arguments: dict[str, object]) -> Part:
    points = np.asarray(arguments.pop("vertices"), np.float64)
    color = np.asarray(arguments.pop("color"))
    return Part(points=points, color=color, **arguments)  # type: ignore[arg-type]
