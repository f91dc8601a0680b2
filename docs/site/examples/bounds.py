"""What is certain

Four moments do not tell the transmittance, but prove an upper and a lower bound of it, for every
scene that has these moments.
"""

import matplotlib.pyplot as plt
import numpy as np

import moit

rng = np.random.default_rng(4)
f = moit.Fragments([0, 12], np.sort(rng.uniform(1, 10, 12)), rng.uniform(0.05, 0.4, 12))
depth = np.linspace(1, 10, 400)
figure, ax = plt.subplots(figsize=(7, 3.5))
for name, color in (("power4", "tab:blue"), ("power8", "tab:orange")):
    lower, upper = moit.bounds(f, name, depth=depth)
    ax.fill_between(
        depth, lower[0, 0], upper[0, 0], color=color, alpha=0.35, label=f"{name} proves"
    )
ax.plot(depth, moit.transmittance(f, "sorted", depth=depth)[0, 0], "k", lw=1, label="exact")
ax.set(xlabel="depth", ylabel="transmittance", ylim=(0, 1))
ax.legend()
figure.savefig("picture.png", dpi=120, bbox_inches="tight")
