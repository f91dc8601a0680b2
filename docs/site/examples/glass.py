"""Meshes, and coloured glass

A mesh with `transmission` is glass: it lets each colour through by another share. Pictures of
meshes are drawn by a rasteriser that covers the very pixels a GPU would.
"""

import moit

pot = max(moit.scenes.meshes("teapots").meshes, key=lambda mesh: len(mesh.triangles))
width = pot.points.max(0) - pot.points.min(0)
pots = []
for k, tint in enumerate([(0.9, 0.2, 0.2), (0.2, 0.8, 0.3), (0.2, 0.4, 0.9)]):
    points = pot.points + width * (0.55 * k, 0, -0.6 * k)
    pots.append(moit.Mesh(points, pot.triangles, tint, 0.9, pot.normals, transmission=0.9))
camera = moit.Camera(eye=(0.3, 0.5, 1)).fit(pots)
image = moit.render(pots, "sorted", (320, 200), camera=camera, background=(0.9, 0.9, 0.9))
moit.show(image).save("picture.png")
