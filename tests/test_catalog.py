"""Techniques and their names: what str shows, technique reads back, and nothing else."""

import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import moit
from moit import PowerMoments, WeightedBlended
from moit.catalog import WEIGHTS

shares = st.one_of(
    st.floats(0, 1),
    st.floats(0, 1, width=32).map(np.float32),
    st.floats(0, 1).map(np.float64),
    st.sampled_from([0, 1]),
    st.fractions(0, 1),
)
truths = st.sampled_from([True, False, np.True_, np.False_])


@st.composite
def power_moments(draw) -> PowerMoments:
    warp = draw(st.sampled_from(["log", "linear", "none"]))
    ranges = ["image"] if warp == "none" else ["image", "pixel"]
    bits, b0 = draw(st.sampled_from([(32, None), (16, None), (16, "half"), (16, "float32")]))
    return PowerMoments(
        draw(st.sampled_from([4, 6, 8])),
        bits,
        b0,
        overestimation=draw(shares),
        bias=draw(st.one_of(st.none(), st.just("published"), shares)),
        warp=warp,
        depth_range=draw(st.sampled_from(ranges)),
        normalize=draw(truths),
        exclude_self=draw(truths),
        max_alpha=draw(st.floats(0, 1, exclude_min=True, exclude_max=True)),
    )


weighted = st.builds(
    WeightedBlended,
    weight=st.sampled_from(WEIGHTS),
    depth_scale=st.floats(0, exclude_min=True, allow_infinity=False),
)


@given(st.one_of(power_moments(), weighted, st.sampled_from(moit.techniques())))
def test_a_name_reads_back_to_the_same_technique(technique):
    assert moit.technique(str(technique)) == technique
    assert str(moit.technique(str(technique))) == str(technique)


def test_numbers_of_any_type_are_floats():
    for half in (np.float32(0.5), np.float64(0.5), Fraction(1, 2)):
        assert str(PowerMoments(4, bias=half)) == "power4(bias=0.5)"
    assert str(PowerMoments(4, bias=0)) == "power4(bias=0.0)"


@pytest.mark.parametrize(
    "name, words",
    [
        ("power4(bias=0)(warp='linear')", "name=value"),
        ("power4(bias=0).x(warp='linear')", "name=value"),
        ("power4(0.5)", "name=value"),
        ("power4(**{'bias': 0})", "name=value"),
        ("power4(bias=0, bias=1)", "name=value"),
        ("power4(bias=print())", "name=value"),
        ("power4(bias=" + 3000 * "-" + "1)", "name=value"),
        ("power4(count=6)", "count"),
        ("wboit-eq7(weight='blog')", "weight"),
        ("power4(normalize=1)", "normalize: expected True or False"),
        ("power4(overestimation='x')", "overestimation: expected a number"),
        ("power4(overestimation=2)", "overestimation: expected a number from 0 to 1"),
        ("power4(bias=1e999)", "bias: expected a finite number"),
        ("power4(bias=1" + 400 * "0" + ")", "bias: expected a finite number"),
        ("power4(biass=0)", "did you mean 'bias'"),
        ("pover4", "did you mean 'power4'"),
        ("", "there is no ''"),
    ],
)
def test_a_bad_name_is_a_value_error_that_says_why(name, words):
    with pytest.raises(ValueError, match=words):
        moit.technique(name)


def test_the_weight_may_be_an_option_of_plain_wboit():
    assert str(moit.technique("wboit(weight='eq7')")) == "wboit-eq7"


