"""One scene by six techniques

A scene, the exact picture, and what five techniques make of it. `moit.show` puts pictures side by
side; in a notebook they are shown where they stand.
"""

import moit

f = moit.scenes.load("mixed", (320, 180))
techniques = ["sorted", "wboit", "power4", "power6", "mlab4", "fourier15"]
pictures = {name: moit.composite(f, name, background=(0.1, 0.1, 0.15)) for name in techniques}
moit.show(pictures, tone="aces").save("picture.png")

for name in techniques[1:]:
    print(f"{name:10} FLIP {moit.metrics.flip(pictures[name], pictures['sorted']):.4f}")
