"""The one list that suites are parametrized over: a new technique inherits them all."""

import moit
from moit import (
    DeepShadowMap,
    MomentTransparency,
    PowerMoments,
    TrigonometricMoments,
    WaveletTransparency,
    WeightedBlended,
)

# One of every kind, and options that change what is computed.
OPTIONS = [
    {"exclude_self": True},
    {"exclude_self": True, "bias": 0.0, "overestimation": 0.5},
    {"warp": "linear", "normalize": False},
    {"depth_range": "pixel", "overestimation": 1.0},
]
POWER = [PowerMoments(m) for m in (4, 6, 8)]
POWER_VARIANTS = [PowerMoments(m, **options) for m in (4, 6, 8) for options in OPTIONS]
TRIGONOMETRIC = [TrigonometricMoments(m) for m in (2, 3, 4)]
TRIGONOMETRIC_VARIANTS = [
    TrigonometricMoments(m, **options)
    for m in (2, 3, 4)
    for options in [*OPTIONS, {"wrapping_zone": 0.0}, {"wrapping_zone": 1.0}]
]
WAVELETS = [
    WaveletTransparency(8, exclude_self=True),
    WaveletTransparency(16, warp="linear", normalize=False),
    WaveletTransparency(16, depth_range="pixel"),
    WaveletTransparency(8, projected="density", exclude_self=True),
    WaveletTransparency(32, bits=16),
]
SLICES = [
    moit.Slices(16, 16, "tile", tile=2),
    moit.Slices(32, 8, "pixel", depth_range="pixel", normalize=False),
    moit.Slices(16, resolution=2, warp="linear"),
    moit.Slices(16, 16, resolution=4, total="full"),
    moit.Slices(8, inside="power4"),
    moit.NeuralSlices(5, 6, warp="linear", normalize=False),
    moit.AdaptiveVoxels(16, 16, 2, slice_bias=1.0, warp="linear", normalize=False),
    moit.AdaptiveVoxels(resolution=1, depth_range="pixel"),
    moit.AdaptiveVoxels(32, low_resolution="average", resolution=4),
    moit.AdaptiveVoxels(64, resolution=4, filter="cubic"),
]
WORDS = [
    PowerMoments(4, bits=16, b0="float32", depth_range="pixel"),
    PowerMoments(6, bits=16, exclude_self=True, overestimation=0.5),
    PowerMoments(8, bits=16, bias=2.5e-2, warp="linear", normalize=False),
    TrigonometricMoments(3, bits=16, b0="float32", wrapping_zone=0.0),
    TrigonometricMoments(4, bits=16, exclude_self=True),
]
SERIES_OPTIONS = [
    {"exclude_self": True},
    {"bits": 32, "warp": "linear", "normalize": False},
    {"bits": 32, "depth_range": "pixel", "exclude_self": True},
]
SERIES = [
    technique
    for options in SERIES_OPTIONS
    for technique in (
        moit.FourierOpacity(15, **options),
        moit.TransmittanceFunctionMap(8, **options),
    )
]
TRANSPARENCY = [
    MomentTransparency(storage="unorm16", interval="symmetric", overestimation=0.25),
    MomentTransparency(storage="unorm16", resolution=2, low_resolution="average", warp="linear"),
    MomentTransparency(2, "nlqm", depth_range="pixel", normalize=False),
    MomentTransparency(2, exclude_self=True, bias=0.0),
]
BLOCKS = [
    PowerMoments(4, resolution=4),
    PowerMoments(6, resolution=2, total="full", exclude_self=True, overestimation=0.4),
    TrigonometricMoments(3, resolution=3, total="full"),
    moit.BoundedNeural("power4", resolution=4, total="full"),
    moit.FourierOpacity(7, resolution=8),
    PowerMoments(8, resolution=3, upsampling="depth-aware"),
    moit.FourierOpacity(15, bits=32, resolution=2, total="full", exclude_self=True),
    WaveletTransparency(8, resolution=4, total="full"),
    WaveletTransparency(16, bits=16, resolution=2, projected="density", exclude_self=True),
]
RANDOM = [
    moit.Stochastic(40, seed=1, normalize=False),
    moit.Stochastic(3, stratified=False),
    moit.HashedAlpha(seed=2**31 - 1),
]
TARGETS = [WeightedBlended(bits=16), WeightedBlended(weight="eq7", bits=16)]

