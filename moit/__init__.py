"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from typing import TYPE_CHECKING, Any

from moit import moments
from moit.catalog import (
    AdaptiveTransparency,
    AdaptiveVoxels,
    AlphaBlend,
    Anchors,
    BoundedNeural,
    DeepFragments,
    DeepShadowMap,
    DepthPeeling,
    FourierOpacity,
    FrontLayers,
    HashedAlpha,
    HybridTransparency,
    KBuffer,
    MomentTransparency,
    MultiLayerAlphaBlending,
    NeuralMoments,
    PerPixel,
    PowerMoments,
    PythonTechnique,
    Slices,
    Sorted,
    Stochastic,
    Strong,
    Technique,
    TransmittanceFunctionMap,
    TrigonometricMoments,
    TwoMoments,
    WaveletTransparency,
    WeightedAverage,
    WeightedBlended,
    WeightedSum,
    technique,
    techniques,
)
from moit.checks.exceptions import (
    FragmentsError,
    GpuError,
    MeshError,
    MoitError,
    PrimitiveError,
    SplatsError,
    TechniqueError,
)
from moit.fragments import Fragments, Frame, merge
from moit.questions import bounds, composite, total_transmittance, transmittance
from moit.system.version import VERSION

if TYPE_CHECKING:
    from moit import deep, gpu, gradients, metrics, plot, scenes, storage
    from moit.about import info
    from moit.catalog.network import Network
    from moit.catalog.papers import cite
    from moit.comparing.choice import Choice, choose
    from moit.comparing.comparison import compare
    from moit.comparing.recommendation import Recommendation, recommend
    from moit.comparing.report import Report
    from moit.deep_composites import composite_deep
    from moit.experiments.result import ExperimentResult
    from moit.experiments.running import experiment
    from moit.formats.deep import read_deep, write_deep
    from moit.formats.deep_bands import read_deep_bands
    from moit.formats.files import load, save
    from moit.formats.images import read_image, write_image
    from moit.formats.inspection import inspect
    from moit.geometry.camera import Camera
    from moit.geometry.grids import Volume
    from moit.geometry.light import Light
    from moit.geometry.meshes import Mesh
    from moit.geometry.reading.mesh_files import read_mesh, read_meshes
    from moit.geometry.reading.splat_files import read_splats, write_splats
    from moit.geometry.scalar_maps import map_scalars
    from moit.geometry.splats import Splats
    from moit.geometry.strokes import Lines, Points
    from moit.geometry.textures import Texture
    from moit.judging.result import Frontier
    from moit.judging.running import frontier
    from moit.kit.exporting import export
    from moit.metrics import errors
    from moit.neural.training import train
    from moit.numerics.bias import BiasAdvice, bias_advice
    from moit.numerics.checking import TechniqueCheck, check_technique
    from moit.numerics.report import StabilityReport
    from moit.numerics.stability import stability
    from moit.python_techniques.sort_free import SortFree, SortFreeSplats, read_sort_free
    from moit.rendering.making import Rendering
    from moit.rendering.popping import Popping, popping
    from moit.rendering.rasterizing import rasterize
    from moit.rendering.render import render
    from moit.reports.shown_images import ShownImage
    from moit.shadows.shadow_map import ShadowMap
    from moit.showing import show

