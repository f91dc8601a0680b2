"""The transmittance along one ray

What each technique believes of one pixel: the light that is left at every depth. The exact curve
falls in steps; techniques of few numbers draw ramps.
"""

import moit

f = moit.scenes.load("mixed", (320, 180))
ax = moit.plot.curves(f, ["power4", "power8", "trig3", "slices64"], pixel=(120, 300))
ax.figure.savefig("picture.png", dpi=120)
