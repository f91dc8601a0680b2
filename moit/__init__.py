"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from typing import TYPE_CHECKING, Any

from moit import metrics, moments, scenes
from moit.catalog import (
    AlphaBlend,
    PowerMoments,
    Sorted,
    Technique,
    WeightedAverage,
    WeightedBlended,
    WeightedSum,
    technique,
    techniques,
)
from moit.deep import read_deep, write_deep
from moit.environment import info
from moit.exceptions import FragmentsError, GpuError, MoitError
from moit.files import load, save
from moit.fragments import Fragments, merge
from moit.images import read_image, write_image
from moit.metrics import errors
from moit.questions import bounds, composite, total_transmittance, transmittance

if TYPE_CHECKING:
    from moit import plot
    from moit.comparison import compare
    from moit.report import Report

__version__ = "0.1.0"
__all__ = [
    "AlphaBlend",
    "Fragments",
    "FragmentsError",
    "GpuError",
    "MoitError",
    "PowerMoments",
    "Report",
    "Sorted",
    "Technique",
    "WeightedAverage",
    "WeightedBlended",
    "WeightedSum",
    "bounds",
    "compare",
    "composite",
    "errors",
    "info",
    "load",
    "merge",
    "metrics",
    "moments",
    "plot",
    "read_deep",
    "read_image",
    "save",
    "scenes",
    "technique",
    "techniques",
    "total_transmittance",
    "transmittance",
    "write_deep",
    "write_image",
]

# Loaded when first used: importing moit stays quick for those who only ask questions.
_LATER = {"Report": "moit.report", "compare": "moit.comparison", "plot": "moit.plot"}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module 'moit' has no attribute {name!r}")
    from importlib import import_module

    module = import_module(_LATER[name])
    return module if name == "plot" else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
