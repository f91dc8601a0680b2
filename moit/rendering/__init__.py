"""Pictures of triangles: rasterised and composited, or drawn by a GPU's passes."""
