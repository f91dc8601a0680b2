"""Meshes of files: glTF, OBJ, and what trimesh reads."""
