"""Order-independent transparency: techniques, transmittance curves, images and errors."""

from typing import TYPE_CHECKING, Any

from moit.catalog import Technique as Technique
from moit.catalog import technique as technique
from moit.catalog import techniques as techniques
from moit.catalog.registered import MODULES as _TECHNIQUES
from moit.checks.exceptions import FragmentsError as FragmentsError
from moit.checks.exceptions import GpuError as GpuError
from moit.checks.exceptions import MeshError as MeshError
from moit.checks.exceptions import MoitError as MoitError
from moit.checks.exceptions import PrimitiveError as PrimitiveError
from moit.checks.exceptions import SplatsError as SplatsError
from moit.checks.exceptions import TechniqueError as TechniqueError
from moit.fragments import Fragments as Fragments
from moit.fragments import Frame as Frame
from moit.fragments import merge as merge
from moit.questions import bounds as bounds
from moit.questions import composite as composite
from moit.questions import total_transmittance as total_transmittance
from moit.questions import transmittance as transmittance
from moit.system.version import VERSION

# For those who read types: `as` says that a name is public.
if TYPE_CHECKING:
    from moit import deep as deep
    from moit import gpu as gpu
    from moit import gradients as gradients
    from moit import metrics as metrics
    from moit import moments as moments
    from moit import plot as plot
    from moit import scenes as scenes
    from moit import storage as storage
    from moit.about import info as info
    from moit.catalog.network import Network as Network
    from moit.catalog.papers import cite as cite
    from moit.catalog.python_technique import PythonTechnique as PythonTechnique
    from moit.catalog.registered import *  # noqa: F403  (all of them)
    from moit.comparing.choice import Choice as Choice
    from moit.comparing.choice import choose as choose
    from moit.comparing.comparison import compare as compare
    from moit.comparing.recommendation import Recommendation as Recommendation
    from moit.comparing.recommendation import recommend as recommend
    from moit.comparing.report import Report as Report
    from moit.deep_composites import composite_deep as composite_deep
    from moit.experiments.result import ExperimentResult as ExperimentResult
    from moit.experiments.running import experiment as experiment
    from moit.formats.deep import read_deep as read_deep
    from moit.formats.deep import write_deep as write_deep
    from moit.formats.deep_bands import read_deep_bands as read_deep_bands
    from moit.formats.files import load as load
    from moit.formats.files import save as save
    from moit.formats.images import read_image as read_image
    from moit.formats.images import write_image as write_image
    from moit.formats.inspection import inspect as inspect
    from moit.geometry.camera import Camera as Camera
    from moit.geometry.grids import Volume as Volume
    from moit.geometry.light import Light as Light
    from moit.geometry.meshes import Mesh as Mesh
    from moit.geometry.reading.mesh_files import read_mesh as read_mesh
    from moit.geometry.reading.mesh_files import read_meshes as read_meshes
    from moit.geometry.reading.splat_files import read_splats as read_splats
    from moit.geometry.reading.splat_files import write_splats as write_splats
    from moit.geometry.scalar_maps import map_scalars as map_scalars
    from moit.geometry.splats import Splats as Splats
    from moit.geometry.strokes import Lines as Lines
    from moit.geometry.strokes import Points as Points
    from moit.geometry.textures import Texture as Texture
    from moit.judging.result import Frontier as Frontier
    from moit.judging.running import frontier as frontier
    from moit.kit.exporting import export as export
    from moit.metrics import errors as errors
    from moit.neural.training import train as train
    from moit.numerics.bias import BiasAdvice as BiasAdvice
    from moit.numerics.bias import bias_advice as bias_advice
    from moit.numerics.checking import TechniqueCheck as TechniqueCheck
    from moit.numerics.checking import check_technique as check_technique
    from moit.numerics.report import StabilityReport as StabilityReport
    from moit.numerics.stability import stability as stability
    from moit.python_techniques.sort_free import SortFree as SortFree
    from moit.python_techniques.sort_free import SortFreeSplats as SortFreeSplats
    from moit.python_techniques.sort_free import read_sort_free as read_sort_free
    from moit.rendering.making import Rendering as Rendering
    from moit.rendering.popping import Popping as Popping
    from moit.rendering.popping import popping as popping
    from moit.rendering.rasterizing import rasterize as rasterize
    from moit.rendering.render import render as render
    from moit.reports.shown_images import ShownImage as ShownImage
    from moit.shadows.shadow_map import ShadowMap as ShadowMap
    from moit.showing import show as show

__version__ = VERSION

# Loaded when first used: importing moit stays quick for those who only ask questions. Techniques
# are where they are registered (moit.catalog.registered); the last two modules need frameworks of
# their names, and are not in __all__.
_MODULES = (
    "deep",
    "gpu",
    "gradients",
    "metrics",
    "moments",
    "plot",
    "scenes",
    "storage",
    "jax",
    "torch",
)
_LATER = {
    **{name: f"catalog.{module}" for name, module in _TECHNIQUES.items()},
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
    "Popping": "rendering.popping",
    "PythonTechnique": "catalog.python_technique",
    "Recommendation": "comparing.recommendation",
    "Rendering": "rendering.making",
    "Report": "comparing.report",
    "ShadowMap": "shadows.shadow_map",
    "ShownImage": "reports.shown_images",
    "SortFree": "python_techniques.sort_free",
    "SortFreeSplats": "python_techniques.sort_free",
    "Splats": "geometry.splats",
    "StabilityReport": "numerics.report",
    "TechniqueCheck": "numerics.checking",
    "Texture": "geometry.textures",
    "Volume": "geometry.grids",
    "bias_advice": "numerics.bias",
    "check_technique": "numerics.checking",
    "choose": "comparing.choice",
    "cite": "catalog.papers",
    "compare": "comparing.comparison",
    "composite_deep": "deep_composites",
    "errors": "metrics",
    "experiment": "experiments.running",
    "export": "kit.exporting",
    "frontier": "judging.running",
    "info": "about",
    "inspect": "formats.inspection",
    "load": "formats.files",
    "map_scalars": "geometry.scalar_maps",
    "popping": "rendering.popping",
    "rasterize": "rendering.rasterizing",
    "read_deep": "formats.deep",
    "read_deep_bands": "formats.deep_bands",
    "read_image": "formats.images",
    "read_mesh": "geometry.reading.mesh_files",
    "read_meshes": "geometry.reading.mesh_files",
    "read_sort_free": "python_techniques.sort_free",
    "read_splats": "geometry.reading.splat_files",
    "recommend": "comparing.recommendation",
    "render": "rendering.render",
    "save": "formats.files",
    "show": "showing",
    "stability": "numerics.stability",
    "train": "neural.training",
    "write_deep": "formats.deep",
    "write_image": "formats.images",
    "write_splats": "geometry.reading.splat_files",
}
_AT_ONCE = (
    "Fragments",
    "FragmentsError",
    "Frame",
    "GpuError",
    "MeshError",
    "MoitError",
    "PrimitiveError",
    "SplatsError",
    "Technique",
    "TechniqueError",
    "bounds",
    "composite",
    "merge",
    "technique",
    "techniques",
    "total_transmittance",
    "transmittance",
)
_PUBLIC = sorted({*_AT_ONCE, *_LATER, *_MODULES[:-2]})
if not TYPE_CHECKING:  # which would take what is not spelled out for private
    __all__ = _PUBLIC


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
    return sorted([*_PUBLIC, "__version__"])
