"""What moit.export refuses: techniques and languages without a text, ranges of depth."""

import os
from pathlib import Path

import pytest

import moit
from moit.kit.recipes import names_with_kits
from moit.kit.refusals import _NEEDS, nearest_kit


def test_an_unknown_language_lists_those_there_are(tmp_path):
    with pytest.raises(ValueError, match=r"language: expected 'glsl', .*'slang', got 'cg'"):
        moit.export("power4", tmp_path / "kit", "cg")
    assert not os.path.exists(tmp_path / "kit")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("sorted", "list of each pixel's fragments.*nearest is 'power4'"),
        ("deep-shadow", "list of each pixel's.*sorts.*nodes.*nearest is 'adaptive16'"),
        ("transmittance-function-map8", "list of each pixel's.*cosines.*nearest is 'fourier7'"),
        ("slices64(inside='power4')", "bounds of moments.*nearest is 'slices64'"),
        ("slices8(resolution=2,total='byte')", "a byte.*nearest is \"slices8.*'half'"),
        ("slices8(resolution=2,upsampling='depth-aware')", "totals alone.*nearest is"),
        ("avboit(resolution=1,depth_range='pixel')", "own extent.*nearest is 'avboit'"),
        ("anchors4(depth_range='pixel')", "own extent.*nearest is 'anchors4'"),
        (
            "front2(tail=\"power4(depth_range='pixel')\")",
            "own extent needs.*nearest is 'front2'",
        ),
        (
            "power4-16(depth_range='pixel')",
            "order of triangles.*nearest is \"power4\\(depth_range='pixel'\\)\"",
        ),
        ("power4(depth_range='pixel',storage='half')", "own extent to words.*nearest is 'power4'"),
        ("trig3(wrapping_zone=0.0)", "wrapping zone"),
        ("two-moments-pass(storage='nlqm')", "one set.*nearest is 'two-moments-pass'"),
        ("power4(resolution=4,upsampling='depth-aware')", "shares alone.*is 'power4.resolution=4"),
        ("wavelet32(resolution=4,total='full')", "nine targets.*is 'wavelet32.resolution=4"),
        ("fourier27(resolution=2,total='full')", "27 coeff.*is 'fourier27.resolution=2"),
        (
            "moment-transparency(resolution=4,low_resolution='average')",
            "mean of its pixels'.*nearest is 'moment-transparency'",
        ),
        (
            "moment-transparency(resolution=8,storage='unorm16')",
            "words of blocks.*nearest is 'moment-transparency-lr8'",
        ),
        ("unsorted", "a blend function"),
        ("stochastic3", "2, 4, 8 or 16 samples; nearest is 'stochastic8'"),
    ],
)
def test_a_technique_without_a_kit_says_why_and_what_is_nearest(name, why, tmp_path):
    with pytest.raises(ValueError, match=rf"technique: .* has no kit: .*{why}"):
        moit.export(name, tmp_path / "kit")
    assert not os.path.exists(tmp_path / "kit")


def test_what_is_nearest_has_a_kit_and_reasons_are_of_techniques_that_there_are():
    kinds = {one.kind: one for one in moit.techniques()}
    assert set(_NEEDS) <= set(kinds)
    for kind in _NEEDS:
        assert nearest_kit(kinds[kind]).strip("'") in names_with_kits()


def test_a_weight_of_python_has_no_text(tmp_path):
    technique = moit.WeightedBlended(lambda depth, alpha, color: alpha)
    with pytest.raises(ValueError, match="Python function; nearest is 'wboit'"):
        moit.export(technique, tmp_path / "kit")


@pytest.mark.parametrize("found", [(1, 1), (0, 2), (2, 1), (1, float("inf")), (float("nan"), 1)])
def test_a_range_of_depth_is_checked(found, tmp_path):
    with pytest.raises(ValueError, match="depth_range: expected 0 < near < far"):
        moit.export("power4", tmp_path / "kit", depth_range=found)


@pytest.mark.parametrize("found", [(0, 10), (-5, 5)])
def test_a_range_of_what_takes_no_logarithm_may_begin_anywhere(found, tmp_path):
    moit.export("power4(warp='none')", tmp_path / "unwarped", depth_range=found)
    files = moit.export("power4(warp='linear')", tmp_path / "kit", depth_range=found)
    text = Path(files[1]).read_text(encoding="utf-8")
    scale = 2 / (found[1] - found[0])
    assert f"#define MOIT_WARP_SCALE {scale!r}" in text
    assert f"#define MOIT_WARP_OFFSET {-1 - scale * found[0]!r}" in text
    for name in ("power4", "wboit", "adaptive4"):
        with pytest.raises(ValueError, match="depth_range: expected 0 < near < far"):
            moit.export(name, tmp_path / "none", depth_range=found)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("power4", (1e-300, 1)),
        ("power4(warp='linear')", (-1.7e308, 1.7e308)),
        ("wboit-eq7(bits=16)", (1, 1e39)),
        ("wboit", (1, 1 + 1e-9)),
    ],
)
def test_a_range_of_depth_that_no_float_holds_is_refused(name, found, tmp_path):
    with pytest.raises(ValueError, match="depth_range: expected near and far that floats of a"):
        moit.export(name, tmp_path / "kit", depth_range=found)
    assert os.listdir(tmp_path) == []


def test_a_range_of_depth_is_two_numbers(tmp_path):
    for found in (3, (1, 2, 3), ("a", "b")):
        with pytest.raises(TypeError, match="depth_range: expected"):
            moit.export("power4", tmp_path / "kit", depth_range=found)