LAYERS = [
    moit.DepthPeeling(1),
    moit.DepthPeeling(3, normalize=True),
    moit.HybridTransparency(2, normalize=True),
    moit.WeightedSum(normalize=True),
    moit.AdaptiveTransparency(2),
    moit.AdaptiveTransparency(7, quantized=False),
    moit.AdaptiveTransparency(4, normalize=True),
    moit.AdaptiveTransparency(4, merge="energy", normalize=True),
    moit.AdaptiveTransparency(2, warp="linear", merge="energy"),
    moit.AdaptiveTransparency(7, quantized=False, merge="energy", normalize=True),
    moit.AdaptiveTransparency(5, quantized=False, warp="linear"),
    moit.MultiLayerAlphaBlending(4, merge="energy"),
    moit.MultiLayerAlphaBlending(1, merge="energy"),
    moit.MultiLayerAlphaBlending(3, quantized=False, merge="energy", warp="linear"),
    moit.MultiLayerAlphaBlending(1, warp="linear"),
    moit.MultiLayerAlphaBlending(3, quantized=False),
    moit.MultiLayerAlphaBlending(8, quantized=False, min_alpha=0),
    moit.KBuffer(1),
    moit.HybridTransparency(1, core_alpha=0.3),
    moit.FrontLayers(1, tail="power6(exclude_self=True)"),
    moit.FrontLayers(3, tail="trig3", normalize=False),
]

NEURAL = [
    moit.NeuralMoments(depth_range="image", warp="linear", normalize=False),
    moit.DeepFragments(warp="linear"),
]
HALVES = [
    PowerMoments(4, storage="half"),
    PowerMoments(6, storage="half", depth_range="pixel", exclude_self=True),
    PowerMoments(8, storage="half", depth_range="pixel", warp="linear", normalize=False),
    moit.TwoMoments(storage=None),
    moit.TwoMoments(depth_range="pixel"),
    moit.BoundedNeural("power4", storage="half", depth_range="pixel"),
    moit.BoundedNeural("power6", storage="half"),
]
BOUNDED = [
    moit.BoundedNeural("power4", depth_range="pixel", normalize=False),
    moit.BoundedNeural("power6", warp="linear", bias=0.0),
]
ANCHORS = [
    moit.Anchors(1, cells=1, depth_range="pixel"),
    moit.Anchors(3, cells=7, gamma=0.0, warp="linear", normalize=False, key_bits=64),
    moit.Strong(1, gamma=0.0),
    moit.Strong(3, warp="linear", normalize=False, key_bits=64),
]


def _every() -> list:
    found = list(moit.techniques())
    extra = [*POWER, *POWER_VARIANTS, *SERIES, WeightedBlended(weight="blog", depth_scale=10.0)]
    extra += [*TRIGONOMETRIC, *TRIGONOMETRIC_VARIANTS]
    extra += [*WAVELETS, *SLICES, DeepShadowMap(0.0), DeepShadowMap(0.3, normalize=False)]
    extra += [*WORDS, *TARGETS, *TRANSPARENCY, *RANDOM, *LAYERS, *NEURAL, *BOUNDED, *BLOCKS]
    extra += HALVES
    extra += ANCHORS
    extra += [technique for technique in extra if technique not in found]
    return list(dict.fromkeys([*found, *extra]))


EVERY = _every()


def has_curve(technique) -> bool:
    """Whether the technique holds a transmittance for depths where no fragment is."""
    one = moit.Fragments([0, 1], [1.0], [0.5], [[1.0, 1.0, 1.0]])
    try:
        moit.transmittance(one, technique, depth=[1.0])
    except TypeError:
        return False
    return True


WITH_CURVE = [technique for technique in EVERY if has_curve(technique)]
WITHOUT_CURVE = [technique for technique in EVERY if technique not in WITH_CURVE]


def fills_coverage(technique) -> bool:
    """Whether the weights of a pixel's colours sum to what is covered, but for rounding."""
    if isinstance(technique, moit.MultiLayerAlphaBlending):
        return not technique.quantized  # half floats round each by itself
    if isinstance(technique, moit.DeepFragments):
        return False  # the same
    return leaves_nothing(technique)


# Weights sum to what is covered either way: `normalize` says to what that comes.
COVERING = (moit.DepthPeeling, moit.HybridTransparency, moit.WeightedSum)


def leaves_nothing(technique) -> bool:
    """Whether weights sum to what is covered, or are scaled so that they do."""
    return isinstance(technique, COVERING) or getattr(technique, "normalize", True)
