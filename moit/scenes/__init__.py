"""The scenes: fragments by name, and what they are made of."""

from moit.scenes.loading import descriptions, lines, load, meshes, names, splats

__all__ = ["descriptions", "lines", "load", "meshes", "names", "splats"]
