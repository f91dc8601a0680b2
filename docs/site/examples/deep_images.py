"""Deep OpenEXR in, merged and made smaller

Deep images merge without loss; `moit.deep.simplify` leaves samples out, with a proof of the
error.
"""

import os

import moit

moit.write_deep("trees.exr", moit.scenes.load("foliage", (240, 135)))
moit.write_deep("smoke.exr", moit.scenes.load("smoke", (240, 135)))
moit.deep.merge(["trees.exr", "smoke.exr"], "both.exr")
moit.deep.simplify("both.exr", "less.exr", error=0.01)
for name in ("both.exr", "less.exr"):
    print(f"{name}: {os.path.getsize(name):,} bytes, {len(moit.read_deep(name)):,} samples")
pictures = {name: moit.composite(name, "sorted") for name in ("both.exr", "less.exr")}
moit.show(pictures).save("picture.png")
