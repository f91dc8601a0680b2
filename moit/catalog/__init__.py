"""The techniques: what each stores per pixel, by which options, and where it was published.

A technique is a small frozen dataclass. `str` gives its name with the options that differ from the
default; `technique` reads that back.
"""

from __future__ import annotations

from moit.catalog.anchors import Anchors, Strong
from moit.catalog.exact import AlphaBlend, Sorted
from moit.catalog.front import FrontLayers
from moit.catalog.layers import (
    AdaptiveTransparency,
    DepthPeeling,
    HybridTransparency,
    KBuffer,
    MultiLayerAlphaBlending,
)
from moit.catalog.moment_transparency import MomentTransparency
from moit.catalog.moments import PowerMoments, TrigonometricMoments, TwoMoments
from moit.catalog.names import CATALOG, listed, technique, techniques
from moit.catalog.neural import BoundedNeural
from moit.catalog.neural_moments import DeepFragments, NeuralMoments
from moit.catalog.per_pixel import PerPixel
from moit.catalog.python_technique import PythonTechnique
from moit.catalog.reconstruction import MomentTechnique
from moit.catalog.series import FourierOpacity, TransmittanceFunctionMap
from moit.catalog.shadow_maps import DeepShadowMap
from moit.catalog.slices import AdaptiveVoxels, Slices
from moit.catalog.stochastic import HashedAlpha, Stochastic
from moit.catalog.technique import Technique
from moit.catalog.wavelets import WaveletTransparency
from moit.catalog.weighted import WEIGHTS, WeightedAverage, WeightedBlended, WeightedSum

__all__ = [
    "WEIGHTS",
    "AdaptiveTransparency",
    "AdaptiveVoxels",
    "AlphaBlend",
    "Anchors",
    "BoundedNeural",
    "DeepFragments",
    "DeepShadowMap",
    "DepthPeeling",
    "FourierOpacity",
    "FrontLayers",
    "HashedAlpha",
    "HybridTransparency",
    "KBuffer",
    "MomentTechnique",
    "MomentTransparency",
    "MultiLayerAlphaBlending",
    "NeuralMoments",
    "PerPixel",
    "PowerMoments",
    "PythonTechnique",
    "Slices",
    "Sorted",
    "Stochastic",
    "Strong",
    "Technique",
    "TransmittanceFunctionMap",
    "TrigonometricMoments",
    "TwoMoments",
    "WaveletTransparency",
    "WeightedAverage",
    "WeightedBlended",
    "WeightedSum",
    "listed",
    "technique",
    "techniques",
]


_EVERY: list[Technique] = [
    Sorted(),
    AlphaBlend(),
    DepthPeeling(4),
    WeightedSum(),
    WeightedAverage(),
    *(WeightedBlended(weight) for weight in WEIGHTS),
    MomentTransparency(),
    MomentTransparency(storage="nlqm"),
    MomentTransparency(resolution=8),
    MomentTransparency(passes=2),
    MomentTransparency(passes=2, resolution=8),
    *(PowerMoments(count, bits) for bits in (32, 16) for count in (4, 6, 8)),
    *(TrigonometricMoments(count, bits) for bits in (32, 16) for count in (2, 3, 4)),
    *(FourierOpacity(coefficients) for coefficients in (7, 15)),
    AdaptiveTransparency(4),
    *(MultiLayerAlphaBlending(layers) for layers in (2, 4, 6)),
    KBuffer(4),
    HybridTransparency(4),
    DeepShadowMap(),
    TransmittanceFunctionMap(8),
    *(WaveletTransparency(coefficients) for coefficients in (8, 16)),
    AdaptiveVoxels(),
    Slices(),
    Stochastic(8),
    HashedAlpha(),
    NeuralMoments(),
    DeepFragments(),
    *(BoundedNeural(moments) for moments in ("power4", "power6")),
    TwoMoments(),
    Anchors(4),
    Strong(5),
    FrontLayers(2),
    PerPixel(),
]
CATALOG.update({one.base_name: one for one in _EVERY})
