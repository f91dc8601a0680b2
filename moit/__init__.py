"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from moit.deep import read_deep, write_deep
from moit.environment import info
from moit.exceptions import FragmentsError, GpuError, MoitError
from moit.files import load, save
from moit.fragments import Fragments, merge

__version__ = "0.1.0"
__all__ = [
    "Fragments",
    "FragmentsError",
    "GpuError",
    "MoitError",
    "info",
    "load",
    "merge",
    "read_deep",
    "save",
    "write_deep",
]
