"""A technique of one's own

A function of fragments is a technique; it goes wherever a technique goes, and
`moit.check_technique` says which promises it keeps.
"""

import moit


def inverse_depth(fragments):
    """Transmittance in front of each fragment."""
    return 1 / (1 + fragments.depth)


mine = moit.PythonTechnique("inverse-depth", inverse_depth, bits_per_pixel=32)
f = moit.scenes.load("cloud", (240, 135))
pictures = {
    str(t): moit.composite(f, t, background=(0.2, 0.3, 0.5)) for t in (mine, "wboit", "sorted")
}
moit.show(pictures).save("picture.png")
print(moit.check_technique(mine, rays=4, progress=False))
