"""What an engineer reads beside an include: nothing is named that stays at home, and blend
functions stand in the words of each interface."""

from __future__ import annotations

import re

import pytest

import moit
from moit.kit.including import LANGUAGES, include_of
from moit.kit.interfaces import BLENDING, INTERFACES, STATES, blend_words, format_names
from moit.kit.page import page_of
from moit.kit.recipes import recipe_of
from moit.kit.table import table_of


def made(name: str, language: str):
    technique = moit.technique(name)
    recipe = recipe_of(technique, (0.1, 1000.0))
    include = include_of(technique, recipe, LANGUAGES[language])
    return include, page_of(technique, recipe, include), table_of(technique, recipe, include)


# Of each text that kits are made of one.
NAMES = (
    *("wboit", "fourier7", "wavelet4", "moment-transparency", "two-moments-pass-lr8"),
    *("power2", "power4", "power6", "power8", "trig2", "trig3", "trig4", "power4-16"),
    *("neural-bounded", "neural-bounded6", "avboit", "slices64", "anchors4", "strong5", "front2"),
    "neural-slices8",
    *("adaptive4", "mlab2", "kbuffer4", "hybrid4", "depth-peeling4", "stochastic4"),
)


@pytest.mark.parametrize("name", NAMES)
def test_pages_speak_of_what_goes_home_and_say_what_a_bias_is(name):
    include, page, _ = made(name, "hlsl")
    for said in ("texts for engines", "that includes this", "text before this", "NOT_FUSED"):
        assert said not in page + include.text
    # names of which another of our texts decides
    assert not re.search(r"\b(EACH|LAYERS|ANCHORS|CELLS|NUMBERS|LEVELS)\b {1,2}[a-z]", page)
    if biases := [one for one in include.options if one.name == "MOIT_BIAS"]:
        (line,) = re.findall(r"#define MOIT_BIAS .*", include.text)
        assert "// How much of " in line and biases[0].about in page


@pytest.mark.parametrize("name", ["power4", "wboit", "front2", "depth-peeling4", "hybrid4"])
def test_each_blend_function_stands_in_the_words_of_each_interface(name):
    _, page, table = made(name, "hlsl")
    rows = {line.split(" | ")[0][2:]: line for line in page.splitlines() if line[:2] == "| "}
    for one in (*table["targets"], table["passes"][-1]):
        words = blend_words(**one["blend"])
        for interface in INTERFACES:
            assert f"`{words[interface]}`" in rows[interface]
    for one in table["targets"]:
        assert tuple(one["format"]) == tuple(name.lower() for name in INTERFACES)
        assert " | ".join(one["format"].values()) in page


def test_words_of_interfaces_are_theirs():
    # those of WebGPU, which a package lists; the others say the same of source and destination
    wgpu = pytest.importorskip("wgpu")
    assert tuple(STATES) == INTERFACES
    for operation, source, destination in BLENDING.values():
        words = blend_words(operation, source, destination)
        factors = [one.strip('"') for one in words["WebGPU"].split(", ")]
        assert {*factors[:2]} <= {*wgpu.BlendFactor} and factors[2] in {*wgpu.BlendOperation}
        for one, said in words.items():
            assert ("ZERO" in said.upper()) == (source == "zero" or destination == "zero"), one
            assert ("MAX" in said.upper()) == (operation == "max"), one
            inverse = [
                word for word in said.split(", ") if re.search("INV_|minus|Minus|MINUS", word)
            ]
            assert len(inverse) == sum("minus" in factor for factor in (source, destination)), one
            assert all(
                ("alpha" in factor) == ("alpha" in word.lower())
                for factor, word in zip((source, destination), said.split(", "), strict=False)
            )
    for format in ("r8", "r16f", "rg32f", "rgba16f", "rgba32f", "r32ui"):
        assert format_names(format)["webgpu"] in {*wgpu.TextureFormat}
