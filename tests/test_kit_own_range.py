"""Kits that give each pixel the range of its own fragments' depths."""

import json
import re

import numpy as np
import pytest
from readings import kit_shaders, kits

import moit
from moit.kit.including import LANGUAGES
from moit.kit.own_range import EXTENTS

OWN = moit.technique("power4(depth_range='pixel')")
LINEAR = moit.technique("power4(depth_range='pixel',warp='linear')")


def test_extents_are_drawn_first_and_read_by_both_passes(tmp_path):
    moit.export(OWN, tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    passes = {one["name"]: one for one in table["passes"]}
    assert list(passes) == ["extents", "absorbance", "shading", "resolve"]
    assert passes["extents"]["targets"] == passes["absorbance"]["reads"] == ["extent"]
    assert "extent" in passes["shading"]["reads"] and "extent" not in passes["resolve"]["reads"]
    target = next(one for one in table["targets"] if one["name"] == "extent")
    assert target["blend"]["operation"] == "max" and target["format"]["webgpu"] == "rg32float"
    plain = moit.technique("power4").bits_per_pixel // 8
    assert table["bytes_a_pixel"] == plain + 8 + 8  # extents and colours
    page = (tmp_path / "README.md").read_text()
    assert "in 3 passes" in page and "--depth-range" not in page and "invariant" in page
    text = (tmp_path / "moit_power4.glsl").read_text()
    assert "WARP_SCALE" not in text and "moit_warped(" not in text


def placed(technique, language, depth):
    """z of the fragments of one pixel."""
    extent = kits.extents_of(technique, language, depth).max(0)
    return kits.warped_within(technique, language, np.repeat(extent[None], len(depth), 0), depth)


@pytest.mark.parametrize("language", LANGUAGES)
def test_depths_lie_between_the_ends_of_their_pixel(language):
    depth = np.array([2, 32, 8, 4, 16], np.float32)
    np.testing.assert_allclose(placed(OWN, language, depth), [-1, 1, 0, -0.5, 0.5], atol=5e-7)
    linear = placed(LINEAR, language, depth)
    np.testing.assert_allclose(linear, (depth - 2) / 15 - 1, atol=2e-7)


@pytest.mark.parametrize("language", ["glsl", "wgsl"])
def test_depths_close_together_keep_the_digits_of_their_differences(language):
    depth = (900 + np.arange(9) * 2.0**-13).astype(np.float32)  # a few steps of floats apart
    for technique in (OWN, LINEAR):
        found = placed(technique, language, depth)
        np.testing.assert_allclose(found, np.linspace(-1, 1, 9), atol=1e-6)


@pytest.mark.parametrize("language", ["glsl", "wgsl"])
def test_what_has_one_depth_lies_in_the_middle_and_what_is_beyond_at_the_ends(language):
    for technique in (OWN, LINEAR):
        assert (placed(technique, language, np.full(3, 7, np.float32)) == 0).all()
        extents = np.array([[-2, 4], [-2, 4]], np.float32)
        beyond = kits.warped_within(technique, language, extents, np.array([1, 5], np.float32))
        assert beyond.tolist() == [-1, 1]


def test_networks_have_extents_of_words(tmp_path):
    moit.export("neural", tmp_path, depth_range=(1, 100))
    table = json.loads((tmp_path / "targets.json").read_text())
    targets = {one["name"]: one for one in table["targets"]}
    assert targets["extent"]["format"]["vulkan"] == "R16G16_UNORM"
    assert (targets["extent"]["clear"], targets["extent"]["bytes_a_pixel"]) == (0, 4)
    assert table["passes"][1]["targets"] == ["target0", "target1"]
    assert "--depth-range 1,100" in (tmp_path / "README.md").read_text()


@pytest.mark.parametrize("language", ["glsl", "wgsl"])
def test_a_lone_surface_of_a_network_lies_in_the_middle_whatever_its_word(language):
    technique = moit.technique("neural")
    depth = np.geomspace(0.11, 900, 4001).astype(np.float32)
    words = np.floor(kits.extents_of(technique, language, depth).astype(float) * 65535 + 0.5)
    extents = (words / 65535).astype(np.float32)
    assert (kits.warped_within(technique, language, extents, depth) == 0).all()
    for far, place in ((1.01, 2), (0.99, -2)):
        beyond = kits.warped_within(technique, language, extents, np.float32(far) * depth)
        assert (beyond == place).all()


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(
    "name",
    [
        "two-moments-pass(depth_range='pixel')",
        "fourier7(depth_range='pixel')",
        "neural-bounded6(depth_range='pixel')",
    ],
)
def test_its_shaders_are_valid(name, language):
    kit_shaders.validate(kits.include(moit.technique(name), language))


def test_extents_begin_beyond_any_depth():
    (extents,) = EXTENTS  # the greatest of -depth and of depth, of float32
    assert -np.finfo(np.float32).max < extents.clear < -0.88 * np.finfo(np.float32).max


@pytest.mark.parametrize("language", ["glsl", "metal"])
def test_a_network_is_told_how_long_a_pixels_range_is_of_the_cameras(language, tmp_path):
    moit.export("neural-bounded(depth_range='pixel')", tmp_path, language, depth_range=(1, 100))
    page = (tmp_path / "README.md").read_text()
    own = "moit_extents own = moit_fetched_extents("
    assert re.search(rf"{re.escape(own)}.*\n *moit_factors pixel = moit_factor\(.*, own\);", page)
    factors = page.partition("// the pass for factors")[2].partition("// shading")[0]
    assert own in factors and "--depth-range 1,100" in page  # which its scale hangs on
    shading = page.partition("// the pass for factors")[2].partition("// shading")[2]
    assert own in shading and "moit_factor(" not in shading.partition("```")[0]
