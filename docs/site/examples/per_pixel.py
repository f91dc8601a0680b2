"""Each pixel gets what it needs

`moit.choose` takes for each pixel the cheapest technique that is good enough, and says what that
comes to.
"""

import matplotlib.pyplot as plt

import moit

f = moit.scenes.load("mixed", (200, 112))
found = moit.choose(f, moit.PerPixel(8 / 255), progress=False)
print(found)
figure, ax = plt.subplots(figsize=(7, 4))
ax.imshow(found.map, cmap="tab20", interpolation="nearest")
ax.set_axis_off()
figure.savefig("picture.png", dpi=110)
