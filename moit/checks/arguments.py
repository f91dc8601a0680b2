"""What arguments of many functions must be: their checks, and what these say."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from moit.gpu import Device


def truth(name: str, value: Any) -> bool:
    """`value`, which must be True or False, Python's or NumPy's."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name}: expected True or False, got {value!r:.80}")
    return bool(value)


def one_of(name: str, value: Any, allowed: tuple[Any, ...]) -> None:
    """Raises ValueError unless `value` is one of `allowed`, in type too."""
    try:
        found = any(value == one and type(value) is type(one) for one in allowed)
    except Exception:  # a foreign object may raise anything
        found = False
    if not found:
        shown = ", ".join(map(repr, allowed))
        raise ValueError(f"{name}: expected {shown}, got {value!r:.80}")


def path_name(path: str | bytes | os.PathLike[Any], name: str = "path") -> str:
    """A path as text, as `os.fsdecode` gives it."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise TypeError(
            f"{name}: expected str, bytes or os.PathLike, got {type(path).__name__}"
        ) from None


def gpu_of(device: Any) -> Device | None:
    """What `device` means: None for "cpu", the process's own GPU for "gpu", or a Device itself.

    Raises ValueError for anything else, GpuError where "gpu" is asked for and there is none.
    """
    gpu = sys.modules.get("moit.gpu")  # without it there is no Device yet
    if gpu is not None and isinstance(device, gpu.Device):
        found: Device = device
        return found
    one_of("device", device, ("cpu", "gpu"))
    if device == "cpu":
        return None
    from moit.gpu import default_device

    return default_device()
