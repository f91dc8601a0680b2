"""Deep images from file to file: merged, held out, recoloured, cropped, simplified, flattened.

Each function reads and writes OpenEXR, in bands of rows where a file is larger than memory, and
keeps windows, metadata, a file's other parts, layers and channels that it does not need, such as
ids. Where they take a deep file they take Fragments, too. On the command line the same names do the
same: `moit holdout a.exr b.exr -o out.exr`.
"""

from moit.deep.cropping import crop
from moit.deep.curves import curve
from moit.deep.flattening import flatten
from moit.deep.holding_out import holdout
from moit.deep.merging import merge
from moit.deep.moment_files import MomentImage, read_moments, to_moments
from moit.deep.points import to_points
from moit.deep.recoloring import recolor
from moit.deep.simplifying import Certificate, simplify
from moit.formats.inspection import inspect

__all__ = [
    "Certificate",
    "MomentImage",
    "crop",
    "curve",
    "flatten",
    "holdout",
    "inspect",
    "merge",
    "read_moments",
    "recolor",
    "simplify",
    "to_moments",
    "to_points",
]
