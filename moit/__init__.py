"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from moit import metrics, moments
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
from moit.metrics import errors
from moit.questions import bounds, composite, total_transmittance, transmittance

__version__ = "0.1.0"
__all__ = [
    "AlphaBlend",
    "PowerMoments",
    "Sorted",
    "Technique",
    "WeightedAverage",
    "WeightedBlended",
    "WeightedSum",
    "bounds",
    "composite",
    "errors",
    "metrics",
    "moments",
    "technique",
    "techniques",
    "total_transmittance",
    "transmittance",
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
