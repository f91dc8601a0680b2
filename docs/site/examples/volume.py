"""A volume among surfaces

A regular grid of colours and absorbances is marched to thick fragments, which overlap surfaces as
they are.
"""

import numpy as np

import moit

x, y, z = np.meshgrid(*[np.linspace(-1, 1, 40)] * 3, indexing="ij")
waves = 1 + 0.6 * np.sin(9 * x) * np.cos(8 * y + 4 * z)
absorbance = 4 * np.exp(-4 * (x**2 + (1.6 * y) ** 2 + z**2)) * waves
grid = np.stack([0.9 + 0 * x, 0.9 - 0.2 * y, 0.8 + 0.2 * x, absorbance], -1)
smoke = moit.Volume(grid, spacing=0.05, origin=(-1, -1, -1))
corners = [[-1, -0.7, 0], [1, -0.7, 0], [1, 0.7, 0], [-1, 0.7, 0]]
pane = moit.Mesh(corners, [[0, 1, 2], [0, 2, 3]], (0.9, 0.3, 0.1), 0.6)
camera = moit.Camera(eye=(1.2, 0.8, 3))
pictures = {
    name: moit.render([smoke, pane], name, (240, 160), camera=camera, background=(0.05, 0.1, 0.2))
    for name in ("sorted", "power4")
}
moit.show(pictures).save("picture.png")