# Bits a pixel, ours and as papers count them (None: grows with the fragments).
BITS = {
    "sorted": (None, {}),
    "unsorted": (0, {}),
    "depth-peeling4": (32, {}),
    "weighted-sum": (0, {}),
    "weighted-average": (32, {}),
    **{
        name: (8, {"MBOIT": 8, "MT": 96})
        for name in (
            *("wboit", "wboit-eq7", "wboit-eq8", "wboit-eq9", "wboit-eq10"),
            "wboit-phenomenological",
        )
    },
    "moment-transparency": (160, {"MT": 256}),
    "moment-transparency-nlqm": (240, {"MT": 336}),
    "moment-transparency-lr8": (2.5, {"MT": 98.5}),
    "two-moments-pass": (320, {"MT": 416}),
    "two-moments-pass-lr8": (5, {"MT": 101}),
    "power4": (160, {"MBOIT": 160, "NMT": 320}),
    "power6": (224, {"MBOIT": 224}),
    "power8": (288, {"MBOIT": 288}),
    "power4-16": (80, {"MBOIT": 80}),
    "power6-16": (112, {"MBOIT": 112}),
    "power8-16": (144, {"MBOIT": 144}),
    "trig2": (160, {"MBOIT": 160}),
    "trig3": (224, {"MBOIT": 224}),
    "trig4": (288, {"MBOIT": 288}),
    "trig2-16": (80, {"MBOIT": 80}),
    "trig3-16": (112, {"MBOIT": 112}),
    "trig4-16": (144, {"MBOIT": 144}),
    "fourier7": (112, {"MBOIT": 112}),
    "fourier15": (240, {"MBOIT": 240}),
    "adaptive4": (128, {"MBOIT": 128}),
    "mlab2": (160, {"MBOIT": 160}),
    "mlab4": (320, {"MBOIT": 320}),
    "mlab6": (480, {"MBOIT": 480}),
    "kbuffer4": (640, {}),
    "hybrid4": (672, {}),
    "anchors4": (352, {}),
    "strong5": (304, {}),
    "deep-shadow": (None, {}),
    "transmittance-function-map8": (144, {}),
    "wavelet8": (256, {}),
    "wavelet16": (512, {}),
    "avboit": (24, {}),
    "slices64": (512, {}),
    "neural-slices8": (96, {}),
    "stochastic8": (256, {}),
    "hashed-alpha": (32, {}),
    "neural": (224, {"NMT": 352}),
    "dfa": (224, {"NMT": 352}),
    "neural-bounded": (160, {}),
    "neural-bounded6": (224, {}),
    "power2": (48, {}),
    "front2": (352, {}),
    "per-pixel": (None, {}),
    # with options
    "power4(depth_range='pixel')": (224, {"MBOIT": 160, "NMT": 320}),
    "power4-16(b0='float32')": (96, {"MBOIT": 80}),
    "trig2(depth_range='pixel')": (224, {"MBOIT": 160}),
    "wboit(bits=16)": (8, {"MBOIT": 8, "MT": 96}),
    "fourier7(bits=32)": (224, {"MBOIT": 112}),
    "adaptive4(quantized=False)": (256, {}),
    "mlab2(quantized=False)": (320, {}),
    "wavelet8(bits=16)": (128, {}),
    "depth-peeling8": (32, {}),
    "depth-peeling8(normalize=True)": (64, {}),
    "hybrid4(normalize=True)": (672, {}),
    "weighted-sum(normalize=True)": (32, {}),
    "adaptive8(merge='energy',normalize=True)": (256, {"MBOIT": 256}),
    "mlab4(merge='energy')": (320, {"MBOIT": 320}),
    "stochastic3": (96, {}),
    "slices64(resolution=4,total='full')": (64, {}),
}

SERIES = {
    "warp": "log",
    "depth_range": "image",
    "normalize": True,
    "max_alpha": 1 - 0.5 / 256,
    "exclude_self": False,
}
MOMENTS = {**SERIES, "bias": None, "overestimation": 0.25}
INTERVALS = {"intervals": 0}
IN_BLOCKS = {"resolution": 1, "total": "block", "upsampling": "bilinear"}
BLOCKS = {"passes": 1, "storage": "float32", "resolution": 1, "low_resolution": "raster"}

