"""What may stand where a function takes fragments: the fragments, a file, or a scene's name."""

from __future__ import annotations

import os

from moit.checks.arguments import nearest
from moit.fragments.fragments import Fragments

MESH_SIZE = (640, 360)
MESHES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")


def as_fragments(f: Fragments | str | os.PathLike[str], name: str = "f") -> Fragments:
    """The Fragments that `f` means.

    f : Fragments are returned as they are. A path that exists as a file is read by its ending:
        .npz (moit.save's), .exr (deep OpenEXR), or a mesh (as moit.read_meshes takes it, seen from
        the upper right in front, MESH_SIZE pixels). Any other string is a scene's name and gives
        `moit.scenes.load(f)`. A file comes before a scene of the same name.
    name : the argument's name in messages.

    Raises TypeError for anything else; FileNotFoundError where a path (an os.PathLike, or a
    string with a folder or a known ending) leads nowhere; ValueError for an unknown ending or
    an unknown scene, with the nearest match; and whatever reading the file raises.
    """
    if isinstance(f, Fragments):
        return f
    if not isinstance(f, (str, os.PathLike)):
        raise TypeError(
            f"{name}: expected Fragments, a path or the name of a scene, got {type(f).__name__}"
        )
    path = os.fspath(f)
    if not isinstance(path, str):
        raise TypeError(f"{name}: expected a path as str, got {type(path).__name__}")
    if os.path.isfile(path):
        return _read(path, name)
    ending = os.path.splitext(path)[1].lower()
    is_path = not isinstance(f, str) or os.path.basename(path) != path
    if is_path or ending in (".npz", ".exr", *MESHES):
        if os.path.isdir(path):
            raise IsADirectoryError(f"{name}: expected a file, {path!r} is a folder")
        raise FileNotFoundError(f"{name}: there is no file {path!r}")

    from moit import scenes

    names = list(scenes.names())
    if path in names:
        return scenes.load(path)
    raise ValueError(f"{name}: {path!r} is neither a file nor a scene{nearest(path, names)}")


def _read(path: str, name: str) -> Fragments:
    ending = os.path.splitext(path)[1].lower()
    if ending == ".npz":
        from moit.formats.files import load

        return load(path)
    if ending == ".exr":
        from moit.formats.deep import read_deep

        return read_deep(path)
    if ending in MESHES:
        from moit.geometry.camera import Camera
        from moit.geometry.rasterizer import rasterized
        from moit.geometry.reading.mesh_files import read_meshes
        from moit.system.environment import thread_count

        meshes = read_meshes(path)
        camera = Camera(eye=(0.6, 0.5, 1.0)).fit(meshes)
        return rasterized(meshes, camera, MESH_SIZE, thread_count(None))
    raise ValueError(
        f"{name}: cannot tell what {path!r} holds; expected a file that ends in .npz or .exr"
    )
