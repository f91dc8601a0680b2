"""The techniques as OpenGL passes, and the devices they run on.

`import moit` does not load this; `moit.gpu` does, when first used. Without EGL nothing here is
needed and all else works.
"""

from moit.gpu.device import Device, default_device

__all__ = ["Device", "default_device"]
