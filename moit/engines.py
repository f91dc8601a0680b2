"""Which engine answers: what `device` means, and what a technique needs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from moit.catalog import Technique
from moit.checks.arguments import one_of
from moit.core.engine import Engine
from moit.core.questions import CORE

if TYPE_CHECKING:
    from moit.gpu import Device


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


def engine_of(technique: Technique, gpu: Device | None, exact: bool = False) -> Engine:
    """Who answers questions about a technique, on the CPU where gpu is None.

    exact : a GPU computes what the core computes, not what texts for engines do.
    """
    return _ENGINES[technique.engine](_engine_on(gpu, exact))


def _engine_on(gpu: Device | None, exact: bool) -> Engine:
    if gpu is None:
        return CORE
    from moit.gpu.questions import GpuEngine

    return GpuEngine(gpu, exact)


def _per_pixel(below: Engine) -> Engine:
    from moit.per_pixel.questions import PerPixelEngine

    return PerPixelEngine(below)


def _python(below: Engine) -> Engine:
    from moit.python_techniques.questions import PythonEngine

    return PythonEngine(below)


# By `Technique.engine`; each is given who answers for techniques of a whole image.
_ENGINES: dict[str, Callable[[Engine], Engine]] = {
    "core": lambda below: below,
    "per-pixel": _per_pixel,
    "python": _python,
}
