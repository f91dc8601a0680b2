"""The one input: fragments of an image, and how they are shown."""

from moit.fragments.fragments import Fragments, merge

__all__ = ["Fragments", "merge"]
