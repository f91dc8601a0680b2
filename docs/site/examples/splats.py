"""Gaussian splats, sorted and not

Splats in their order, and by techniques that need none. What pops while a camera turns is gone
without sorting, and what is lost is FLIP.
"""

import moit

scene = moit.scenes.splats("pot-splats", 8000)
drawn = moit.rasterize(scene.splats, scene.camera, (240, 180))
pictures = {
    name: moit.composite(drawn, name, background=scene.background)
    for name in ("sorted", "wboit", "power6", "hybrid4(core_alpha=0.05,normalize=True)")
}
moit.show(pictures).save("picture.png")
