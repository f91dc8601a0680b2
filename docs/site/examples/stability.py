"""Where digits go

Hard rays with a dial each: surfaces that come ever nearer to one another, more and more layers,
and ever thinner ones. Solid is float32, dashed float64: where they coincide, rounding loses
nothing.
"""

import moit

report = moit.stability(
    ["power4", "power8", "trig3"],
    families=["distance", "layers", "thin"],
    precisions=["float32", "float64"],
    rays=32,
    progress=False,
)
axes = moit.plot.stability(report)
axes.flat[0].figure.savefig("picture.png", dpi=90, bbox_inches="tight")
