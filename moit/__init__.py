"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from moit.environment import info
from moit.exceptions import FragmentsError, GpuError, MoitError

__version__ = "0.1.0"
__all__ = ["FragmentsError", "GpuError", "MoitError", "info"]
