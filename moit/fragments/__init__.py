"""The one input: fragments of an image, and how they are shown."""

from moit.fragments.fragments import Fragments
from moit.fragments.frame import Frame
from moit.fragments.merging import merge

__all__ = ["Fragments", "Frame", "merge"]