__version__ = VERSION
__all__ = [
    "AdaptiveTransparency",
    "AdaptiveVoxels",
    "AlphaBlend",
    "Anchors",
    "BiasAdvice",
    "BoundedNeural",
    "Camera",
    "Choice",
    "DeepFragments",
    "DeepShadowMap",
    "DepthPeeling",
    "ExperimentResult",
    "FourierOpacity",
    "Fragments",
    "FragmentsError",
    "Frame",
    "FrontLayers",
    "Frontier",
    "GpuError",
    "HashedAlpha",
    "HybridTransparency",
    "KBuffer",
    "Light",
    "Lines",
    "Mesh",
    "MeshError",
    "MoitError",
    "MomentTransparency",
    "MultiLayerAlphaBlending",
    "Network",
    "NeuralMoments",
    "PerPixel",
    "Points",
    "Popping",
    "PowerMoments",
    "PrimitiveError",
    "PythonTechnique",
    "Recommendation",
    "Rendering",
    "Report",
    "ShadowMap",
    "ShownImage",
    "Slices",
    "SortFree",
    "SortFreeSplats",
    "Sorted",
    "Splats",
    "SplatsError",
    "StabilityReport",
    "Stochastic",
    "Strong",
    "Technique",
    "TechniqueCheck",
    "TechniqueError",
    "Texture",
    "TransmittanceFunctionMap",
    "TrigonometricMoments",
    "TwoMoments",
    "Volume",
    "WaveletTransparency",
    "WeightedAverage",
    "WeightedBlended",
    "WeightedSum",
    "bias_advice",
    "bounds",
    "check_technique",
    "choose",
    "cite",
    "compare",
    "composite",
    "composite_deep",
    "deep",
    "errors",
    "experiment",
    "export",
    "frontier",
    "gpu",
    "gradients",
    "info",
    "inspect",
    "load",
    "map_scalars",
    "merge",
    "metrics",
    "moments",
    "plot",
    "popping",
    "rasterize",
    "read_deep",
    "read_deep_bands",
    "read_image",
    "read_mesh",
    "read_meshes",
    "read_sort_free",
    "read_splats",
    "recommend",
    "render",
    "save",
    "scenes",
    "show",
    "stability",
    "storage",
    "technique",
    "techniques",
    "total_transmittance",
    "train",
    "transmittance",
    "write_deep",
    "write_image",
    "write_splats",
]

# Loaded when first used: importing moit stays quick for those who only ask questions. The last two
# need frameworks of their names.
_MODULES = ("deep", "gpu", "gradients", "metrics", "plot", "scenes", "storage", "jax", "torch")
_LATER = {
    "BiasAdvice": "numerics.bias",
    "Camera": "geometry.camera",
    "Choice": "comparing.choice",
    "ExperimentResult": "experiments.result",
    "Frontier": "judging.result",
    "Light": "geometry.light",
    "Lines": "geometry.strokes",
    "Mesh": "geometry.meshes",
    "Network": "catalog.network",
    "Points": "geometry.strokes",
    "Recommendation": "comparing.recommendation",
    "Rendering": "rendering.making",
    "Report": "comparing.report",
    "Texture": "geometry.textures",
    "Popping": "rendering.popping",
    "SortFree": "python_techniques.sort_free",
    "SortFreeSplats": "python_techniques.sort_free",
    "Splats": "geometry.splats",
    "StabilityReport": "numerics.report",
    "TechniqueCheck": "numerics.checking",
    "ShadowMap": "shadows.shadow_map",
    "Volume": "geometry.grids",
    "ShownImage": "reports.shown_images",
    "bias_advice": "numerics.bias",
    "check_technique": "numerics.checking",
    "choose": "comparing.choice",
    "cite": "catalog.papers",
    "compare": "comparing.comparison",
    "errors": "metrics",
    "experiment": "experiments.running",
    "export": "kit.exporting",
    "frontier": "judging.running",
    "composite_deep": "deep_composites",
    "info": "about",
    "inspect": "formats.inspection",
    "load": "formats.files",
    "popping": "rendering.popping",
    "map_scalars": "geometry.scalar_maps",
    "rasterize": "rendering.rasterizing",
    "recommend": "comparing.recommendation",
    "render": "rendering.render",
    "read_deep_bands": "formats.deep_bands",
    "read_deep": "formats.deep",
    "read_mesh": "geometry.reading.mesh_files",
    "read_meshes": "geometry.reading.mesh_files",
    "read_sort_free": "python_techniques.sort_free",
    "read_splats": "geometry.reading.splat_files",
    "read_image": "formats.images",
    "save": "formats.files",
    "show": "showing",
    "stability": "numerics.stability",
    "train": "neural.training",
    "write_deep": "formats.deep",
    "write_image": "formats.images",
    "write_splats": "geometry.reading.splat_files",
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
    return sorted({*__all__, "__version__"})
