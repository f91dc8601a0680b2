"""Error against bits a pixel

What is worth its memory: a dashed line joins what nothing beats.
"""

import moit

report = moit.compare(
    moit.scenes.load("mixed", (160, 90)),
    [
        "wboit",
        "power4",
        "power6",
        "power8",
        "trig3",
        "neural-bounded",
        "anchors4",
        "mlab4",
        "fourier7",
    ],
    repeat=1,
    progress=False,
)
ax = moit.plot.speed_error(report, "flip", by="bits")
ax.figure.savefig("picture.png", dpi=110)
