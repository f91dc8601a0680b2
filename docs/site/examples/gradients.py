"""Opacities found by gradients

A picture is given; opacities that make it are found by following the pullback of the picture.
"""

import matplotlib.pyplot as plt
import numpy as np

import moit

rng = np.random.default_rng(0)
count, pixels = 4, 64
offsets = np.arange(pixels + 1) * count
depth, color = rng.uniform(1, 10, pixels * count), rng.random((pixels * count, 3))
true = rng.uniform(0.1, 0.8, pixels * count)
wanted = moit.composite(moit.Fragments(offsets, depth, true, color, shape=(8, 8)), "sorted")

alpha, losses = np.full(pixels * count, 0.5), []
for _ in range(200):
    f = moit.Fragments(offsets, depth, alpha, color, shape=(8, 8))
    image, pullback = moit.gradients.composite(f, "power6")
    losses.append(float(((image - wanted) ** 2).sum()))
    alpha = np.clip(alpha - 0.3 * pullback(2 * (image - wanted)).alpha, 0.01, 0.99)
figure, ax = plt.subplots(figsize=(6, 3.2))
ax.semilogy(losses)
ax.set(xlabel="step", ylabel="squared error of the picture")
figure.savefig("picture.png", dpi=110, bbox_inches="tight")
