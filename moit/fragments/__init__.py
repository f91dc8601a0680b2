"""The one input: fragments of an image, and how they are shown."""

from moit.fragments.fragments import Fragments, merge
from moit.fragments.frame import Frame

__all__ = ["Fragments", "Frame", "merge"]
