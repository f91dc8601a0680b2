"""The techniques that there are: each has a line among the types, and one in the table.

A class is loaded when it is first asked for, so that `import moit` stays quick.
"""

from typing import TYPE_CHECKING

from moit.catalog.names import CLASSES

# For those who read types; `moit` and `moit.catalog` have what stands here.
if TYPE_CHECKING:
    from moit.catalog.anchors import Anchors as Anchors
    from moit.catalog.anchors import Strong as Strong
    from moit.catalog.exact import AlphaBlend as AlphaBlend
    from moit.catalog.exact import Sorted as Sorted
    from moit.catalog.front import FrontLayers as FrontLayers
    from moit.catalog.layers import AdaptiveTransparency as AdaptiveTransparency
    from moit.catalog.layers import DepthPeeling as DepthPeeling
    from moit.catalog.layers import HybridTransparency as HybridTransparency
    from moit.catalog.layers import KBuffer as KBuffer
    from moit.catalog.layers import MultiLayerAlphaBlending as MultiLayerAlphaBlending
    from moit.catalog.moment_transparency import MomentTransparency as MomentTransparency
    from moit.catalog.moments import PowerMoments as PowerMoments
    from moit.catalog.moments import TrigonometricMoments as TrigonometricMoments
    from moit.catalog.moments import TwoMoments as TwoMoments
    from moit.catalog.neural import BoundedNeural as BoundedNeural
    from moit.catalog.neural_moments import DeepFragments as DeepFragments
    from moit.catalog.neural_moments import NeuralMoments as NeuralMoments
    from moit.catalog.neural_slices import NeuralSlices as NeuralSlices
    from moit.catalog.per_pixel import PerPixel as PerPixel
    from moit.catalog.series import FourierOpacity as FourierOpacity
    from moit.catalog.series import TransmittanceFunctionMap as TransmittanceFunctionMap
    from moit.catalog.shadow_maps import DeepShadowMap as DeepShadowMap
    from moit.catalog.slices import AdaptiveVoxels as AdaptiveVoxels
    from moit.catalog.slices import Slices as Slices
    from moit.catalog.stochastic import HashedAlpha as HashedAlpha
    from moit.catalog.stochastic import Stochastic as Stochastic
    from moit.catalog.wavelets import WaveletTransparency as WaveletTransparency
    from moit.catalog.weighted import WeightedAverage as WeightedAverage
    from moit.catalog.weighted import WeightedBlended as WeightedBlended
    from moit.catalog.weighted import WeightedSum as WeightedSum

# How names of techniques begin, with the module and name of the class, in the order of the
# documentation's table.
CLASSES.update(
    {
        "sorted": "exact.Sorted",
        "unsorted": "exact.AlphaBlend",
        "depth-peeling": "layers.DepthPeeling",
        "weighted-sum": "weighted.WeightedSum",
        "weighted-average": "weighted.WeightedAverage",
        "wboit": "weighted.WeightedBlended",
        "moment-transparency": "moment_transparency.MomentTransparency",
        "two-moments-pass": "moment_transparency.MomentTransparency",
        "power": "moments.PowerMoments",
        "trig": "moments.TrigonometricMoments",
        "fourier": "series.FourierOpacity",
        "adaptive": "layers.AdaptiveTransparency",
        "mlab": "layers.MultiLayerAlphaBlending",
        "kbuffer": "layers.KBuffer",
        "hybrid": "layers.HybridTransparency",
        "deep-shadow": "shadow_maps.DeepShadowMap",
        "transmittance-function-map": "series.TransmittanceFunctionMap",
        "wavelet": "wavelets.WaveletTransparency",
        "avboit": "slices.AdaptiveVoxels",
        "slices": "slices.Slices",
        "stochastic": "stochastic.Stochastic",
        "hashed-alpha": "stochastic.HashedAlpha",
        "neural": "neural_moments.NeuralMoments",
        "dfa": "neural_moments.DeepFragments",
        "neural-bounded": "neural.BoundedNeural",
        "power2": "moments.TwoMoments",
        "anchors": "anchors.Anchors",
        "strong": "anchors.Strong",
        "front": "front.FrontLayers",
        "neural-slices": "neural_slices.NeuralSlices",
        "per-pixel": "per_pixel.PerPixel",
    }
)

# Of each class its module.
MODULES = {name: module for module, name in (one.split(".") for one in CLASSES.values())}
