"""The scenes: fragments by name, and triangles."""

from moit.scenes.loading import descriptions, load, meshes, names

__all__ = ["descriptions", "load", "meshes", "names"]
