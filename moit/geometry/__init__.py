"""Triangles: meshes, cameras, the rasteriser, and the scenes made of them."""
