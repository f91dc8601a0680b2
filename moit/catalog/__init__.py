"""The techniques: what each stores per pixel, by which options, and where it was published.

A technique is a small frozen dataclass. `str` gives its name with the options that differ from the
default; `technique` reads that back.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from moit.catalog.names import listed as listed
from moit.catalog.names import technique as technique
from moit.catalog.names import techniques as techniques
from moit.catalog.registered import MODULES as _MODULES
from moit.catalog.technique import Technique as Technique

if TYPE_CHECKING:
    from moit.catalog.python_technique import PythonTechnique as PythonTechnique
    from moit.catalog.reconstruction import MomentTechnique as MomentTechnique
    from moit.catalog.registered import *  # noqa: F403  (all of them)
    from moit.catalog.weighted import WEIGHTS as WEIGHTS

# Of each name its module; loaded when it is first asked for.
MODULES = {
    "MomentTechnique": "reconstruction",
    "PythonTechnique": "python_technique",
    "WEIGHTS": "weighted",
    **_MODULES,
}


def __getattr__(name: str) -> Any:
    if name not in MODULES:
        raise AttributeError(f"module 'moit.catalog' has no attribute {name!r}")
    found = getattr(importlib.import_module(f"moit.catalog.{MODULES[name]}"), name)
    globals()[name] = found
    return found
