"""Shadows through what is transparent

A shadow map of moments holds how much light is left at every depth from the light, so smoke and
glass cast shadows of their own density.
"""

import moit

scene = moit.scenes.meshes("cloud-with-disk")
sun = moit.Light((0.3, -1, 0.2), shadows="power6")
image = moit.render(scene.meshes, "power6", (240, 160), camera=scene.camera, lights=[sun])
moit.show(image).save("picture.png")
