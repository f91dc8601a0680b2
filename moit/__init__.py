"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from moit import metrics, moments, plot, scenes
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
from moit.comparison import compare
from moit.deep import read_deep, write_deep
from moit.environment import info
from moit.exceptions import FragmentsError, GpuError, MoitError
from moit.files import load, save
from moit.fragments import Fragments, merge
from moit.images import read_image, write_image
from moit.metrics import errors
from moit.questions import bounds, composite, total_transmittance, transmittance
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
