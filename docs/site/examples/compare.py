"""A table of errors, and the pictures behind it

`moit.compare` asks every technique of every scene and keeps errors, times and pictures. Its
report is text, CSV, HTML and LaTeX, and figures for a paper.
"""

import moit

report = moit.compare(
    {"hair": moit.scenes.load("hair", (192, 108)), "cloud": moit.scenes.load("cloud", (192, 108))},
    ["wboit", "power4", "trig3", "mlab4"],
    repeat=1,
    progress=False,
)
figure = moit.plot.images(report, crops=(30, 60, 30, 40))
figure.savefig("picture.png", dpi=110)
for row in report.rows:
    print(f"{row['scene']:6} {row['technique']:8} FLIP {row['flip']:.4f}")
