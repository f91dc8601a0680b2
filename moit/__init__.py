"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from typing import TYPE_CHECKING, Any

from moit import moments
from moit.catalog import (
    AdaptiveTransparency,
    AlphaBlend,
    DeepShadowMap,
    DepthPeeling,
    FourierOpacity,
    HashedAlpha,
    HybridTransparency,
    KBuffer,
    MomentTransparency,
    MultiLayerAlphaBlending,
    PerPixel,
    PowerMoments,
    Sorted,
    Stochastic,
    Technique,
    TransmittanceFunctionMap,
    TrigonometricMoments,
    WaveletTransparency,
    WeightedAverage,
    WeightedBlended,
    WeightedSum,
    technique,
    techniques,
)
from moit.exceptions import FragmentsError, GpuError, MoitError
from moit.fragments import Fragments, merge
from moit.questions import bounds, composite, total_transmittance, transmittance

if TYPE_CHECKING:
    from moit import gpu, metrics, plot, scenes
    from moit.bias import BiasAdvice, bias_advice
    from moit.camera import Camera
    from moit.choice import Choice, choose
    from moit.comparison import compare
    from moit.deep import read_deep, write_deep
    from moit.environment import info
    from moit.files import load, save
    from moit.images import read_image, write_image
    from moit.meshes import Mesh, MeshError, read_mesh
    from moit.metrics import errors
    from moit.rasterizer import rasterize
    from moit.recommendation import Recommendation, recommend
    from moit.rendering import Rendering, render
    from moit.report import Report
    from moit.stability_lab import stability
    from moit.stability_report import StabilityReport

__version__ = "0.1.0"
__all__ = [
    "AdaptiveTransparency",
    "AlphaBlend",
    "BiasAdvice",
    "Camera",
    "Choice",
    "DeepShadowMap",
    "DepthPeeling",
    "FourierOpacity",
    "Fragments",
    "FragmentsError",
    "GpuError",
    "HashedAlpha",
    "HybridTransparency",
    "KBuffer",
    "Mesh",
    "MeshError",
    "MoitError",
    "MomentTransparency",
    "MultiLayerAlphaBlending",
    "PerPixel",
    "PowerMoments",
    "Recommendation",
    "Rendering",
    "Report",
    "Sorted",
    "StabilityReport",
    "Stochastic",
    "Technique",
    "TransmittanceFunctionMap",
    "TrigonometricMoments",
    "WaveletTransparency",
    "WeightedAverage",
    "WeightedBlended",
    "WeightedSum",
    "bias_advice",
    "bounds",
    "choose",
    "compare",
    "composite",
    "errors",
    "gpu",
    "info",
    "load",
    "merge",
    "metrics",
    "moments",
    "plot",
    "rasterize",
    "read_deep",
    "read_image",
    "read_mesh",
    "recommend",
    "render",
    "save",
    "scenes",
    "stability",
    "technique",
    "techniques",
    "total_transmittance",
    "transmittance",
    "write_deep",
    "write_image",
]

# Loaded when first used: importing moit stays quick for those who only ask questions.
_MODULES = ("gpu", "metrics", "plot", "scenes")
_LATER = {
    "BiasAdvice": "bias",
    "Camera": "camera",
    "Choice": "choice",
    "Mesh": "meshes",
    "MeshError": "meshes",
    "Recommendation": "recommendation",
    "Rendering": "rendering",
    "Report": "report",
    "StabilityReport": "stability_report",
    "bias_advice": "bias",
    "choose": "choice",
    "compare": "comparison",
    "errors": "metrics",
    "info": "environment",
    "load": "files",
    "rasterize": "rasterizer",
    "recommend": "recommendation",
    "render": "rendering",
    "read_deep": "deep",
    "read_mesh": "meshes",
    "read_image": "images",
    "save": "files",
    "stability": "stability_lab",
    "write_deep": "deep",
    "write_image": "images",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _MODULES:
        return import_module(f"moit.{name}")
    if name not in _LATER:
        raise AttributeError(f"module 'moit' has no attribute {name!r}")
    found = getattr(import_module(f"moit.{_LATER[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
