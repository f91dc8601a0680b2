"""Kits of techniques whose states are means over blocks of pixels."""

import json

import numpy as np
import pytest
from readings import kit_cases, kit_shaders, kits

import moit
from moit.kit.including import LANGUAGES

FULL = "power4(resolution=4,total='full')"
# Every shape of `sums`, with the total of blocks and with pixels' own.
VARIANTS = {
    FULL: 2e-6,
    "power4(resolution=3,exclude_self=True)": 2e-6,
    "power6(resolution=3,total='full')": 4e-5,
    "power8(resolution=8)": 4e-6,
    "trig3(resolution=4,total='full')": 4e-6,
    "neural-bounded(resolution=4,total='full')": 4e-6,
    "neural-bounded6(resolution=4)": 2e-5,
    "wavelet8(resolution=4)": 1e-5,
    "fourier9(resolution=5,bits=32)": 1e-5,
    "fourier7(resolution=4,total='full',bits=32)": 1e-5,
    "fourier9(resolution=3,total='full',bits=32)": 1e-5,
    "wavelet8(resolution=4,total='full')": 1e-5,
    "wavelet4(resolution=2,total='full',exclude_self=True)": 1e-5,
}


@pytest.fixture(scope="module")
def case():
    return kit_cases.held_case()


def exported(name, folder, language="glsl"):
    moit.export(name, folder, language)
    table = json.loads((folder / "targets.json").read_text())
    return table, {one["name"]: one for one in table["passes"]}, (folder / "README.md").read_text()


def test_means_are_made_between_the_passes_over_geometry(tmp_path):
    table, passes, page = exported("power4(resolution=4)", tmp_path)
    assert list(passes) == ["absorbance", "means", "shading", "resolve"]
    assert passes["absorbance"]["targets"] == passes["means"]["reads"] == ["target0", "target1"]
    assert passes["means"]["targets"] == passes["shading"]["reads"] == ["mean0", "mean1"]
    assert passes["resolve"]["reads"] == passes["shading"]["targets"] == ["target2", "target3"]
    sides = {one["name"]: one.get("block_side", 1) for one in table["targets"]}
    assert sides == {"target0": 1, "target1": 1, "mean0": 4, "mean1": 4, "target2": 1, "target3": 1}
    assert table["targets"][2]["blend"]["destination"] == "zero"
    assert list(table["bindings"].values()) == list(range(6))
    assert table["bytes_a_pixel"] == 20 + 20 / 16 + 8 + 4
    assert "Shading reads 1.25 bytes a pixel" in page and "farthest" not in page
    assert "mean1 = mean.target1;" in page and "target3 = alpha;" in page


def test_a_pixels_own_total_is_read_by_both_last_passes(tmp_path):
    table, passes, page = exported(FULL, tmp_path)
    assert passes["shading"]["reads"] == ["mean0", "mean1", "target1"]
    assert passes["resolve"]["reads"] == ["target2", "target1"]
    bits = moit.technique(FULL).bits_per_pixel
    read = {"mean0", "mean1", "target1"}
    kept = [one for one in table["targets"] if one["name"] in read]
    assert sum(one["bytes_a_pixel"] / one.get("block_side", 1) ** 2 for one in kept) == bits / 8
    assert "target3" not in page


@pytest.mark.parametrize("language", ["glsl", "wgsl"])
@pytest.mark.parametrize("name", VARIANTS)
def test_pixels_read_means_of_blocks_as_the_core_does(name, language, case):
    _, error = kit_cases.errors(moit.technique(name), language, case)
    assert np.quantile(error, 0.999) < VARIANTS[name]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", [FULL, "power6(resolution=4)"])
def test_its_shaders_are_valid(name, language):
    kit_shaders.validate(kits.include(moit.technique(name), language))


def test_what_blocks_hide_altogether_keeps_colour():
    technique = moit.technique("power4(resolution=4)")
    assert "max(through, 0.00024414062)" in kits.include(technique, "glsl").text
    assert "max(through" not in kits.include(moit.technique(FULL), "glsl").text


def test_waves_have_totals_in_a_target_of_their_own(tmp_path):
    """Half floats as their coefficients, where these are."""
    table, passes, _ = exported("fourier7(resolution=4,total='full')", tmp_path)
    targets = {one["name"]: one["format"]["webgpu"] for one in table["targets"]}
    assert targets["target3"] == targets["mean3"] == "r16float"
    assert passes["shading"]["reads"] == ["mean0", "mean1", "mean2", "mean3", "target3"]
    assert passes["resolve"]["reads"] == ["target4", "target3"]
