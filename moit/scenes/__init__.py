"""The scenes: fragments by name, and triangles."""

from moit.scenes.loading import load, meshes, names

__all__ = ["load", "meshes", "names"]
