"""Fragments of one's own

Fragments are arrays: how many each pixel has, and of each its depth, opacity and colour, in any
order. Here they are glass panes that a formula makes.
"""

import numpy as np

import moit

height, width, panes = 120, 200, 6
rng = np.random.default_rng(1)
y, x = np.mgrid[0:height, 0:width]
pixel, depth, alpha, color = [], [], [], []
for k in range(panes):
    middle, slope = rng.uniform(0.2, 0.8, 2), rng.uniform(-0.01, 0.01, 2)
    inside = np.hypot(x / width - middle[0], (y / height - middle[1]) * 0.6) < 0.22
    pixel.append((y * width + x)[inside])
    depth.append((2 + k * 0.5 + slope[0] * x + slope[1] * y)[inside])
    alpha.append(np.full(inside.sum(), 0.5))
    color.append(np.tile(rng.uniform(0.1, 1, 3), (inside.sum(), 1)))
f = moit.Fragments.from_pixels(
    *map(np.concatenate, (pixel, depth, alpha, color)), shape=(height, width)
)
print(f)
moit.show(moit.composite(f, "power6", background=(1, 1, 1))).save("picture.png")