# What a technique has that its name does not say.
DEFAULTS = {
    "sorted": {},
    "depth-peeling4": {"layers": 4, "normalize": False},
    "weighted-sum": {"normalize": False},
    "wboit": {"weight": "blog", "depth_scale": 1.0, "bits": 32},
    "moment-transparency": {**MOMENTS, **BLOCKS, "overestimation": 0.0, "interval": "unit"},
    "two-moments-pass-lr8": {
        **{**MOMENTS, **BLOCKS, "overestimation": 0.0, "interval": "unit"},
        **{"passes": 2, "resolution": 8},
    },
    "power6": {
        **MOMENTS,
        **IN_BLOCKS,
        **INTERVALS,
        "count": 6,
        "bits": 32,
        "b0": None,
        "storage": None,
    },
    "power6-16": {
        **MOMENTS,
        **IN_BLOCKS,
        **INTERVALS,
        "count": 6,
        "bits": 16,
        "b0": None,
        "storage": None,
    },
    "trig3": {
        **MOMENTS,
        **IN_BLOCKS,
        **INTERVALS,
        "count": 3,
        "bits": 32,
        "b0": None,
        "wrapping_zone": math.pi / 10,
    },
    "fourier15": {**SERIES, **IN_BLOCKS, "coefficients": 15, "bits": 16},
    "transmittance-function-map8": {**SERIES, **IN_BLOCKS, "coefficients": 8, "bits": 16},
    "wavelet8": {**SERIES, **IN_BLOCKS, "coefficients": 8, "bits": 32, "projected": "absorbance"},
    "avboit": {
        **{name: SERIES[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"count": 128, "bits": 8, "resolution": 8, "slice_bias": None},
        **{"filter": "linear", "low_resolution": "raster", "cells": 8192},
    },
    "slices64": {
        **{name: SERIES[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"count": 64, "bits": 8, "table": "image", "tile": 16, "cells": None},
        **{"resolution": 1, "total": "block", "upsampling": "bilinear", "inside": None},
    },
    "neural-slices8": {
        **{name: SERIES[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"count": 8, "bits": 8, "network": None},
    },
    "adaptive4": {
        **{"nodes": 4, "quantized": True, "warp": None, "merge": "area"},
        "normalize": False,
    },
    "mlab4": {
        **{"layers": 4, "quantized": True, "warp": None, "min_alpha": 0.001},
        **{"merge": "last", "buckets": False, "front_alpha": 0.25, "back_alpha": 0.98},
    },
    "kbuffer4": {"layers": 4},
    "hybrid4": {"layers": 4, "normalize": False, "core_alpha": 0.0},
    "front2": {"layers": 2, "tail": "neural-bounded", "normalize": True, "key_bits": 64},
    "deep-shadow": {"tolerance": 0.02, "normalize": True},
    "stochastic8": {"samples": 8, "seed": 0, "stratified": True, "normalize": True},
    "hashed-alpha": {"seed": 0},
    "neural": {
        **{"network": None, "warp": "log", "max_alpha": 1 - 0.5 / 256},
        **{"depth_range": "pixel", "normalize": True},
    },
    "dfa": {"network": None, "warp": "log", "max_alpha": 1 - 0.5 / 256},
    "neural-bounded": {
        **{name: MOMENTS[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"bias": None, "moments": "power4", "network": None, "storage": None, **IN_BLOCKS},
    },
    "anchors4": {
        **{name: MOMENTS[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"kept": 4, "cells": 11, "gamma": 3.5},
        "key_bits": 32,
    },
    "strong5": {
        **{name: MOMENTS[name] for name in ("warp", "depth_range", "normalize", "max_alpha")},
        **{"kept": 5, "gamma": 4.0, "network": None},
        "key_bits": 32,
    },
    "per-pixel": {
        **{"max_error": 2 / 255, "techniques": None, "certify": False, "sample": 32768},
        "seed": 0,
    },
}

# The share of bias: of moments kept in float32 and in float64, and as papers have it.
BIAS = {
    "power4": (5e-8, 1e-15, 5e-7),
    "power6": (5e-8, 1e-15, 5e-6),
    "power8": (1.5e-7, 1e-14, 5e-5),
    "power4-16": (6e-5, 6e-5, 6e-5),
    "power6-16": (6e-4, 6e-4, 6e-4),
    "power8-16": (2.5e-3, 2.5e-3, 2.5e-3),
    "trig2": (4e-8, 1e-15, 4e-7),
    "trig3": (8e-8, 1e-15, 8e-7),
    "trig4": (1.5e-7, 1e-15, 1.5e-6),
    "trig2-16": (4e-4, 4e-4, 4e-4),
    "trig3-16": (6.5e-4, 6.5e-4, 6.5e-4),
    "trig4-16": (8.5e-4, 8.5e-4, 8.5e-4),
    "moment-transparency": (3e-7, 3e-7, 3e-7),
    "two-moments-pass-lr8": (3e-7, 3e-7, 3e-7),
    "neural-bounded": (2.5e-7, 1e-15, 5e-7),
    "neural-bounded6": (2.5e-7, 1e-15, 5e-6),
    "power2": (1e-4, 1e-4, 1e-4),
}


def test_options_may_be_at_the_ends_of_what_is_expected():
    for name in (
        *("power4(overestimation=0.0)", "power4(overestimation=1.0)", "power4(bias=1.0)"),
        *("mlab1", "mlab32", "adaptive2", "adaptive32", "depth-peeling1", "stochastic1"),
        *("stochastic64", "hashed-alpha(seed=2147483647)", "deep-shadow(tolerance=0.0)"),
        *("fourier3", "fourier31", "mlab4(min_alpha=0.0)", "kbuffer1", "hybrid32"),
    ):
        assert str(moit.technique(name)) == name
    for name, words in (
        ("power4(overestimation=1.0000001)", "from 0 to 1"),
        ("power4(max_alpha=1.0)", "max_alpha"),
        ("power4(max_alpha=0.0)", "max_alpha"),
        ("hashed-alpha(seed=2147483648)", "seed: expected an integer from 0 to 2147483647"),
        ("hashed-alpha(seed=-1)", "seed"),
        ("wboit(depth_scale=0.0)", "depth_scale: expected a positive number"),
    ):
        with pytest.raises(ValueError, match=words):
            moit.technique(name)


def test_a_range_that_begins_at_0_has_no_logarithm():
    f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], np.ones((2, 3)), depth_range=(0, 5))
    with pytest.raises(
        moit.FragmentsError, match=r"depth_range: found \(0\.0, 5\.0\); needed a positive"
    ):
        moit.composite(f, "power4")
    moit.composite(f, "power4(depth_range='pixel')")
    moit.composite(f, "power4(warp='linear')")


def test_passes_over_geometry_count_one_for_a_pixels_own_range():
    for name, passes in (("power4", 2), ("power4(depth_range='pixel')", 3), ("depth-peeling4", 4)):
        assert moit.technique(name).geometry_passes == passes


def test_bits_are_those_that_are_told():
    assert set(map(str, moit.techniques())) <= set(BITS)
    for name, (bits, published) in BITS.items():
        one = moit.technique(name)
        assert (one.bits_per_pixel, one.published_bits) == (bits, published), name


@pytest.mark.parametrize("name", DEFAULTS)
def test_options_are_what_they_are_documented_to_be_by_default(name):
    assert dataclasses.asdict(moit.technique(name)) == DEFAULTS[name]


@pytest.mark.parametrize("name", BIAS)
def test_bias_is_as_documented_and_as_published(name):
    one = moit.technique(name)
    found = [one.bias_for(np.float32), one.bias_for(np.float64)]
    found += [dataclasses.replace(one, bias="published").bias_for(t) for t in ("f4", "f8")]
    # moment transparency's is a float32 number
    assert found == pytest.approx([*BIAS[name], BIAS[name][-1]], rel=1e-7)
    assert dataclasses.replace(one, bias=0.125).bias_for(np.float32) == 0.125


def test_the_base_of_all_techniques_is_none():
    f = moit.scenes.load("panes", size=(2, 2))
    with pytest.raises(TypeError, match="technique: Technique"):
        moit.composite(f, moit.Technique())
