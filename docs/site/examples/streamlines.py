"""Streamlines whose opacity tells an attribute

A thousand lines coloured by how fast the flow rises or sinks; `antialias` makes their edges
smooth.
"""

import moit

scene = moit.scenes.lines("convection-lines", 200)
image = moit.render(
    scene.lines,
    "mlab8(buckets=True)",
    (320, 180),
    camera=scene.camera,
    background=scene.background,
    antialias=True,
)
moit.show(image).save("picture.png")
