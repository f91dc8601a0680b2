"""What may stand where a function takes fragments: the fragments, a file, or a scene's name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from moit.checks.arguments import nearest
from moit.fragments.fragments import Fragments

MESH_SIZE = (640, 360)
MESHES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")
SPLATS = (".splat", ".spz")


def as_fragments(
    f: Fragments | str | os.PathLike[str],
    name: str = "f",
    part: int | str | None = None,
    layer: str | None = None,
    channels: Mapping[str, str] | None = None,
) -> Fragments:
    """The Fragments that `f` means.

    f : Fragments are returned as they are. A path that exists as a file is read by its ending:
        .npz (moit.save's), .exr (deep OpenEXR), or a mesh or splats (as moit.read_meshes and
        moit.read_splats take them, seen from the upper right in front, MESH_SIZE pixels). Any
        other string is a scene's name and gives `moit.scenes.load(f)`. A file comes before a scene
        of the same name.
    name : the argument's name in messages.
    part, layer, channels : as `read_deep` takes them; of a deep .exr only, ValueError elsewhere.

    Raises TypeError for anything else; FileNotFoundError where a path (an os.PathLike, or a
    string with a folder or a known ending) leads nowhere; ValueError for an unknown ending or
    an unknown scene, with the nearest match; and whatever reading the file raises.
    """
    choice = {"part": part, "layer": layer, "channels": channels}
    given = next((key for key, value in choice.items() if value is not None), None)
    if given and not _is_deep(f):
        what = "Fragments" if isinstance(f, Fragments) else f"{f!r:.80}"
        raise ValueError(f"{given}: only a deep .exr has such; {name} is {what}")
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
        return _read(path, name, choice)
    ending = os.path.splitext(path)[1].lower()
    is_path = not isinstance(f, str) or os.path.basename(path) != path
    if is_path or ending in (".npz", ".exr", *MESHES, *SPLATS):
        if os.path.isdir(path):
            raise IsADirectoryError(f"{name}: expected a file, {path!r} is a folder")
        raise FileNotFoundError(f"{name}: there is no file {path!r}")

    from moit import scenes

    names = list(scenes.names())
    if path in names:
        return scenes.load(path)
    raise ValueError(f"{name}: {path!r:.200} is neither a file nor a scene{nearest(path, names)}")


def choices(
    sources: Iterable[object], part: int | str | None, layer: str | None
) -> list[dict[str, Any]]:
    """The part and layer of each of several inputs: those that are a deep .exr have them. Raises
    ValueError where none is."""
    deep = [_is_deep(one) for one in sources]
    if (part is not None or layer is not None) and not any(deep):
        given = "part" if part is not None else "layer"
        raise ValueError(f"{given}: only a deep .exr has such; found none among the inputs")
    return [{"part": part, "layer": layer} if one else {} for one in deep]


def _is_deep(f: object) -> bool:
    """Whether it is a path that ends as a deep image's does."""
    if not isinstance(f, (str, os.PathLike)):
        return False
    return os.path.splitext(os.fsdecode(f))[1].lower() == ".exr"


def _read(path: str, name: str, choice: dict[str, Any]) -> Fragments:
    ending = os.path.splitext(path)[1].lower()
    if ending == ".npz":
        from moit.formats.files import load

        return load(path)
    if ending == ".exr":
        from moit.formats.deep import read_deep

        return read_deep(path, **choice)
    if ending in (*MESHES, *SPLATS):
        from moit.geometry.camera import Camera
        from moit.geometry.drawing import Drawable
        from moit.geometry.rasterizer import rasterized
        from moit.geometry.reading.mesh_files import read_meshes
        from moit.geometry.reading.splat_files import holds_splats, read_splats
        from moit.system.environment import thread_count

        scene: list[Drawable] = [read_splats(path)] if holds_splats(path) else [*read_meshes(path)]
        camera = Camera(eye=(0.6, 0.5, 1.0)).fit(scene)
        return rasterized(scene, camera, MESH_SIZE, thread_count(None))
    raise ValueError(
        f"{name}: cannot tell what {path!r} holds; expected a file that ends in .npz or .exr"
    )
