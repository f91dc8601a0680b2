"""`moit.export`: what is in the folder, and what has none. tests/test_kit_run.py runs the texts."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
from readings import kits

import moit
from moit.catalog.targets import shipped_targets_of
from moit.gpu import texts
from moit.gpu_costs.predicting import on_gpu
from moit.gpu_costs.stored import Costs
from moit.kit.including import LANGUAGES, MOST_LINES
from moit.kit.licence import LICENCE
from moit.kit.page import page_of
from moit.kit.pasting import needed_items
from moit.kit.recipes import names_with_kits, recipe_of

ROOT = Path(__file__).parents[1]
NAMES = names_with_kits()
NEURAL = "neural(depth_range='image')"
# whose warp is an option of their own
WARPED = [one for one in names_with_kits() if moit.technique(one).depth_warp and one != "front2"]


def include(name, language="glsl", depth_range=(0.1, 1000.0)):
    return kits.include(moit.technique(name), language, depth_range)


@pytest.mark.parametrize(
    ("name", "language"), [(n, one) for one in LANGUAGES for n in names_with_kits(one)]
)
def test_an_include_stands_alone_and_takes_no_names_of_an_engine(name, language):
    text = include(name, language).text
    assert not set(re.findall(r"#include (.*)", text)) - {"<metal_stdlib>"}
    assert not [line for line in text.splitlines() if len(line) > 100]
    assert len(text.splitlines()) <= MOST_LINES
    declared = re.findall(
        r"^(?:inline |static |constant )*(?:const |fn |struct |override |var(?:<\w+>)? |\w+ )"
        r"(\w+)(?= ?[\(:{=\[])",
        text,
        re.MULTILINE,
    )
    assert declared
    assert not [one for one in declared if not one.lower().startswith("moit_")]
    assert set(re.findall(r"#define (\w+)", text)) <= set(re.findall(r"MOIT_\w+", text))


@pytest.mark.parametrize("name", ["adaptive4", "mlab4", "kbuffer4", "hybrid4", "power4-16"])
def test_what_is_ordered_says_so_to_the_device(name):
    glsl = include(name).text
    for word in (
        "pixel_interlock_ordered",
        "early_fragment_tests",
        "coherent uniform uimage2DArray",
    ):
        assert word in glsl.partition("#else")[0] + glsl[glsl.index("#ifndef MOIT_LOAD") :]
    assert "RasterizerOrderedTexture2DArray<uint>" in include(name, "hlsl").text
    assert "raster_order_group(0)" in include(name, "metal").text
    with pytest.raises(
        ValueError, match=rf"{name} has no kit in WGSL: .*no ordered access.*nearest"
    ):
        include(name, "wgsl")


def test_moments_in_half_floats_have_such_targets(tmp_path):
    moit.export("power6(storage='half')", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    formats = [one["format"]["direct3d"] for one in table["targets"]]
    assert formats[:3] == ["R16G16B16A16_FLOAT", "R16G16_FLOAT", "R16_FLOAT"]
    assert table["bytes_a_pixel"] == 14 + 8
    page = (tmp_path / "README.md").read_text()
    assert "Sums are rounded to half floats" in page and "float32-blendable" not in page
    options = {one["name"]: float(one["value"]) for one in table["options"]}
    assert options["MOIT_BIAS"] == 5e-4  # the core's of such storage


def test_a_hashed_alpha_test_writes_depth_and_blends_nothing(tmp_path):
    moit.export("hashed-alpha(seed=3)", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    shading, _ = table["passes"]
    assert shading["depth"] == {"test": "less", "write": True}
    blend = {"operation": "add", "source": "one", "destination": "zero"}
    assert table["targets"][0]["blend"] == blend and table["bytes_a_pixel"] == 8
    assert {"name": "MOIT_SEED", "value": "3"} in table["options"]
    page = (tmp_path / "README.md").read_text()
    assert "moit_covered_samples(" in page and "== 0u) { discard; }" in page


def test_samples_and_rounds_are_in_the_table(tmp_path):
    moit.export("stochastic8", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    coverage, total, shading, _ = table["passes"]
    assert coverage["samples"] == shading["samples"] == 8 and "samples" not in total
    assert coverage["depth"]["write"] and shading["depth"]["test"] == "less-equal"
    assert table["bytes_a_pixel"] == 4 + 8 * (4 + 8)
    with pytest.raises(ValueError, match=r"in WGSL: .* 4 samples there.*nearest is 'stochastic4'"):
        moit.export("stochastic8", tmp_path, "wgsl")
    moit.export("depth-peeling6", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    peeling, under, _ = table["passes"]
    assert peeling["rounds"] == under["rounds"] == 6 and peeling["depth"]["write"]
    assert table["targets"][0]["blend"] == {
        "operation": "add",
        "source": "one-minus-dst-alpha",
        "destination": "one",
    }
    assert "6 times" in (tmp_path / "README.md").read_text()
    moit.export("depth-peeling6(normalize=True)", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert [one["name"] for one in table["passes"]] == ["absorbance", "peeling", "under", "resolve"]
    assert [one["clear"] for one in table["targets"]] == [1, 0] and table["bytes_a_pixel"] == 28


def test_the_page_has_the_words_of_a_pixel_and_what_each_is_cleared_to(tmp_path):
    moit.export("mlab3", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    clears = [0, 0x3C000000] * 3 + [0xFFFFFFFF] * 2
    assert table["words"]["clear"] == clears and table["words"]["layers"] == 8
    assert table["bytes_a_pixel"] == 32 and table["bindings"] == {"words": 0}
    insert, resolve = table["passes"]
    assert insert["order"] == "triangles" and insert["targets"] == ["words"]
    assert resolve["reads"] == ["words"]
    page = (tmp_path / "README.md").read_text()
    assert (
        "## Words" in page and "| 6 to 7 | 0xffffffff |" in page and "one after the other" in page
    )
    moit.export("hybrid4", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert table["passes"][0]["targets"] == ["words", "target0", "target1"]
    assert [one["format"]["vulkan"] for one in table["targets"]] == [
        "R16G16B16A16_SFLOAT",
        "R16_SFLOAT",
    ]


@pytest.mark.parametrize("name", NAMES)
def test_what_a_technique_has_no_use_for_stays_at_home(name):
    text = include(name).text
    declared = re.findall(r"^\w+ (moit_\w+)\(", text, re.MULTILINE)
    entries = set(include(name).calls) | {"moit_resolved", "moit_loaded", "moit_store"}
    entries |= {"moit_fetched"} if include(name).side > 1 or include(name).programs else set()
    entries |= {"moit_mean"} if include(name).means else set()
    entries |= {"moit_fetched_second"} if include(name).second else set()
    assert not [one for one in declared if one not in entries and text.count(f"{one}(") < 2]
    assert "EXCLUDE_SELF" not in text
    assert "probe" not in declared


def test_comments_and_names_go_home():
    # a line of each in the text, all of it on the page
    original = texts.plain("engine/power4.glsl")
    sentence = next(line for line in original.splitlines() if line.startswith("// Four power"))
    for language in LANGUAGES:
        found = include("power4", language)
        assert sentence in found.text
        assert "// L D L^T of the matrix of central moments.\n" in found.text
        assert "A pivot not above `least` is rounding alone" not in found.text
        assert "A pivot not above `least`" in dict(found.notes)["moit_recurrence2_of"]


def test_what_has_no_room_in_an_include_of_250_lines_is_on_its_page():
    # of functions that an engine does not call; those that it calls keep their line
    tight, notes = include("trig3").text, dict(include("trig3").notes)
    assert "// How much of the outermost nodes on both sides" not in tight
    assert notes["moit_shares_of_ends"].startswith("How much of the outermost nodes on both sides")
    assert "// What pass 2 adds to the target of colours.\n" in tight
    # last, of what is handed on to no pass
    longest = include("strong5", "hlsl")
    assert (
        "orthogonal polynomials" not in longest.text and "struct moit_recurrence3 {" in longest.text
    )
    assert dict(longest.notes)["moit_recurrence3"].startswith("Of orthogonal polynomials")
    assert "// Added up, of what is not kept" in longest.text  # by the struct of targets
    circle = "// The cosine and sine of the angle from z = 0"  # of an inner function of both
    assert circle not in tight and circle in include("trig2").text


@pytest.mark.parametrize("name", NAMES)
def test_nothing_speaks_of_what_stays_at_home(name):
    found = include(name)
    comments = re.findall(r"//.*", found.text.partition("\n\n")[2])
    said = " ".join(
        [*comments, *(one for _, one in found.notes), *(o.about for o in found.options)]
    )
    assert ".glsl" not in said
    assert not re.findall(r"\b(?!MOIT_)[A-Z]+_[A-Z_]+\b", said)


@pytest.mark.parametrize("name", NAMES)
def test_every_option_has_a_meaning(name):
    for option in include(name).options:
        assert len(option.about) > 10, option.name


def test_the_head_says_what_it_is_and_whose():
    head = include("power4(bias=1e-6)", "hlsl").text.partition("\n\n")[0]
    assert 'moit export "power4(bias=1e-06)" --language hlsl' in head
    assert "--depth-range 0.1,1000\n" in head
    assert "--depth-range" not in include("weighted-average").text
    assert moit.__version__ in head and "BSD-3-Clause" in head and "Muenstermann" in head
    assert LICENCE == (ROOT / "LICENSE").read_text()


def test_options_are_defaults_that_an_engine_may_set():
    options = {one.name: one for one in include("power6(bias=2e-6,overestimation=0.5)").options}
    assert float(options["MOIT_BIAS"].value) == 2e-6
    assert float(options["MOIT_BETA"].value) == 0.5
    assert "bias" in options["MOIT_BIAS"].about
    assert options["MOIT_NOT_FUSED"].about.startswith("1 where fma")  # not all of its file's head
    text = include("power6(bias=2e-6)").text
    assert "#ifndef MOIT_BIAS\n#define MOIT_BIAS 2e-06 // How much" in text
    assert "override MOIT_BIAS: f32 = 2e-06;" in include("power6(bias=2e-6)", "wgsl").text


def test_the_range_of_depth_makes_two_constants():
    options = {one.name: float(one.value) for one in include("power4", "glsl", (0.5, 64)).options}
    z = np.log2([0.5, 64]) * options["MOIT_WARP_SCALE"] + options["MOIT_WARP_OFFSET"]
    np.testing.assert_allclose(z, [-1, 1], atol=1e-7)
    same = include("power4", "glsl", (0.5, 64)).digest == include("power4").digest
    assert same  # it computes the same, whatever a camera's planes are
    assert include("power4(bias=1e-6)").digest != include("power4").digest


def test_the_command_of_a_text_makes_the_same_text(tmp_path):
    wide = include("power4", "glsl", (0.123456789, 1234567.8))
    command = next(one for one in wide.text.splitlines() if "moit export" in one)
    near_far = command.split("--depth-range ")[1].split(",")
    assert include("power4", "glsl", tuple(map(float, near_far))).text == wide.text


@pytest.mark.parametrize(
    ("name", "language"),
    [(n, one) for one in LANGUAGES for n in ("wboit", "power4")]
    + [("adaptive4", one) for one in ("glsl", "hlsl", "metal")]
    + [("mlab2", "glsl"), ("hybrid4", "slang"), ("power4-16", "glsl")],
)
def test_the_page_names_nothing_that_the_text_has_not(name, language):
    technique = moit.technique(name)
    kit = include(name, language)
    page = page_of(technique, recipe_of(technique, (0.1, 1000.0)), kit)
    words = re.findall(r"\bmoit_\w+", page.replace(kit.name, ""), re.IGNORECASE)
    assert words and not set(words) - set(re.findall(r"\bmoit_\w+", kit.text, re.IGNORECASE))


@pytest.mark.parametrize("name", WARPED)
def test_depth_that_is_not_warped_fills_what_a_text_computes_with(name):
    technique = moit.technique(f"{name.removesuffix(')')}{',' if ')' in name else '('}warp='none')")
    options = {one.name: float(one.value) for one in include(technique).options}
    assert options["MOIT_WARP_LOG"] == 0
    z = np.array(technique.unit_range) * options["MOIT_WARP_SCALE"] + options["MOIT_WARP_OFFSET"]
    np.testing.assert_array_equal(z, [-1, 1])


def test_weights_of_a_network_of_ones_own_go_home():
    size = [(8, 8), (8, 8), (1, 8)]
    weights = [np.full(one, 0.125 * i, np.float32) for i, one in enumerate(size, 1)]
    network = moit.Network("neural-bounded", weights, [np.zeros(n, np.float32) for n in (8, 8, 1)])
    for language in ("glsl", "wgsl"):
        text = include(moit.BoundedNeural(network=network), language).text
        numbers = text[text.index("MOIT_NETWORK[153]" if language == "glsl" else "MOIT_NETWORK:") :]
        numbers = numbers.partition(";")[0]
        assert numbers.count("0.375") == 8 and numbers.count("0.25") == 64


@pytest.mark.parametrize("language", LANGUAGES)
def test_weights_too_many_for_constants_lie_in_a_file_beside(language, tmp_path):
    network = moit.Network.shipped("neural-image")
    files = moit.export(NEURAL, tmp_path, language)
    table = json.loads((tmp_path / "targets.json").read_text())
    (buffer,) = table["buffers"]
    assert buffer["elements"] == 201 and buffer["bytes"] == 201 * 16
    read = [one["name"] for one in table["passes"] if "MOIT_NETWORK" in one["reads"]]
    assert read == (["shading"] if language != "metal" else [])
    text = Path(files[1]).read_text()
    if language == "metal":  # where constants of a library are memory
        inside = text.partition("MOIT_NETWORK[201] = {")[2].partition("};")[0]
        rows = re.findall(r"float4\(([^)]*)\)", inside)
        found = np.array([row.split(",") for row in rows], np.float32)
        assert buffer["file"] == "" and len(files) == 3
    else:
        found = np.fromfile(tmp_path / buffer["file"], "<f4").reshape(-1, 4)
        assert "0.1511" not in text and buffer["file"] in (tmp_path / "README.md").read_text()
    # as the network itself has them: two outputs of the first layer, and all of the last
    packed = network.packed()
    first = packed[: 32 * 8].reshape(32, 8)
    np.testing.assert_array_equal(found[[8, 9, 10, 12], 1], first[5, [0, 1, 2, 3]])
    np.testing.assert_array_equal(found[59, 3], first[31, 7])
    np.testing.assert_array_equal(np.ravel(found[97:200:34]), packed[784:800])
    np.testing.assert_array_equal(found[200], [packed[800], 0, 0, 0])


def test_an_export_with_a_file_of_weights_is_replaced(tmp_path):
    moit.export(NEURAL, tmp_path)
    other = moit.Network.shipped("neural-image")
    weights = [other.weights[0] * 2, *other.weights[1:]]
    twice = moit.Network("neural-image", weights, other.biases, mean=other.mean, scale=other.scale)
    before = (tmp_path / "moit_neural_network.bin").read_bytes()
    moit.export(moit.NeuralMoments(twice, depth_range="image"), tmp_path)
    assert (tmp_path / "moit_neural_network.bin").read_bytes() != before
    assert "Not measured" in (tmp_path / "README.md").read_text()  # of these weights
    moit.export("power4", tmp_path)
    assert not (tmp_path / "moit_neural_network.bin").exists()


def test_every_text_for_engines_that_resolves_has_a_kit():
    used = {recipe_of(moit.technique(name), (0.1, 1000.0)).text for name in NAMES}
    # weighted sum where it is normalised
    used.add("engine/weighted_scaled.glsl")
    # a blend function, and what Fourier opacity has of one coefficient: no techniques of their own
    used |= {"engine/alpha_blend.glsl", "engine/absorbance.glsl"}
    # parts of others
    used |= {"engine/four_sums.glsl", "engine/six_moments.glsl", "engine/moment_words.glsl"}
    used |= {"engine/six_sums.glsl", "engine/multiplied_up.glsl", "engine/front.glsl"}
    used |= {"engine/let_through.glsl", "engine/block_means.glsl"}
    found = {one for one in texts._texts() if one.startswith("engine/")}
    resolving = {
        one for one in found if re.search(r"^vec4 resolve", texts.plain(one), re.MULTILINE)
    }
    assert resolving <= used


def test_conditions_on_options_stay_and_others_are_decided(tmp_path, monkeypatch):
    (tmp_path / "one.glsl").write_text(
        "// How.\n#ifndef HOW\n#define HOW 1\n#endif\n#ifndef SIZE\n#define SIZE 4\n#endif\n"
        "#if SIZE > 3 && !defined(NONE)\n"
        "float large() { return float(SIZE); }\n"
        "#else\nfloat small() { return 1.0; }\n#endif\n"
        "#if HOW\nfloat f() { return large(); }\n#else\nfloat f() { return 2.0; }\n#endif\n"
        "float resolve() { return f(); }\nfloat other() { return 3.0; }\n"
    )
    monkeypatch.setenv("MOIT_SHADER_DIR", str(tmp_path))
    items = needed_items("one.glsl", {"SIZE": 5}, ["resolve", "absent"], {})
    assert [item.names for item in items] == [("HOW",), ("large",), ("f",), ("resolve",)]
    assert "float(5)" in "".join(word.text for word in items[1].words)
    assert items[2].kind == "condition"


def test_a_folder_has_the_include_a_table_and_a_page(tmp_path):
    files = moit.export("power6", tmp_path / "kit", "wgsl", depth_range=(1, 100))
    assert [os.path.basename(one) for one in files] == [
        "README.md",
        "moit_power6.wgsl",
        "targets.json",
    ]
    assert sorted(os.listdir(tmp_path / "kit")) == [os.path.basename(one) for one in files]
    assert all(os.path.exists(one) for one in files)
    table = json.loads((tmp_path / "kit" / "targets.json").read_text())
    assert table["include"] == "moit_power6.wgsl" and table["technique"] == "power6"
    assert [one["name"] for one in table["passes"]] == ["absorbance", "shading", "resolve"]


@pytest.mark.parametrize("name", NAMES)
def test_the_table_is_what_the_technique_draws_to(name, tmp_path):
    moit.export(name, tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    technique = moit.technique(name)
    drawn = [one for one in technique.targets if one.blend != "ordered"]
    shipped = shipped_targets_of(technique)
    if shipped.second:  # moit's own passes draw to the first again
        drawn[-1 - (technique.block_side > 1) : -1 - (technique.block_side > 1)] = shipped.second
    own = technique.drawn_to()
    if own and shipped.held and not own.held:  # in words, as a pixel's own total of slices
        drawn = [*shipped.held, *shipped.shaded]
    # means are drawn once, and no target of the technique's
    given = [one for one in table["targets"] if not one["name"].startswith("mean")]
    for made, target in zip(given, drawn, strict=False):
        letters = re.sub(
            r"[\d_].*", "", made["format"]["vulkan"].replace("16", "").replace("32", "")
        )
        assert letters.lower().startswith(target.format.rstrip("0123456789f"))
        assert made["clear"] == target.clear
        if target.blend == "add":
            assert made["blend"] == {"operation": "add", "source": "one", "destination": "one"}
    geometry = [one for one in table["passes"] if "transparent" in one["draws"]]
    # of hybrid transparency the published way draws geometry twice; without atomics of 64 bits two
    # words of the nearest need two passes
    passes = technique.geometry_passes - (technique.kind == "hybrid") + (name == "front2")
    assert sum(one.get("rounds", 1) for one in geometry) == passes
    if technique.kind not in ("depth-peeling", "stochastic", "hashed-alpha"):
        assert all(one["depth"] == {"test": "less", "write": False} for one in geometry)
    names = [*(["words"] if "words" in table else []), *(one["name"] for one in table["targets"])]
    assert sorted(table["bindings"].values()) == list(range(len(names)))


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_page_says_what_an_engineer_asks(language, tmp_path, monkeypatch):
    said = {
        "digest": include("neural-bounded", language).digest,
        **{"device": "a CPU", "what": "transmittance", "fragments": 9},
        **{"most": 2e-5, "most_of_999": 1e-5},
    }
    held = {"neural-bounded": {language: said}}
    monkeypatch.setattr("moit.kit.measured._measured", lambda: held)
    moit.export("neural-bounded", tmp_path, language)
    page = (tmp_path / "README.md").read_text()
    for word in (
        "## Passes",
        "## Targets",
        "## Calls",
        "## Options",
        "## Bindings",
        "## Limits",
        "## Error",
    ):
        assert word in page
    assert "RGBA32" in page.replace("R32G32B32A32", "RGBA32")
    assert "no more than 1.0e-05 in 99.9 % of them" in page and LICENCE.strip() in page
    assert "float32-blendable" in page and "--depth-range 0.1,1000\n" in page
    assert "## How it works" in page and "`moit_mass2_at`: What is at z" in page
    assert LANGUAGES[language].remark in page


def test_the_page_tells_of_a_pass_for_factors_where_there_are_some(tmp_path):
    moit.export("power8", tmp_path)
    page = (tmp_path / "README.md").read_text()
    assert "## A pass for factors" in page and "factor2 = pixel.factor2;" in page
    factors = json.loads((tmp_path / "targets.json").read_text())["factors"]
    formats = [one["format"]["vulkan"] for one in factors]
    assert formats == ["R32G32B32A32_SFLOAT", "R32G32B32A32_SFLOAT", "R32G32_SFLOAT"]
    moit.export("fourier7", tmp_path)
    assert "A pass for factors" not in (tmp_path / "README.md").read_text()
    assert json.loads((tmp_path / "targets.json").read_text())["factors"] == []


def test_moments_in_words_have_factors_that_a_pass_makes_of_words(tmp_path):
    moit.export("power6-16(b0='float32')", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert table["words"]["layers"] == 4 and table["words"]["clear"] == [0] * 4
    assert [one["name"] for one in table["passes"]] == ["insert", "shading", "resolve"]
    assert table["passes"][1]["calls"] == ["moit_transmittance_of_words", "moit_shaded"]
    assert [one["name"] for one in table["factors"]] == ["factor0", "factor1"]
    page = (tmp_path / "README.md").read_text()
    part = page.partition("## A pass for factors")[2].partition("##")[0]
    assert "moit_factors pixel = moit_factor_of_words(moit_loaded(ivec2(gl_FragCoord.xy)));" in part
    assert "float through = moit_transmittance(pixel, moit_warped(depth), alpha);" in part


def test_words_of_moment_transparency_are_what_the_pass_for_factors_writes(tmp_path):
    for name in ("moment-transparency-nlqm", "moment-transparency(storage='unorm16')"):
        moit.export(name, tmp_path)
        table = json.loads((tmp_path / "targets.json").read_text())
        formats = [one["format"]["direct3d"] for one in table["factors"]]
        assert formats == ["R16G16B16A16_UNORM", "R16_FLOAT"]
        page = (tmp_path / "README.md").read_text()
        assert "factor0 (RGBA16), factor1 (R16F)" in page and "tier1" in page


def test_a_second_pass_of_moments_is_drawn_between_the_others(tmp_path):
    moit.export("two-moments-pass", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    first, second = [f"target{i}" for i in range(3)], ["target3", "target4"]
    passes = {one["name"]: one for one in table["passes"]}
    assert list(passes) == ["absorbance", "second absorbance", "shading", "resolve"]
    between = passes["second absorbance"]
    assert (between["reads"], between["targets"]) == (first, second)
    assert between["calls"] == ["moit_factor", "moit_accumulate_second"]
    shading = passes["shading"]
    assert (shading["reads"], shading["targets"]) == ([*first, *second], ["target5"])
    assert shading["calls"][:2] == ["moit_factor_second", "moit_transmittance"]
    assert table["bytes_a_pixel"] == moit.technique("two-moments-pass").bits_per_pixel / 8 + 12
    part = (tmp_path / "README.md").read_text().partition("## A pass for factors")[2]
    assert "moit_factor_second(moit_fetched(" in part and "`moit_factor`, which the pass" in part
    assert "`MOIT_BINDING_0` to `MOIT_BINDING_5`" in (tmp_path / "README.md").read_text()


def test_moments_of_blocks_have_targets_of_their_size(tmp_path):
    moit.export("two-moments-pass-lr8", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert [one.get("block_side", 1) for one in table["targets"]] == [8, 8, 8, 8, 1, 1]
    assert table["bytes_a_pixel"] == 40 / 64 + 8 + 4
    passes = {one["name"]: one for one in table["passes"]}
    assert list(passes)[:3] == ["farthest", "absorbance", "second absorbance"]
    assert passes["farthest"]["depth"]["write"] and not passes["farthest"]["targets"]
    assert passes["shading"]["targets"] == passes["resolve"]["reads"] == ["target4", "target5"]
    page = (tmp_path / "README.md").read_text()
    assert page.count("| 1/8 of width and height, rounded up |") == 4
    assert "farthest = max(farthest, texelFetch(opaque" in page and "12.625 bytes a pixel" in page
    between = page.partition("// second absorbance")[2].partition("// shading")[0]
    assert "moit_factor(moit_fetched_texel(" in between and "target5 = alpha;" in page


def test_the_page_gives_no_error_that_was_not_measured(tmp_path):
    moit.export("power4(bias=1e-5)", tmp_path)
    assert "Not measured" in (tmp_path / "README.md").read_text()


def test_the_page_has_the_costs_that_are_stored(tmp_path, monkeypatch):
    row = ["power4", "engine", "navi21", "factor", 154, 77, 24, 0]
    columns = "technique text family pass cycles instructions registers spilled".split()
    others = [["power4", "exact", *row[2:]], ["power6", *row[1:]]]
    rows = [dict(zip(columns, one, strict=True)) for one in (row, *others)]
    kept = Costs("22.3.6", "12.0.0", "0.1.0", {}, tuple(rows))
    monkeypatch.setattr("moit.kit.costs.stored", lambda: kept)
    moit.export("power4(bias=1e-6)", tmp_path / "kit")
    page = (tmp_path / "kit" / "README.md").read_text()
    assert page.count("| navi21 | factor | 154 | 77 | 24 |") == 1
    moit.export("wboit", tmp_path / "kit")
    assert "None is stored" in (tmp_path / "kit" / "README.md").read_text()


def test_what_a_web_device_has_to_be_asked_for_is_on_the_page(tmp_path):
    moit.export("power8", tmp_path, "wgsl")
    page = (tmp_path / "README.md").read_text()
    asked = "ask for maxColorAttachmentBytesPerSample: 40."  # two of four floats, and two
    assert "pass 1 writes 36, a pass for factors writes 40, and devices" in page and asked in page
    for name, language in (("power4", "wgsl"), ("power8", "glsl")):
        moit.export(name, tmp_path, language)
        assert "maxColorAttachment" not in (tmp_path / "README.md").read_text()


def test_arrays_of_a_picture_say_how_large_they_are_and_what_a_web_device_is_asked_for(tmp_path):
    words = 4 * 64 * 1920 * 1080
    for language, asked in (("wgsl", True), ("hlsl", False)):
        moit.export("slices64", tmp_path, language)
        page = (tmp_path / "README.md").read_text()
        assert f"| words | 64 * WIDTH * HEIGHT | {words / 1e6:.4g} | 0 |" in page
        limit = f"maxStorageBufferBindingSize: {words}, maxBufferSize: {words}."
        assert (limit in page) == asked
        assert "float32-blendable" in page  # as what is let through is a float
    moit.export("avboit", tmp_path, "wgsl")
    page = (tmp_path / "README.md").read_text()
    assert "maxStorage" not in page and "float32-blendable" not in page


def test_factors_have_formats_in_the_words_of_the_interface(tmp_path):
    said = {"glsl": "RGBA32F", "hlsl": "R32G32B32A32_FLOAT", "metal": "RGBA32Float"}
    for language, name in said.items():
        moit.export("power4", tmp_path, language)
        assert f"into factor0 ({name}), factor1" in (tmp_path / "README.md").read_text()


def test_a_parameter_is_not_taken_for_a_function_of_its_name():
    text = include("slices64", "wgsl").text  # which has both
    assert "fn moit_absorbance(alpha: f32)" in text and "(absorbance: f32, scale" in text


def test_the_page_says_what_a_frame_is_predicted_to_take(tmp_path):
    moit.export("moment-transparency-lr8", tmp_path)
    page = (tmp_path / "README.md").read_text()
    pixels = 1920 * 1080
    found = on_gpu("rx6800").frame(
        moit.technique("moment-transparency-lr8"), 9 * pixels // 2, pixels
    )
    assert f"| Radeon RX 6800 | {found.total:.2f} | {found.beyond:.2f} |" in page
    at_full = on_gpu("rx6800").frame(moit.technique("moment-transparency"), 9 * pixels // 2, pixels)
    assert found.milliseconds["capture"] < at_full.milliseconds["capture"] / 60  # of blocks
    assert found.total < at_full.total
