"""Kits whose passes change arrays by atomics: what an engine is told, and what the passes give."""

import json
import re
from functools import cache

import numpy as np
import pytest
from readings import kit_cases, kit_programs, kit_shaders, kits

import moit
from moit.gpu_costs.predicting import on_gpu

NAMES = ("avboit", "slices64", "slices32(resolution=4,total='full')")
VARIANTS = [
    "avboit(filter='cubic')",
    "avboit(low_resolution='average',bits=16,resolution=3,cells=512)",
    "slices20(table='tile',resolution=2)",
    "slices8(table='pixel',cells=64)",
]


@cache
def case() -> kit_cases.Case:
    return kit_cases.held_case(pixels=240)


@pytest.mark.parametrize("name", VARIANTS)
def test_options_are_those_of_the_technique(name):
    what, error = kit_cases.errors(moit.technique(name), "glsl", case())
    # a code or a light that floats round to the next step is a whole step off
    most = 1 / 255 if "bits=16" in name else 1e-4
    assert what == "transmittance" and np.quantile(error, 0.999) < most
    assert np.quantile(error, 0.99) < 1e-4


def test_slices_of_an_extent_are_the_core_s_where_words_are():
    technique = moit.technique("neural-slices5(bits=6,max_alpha=0.9,normalize=False)")
    _, error = kit_cases.errors(technique, "glsl", case())
    assert np.quantile(error, 0.9) < 1e-5 and np.quantile(error, 0.99) < 1e-3


@pytest.mark.parametrize("name", ["anchors4(key_bits=64)", "strong5(key_bits=64)"])
def test_keys_of_two_words_are_found_in_two_passes_and_tell_depths_apart(name, tmp_path):
    technique = moit.technique(name)
    _, error = kit_cases.errors(technique, "glsl", case())
    assert np.quantile(error, 0.99) < 1e-4 and np.quantile(error, 0.999) < 2e-3
    moit.export(technique, tmp_path, "wgsl")
    passes = json.loads((tmp_path / "targets.json").read_text())["passes"]
    assert [one["name"] for one in passes][:2] == ["keep", "know"]
    # pairs of surfaces in one word of 16 bits, the nearer one second
    depth = np.geomspace(0.2, 900, 200)
    both = np.column_stack([depth * 1.00001, depth])
    alpha = np.tile([0.5, 0.8], (len(depth), 1))
    found, _ = kit_programs.through(technique, "glsl", pixels_of(both, alpha))
    apart = np.abs(found.reshape(-1, 2) - [0.2, 1]).max(1) < 2e-3  # roots have 10 bits
    assert apart.mean() > 0.9
    plain = moit.technique(name.partition("(")[0])
    found, _ = kit_programs.through(plain, "glsl", pixels_of(both, alpha))
    assert (np.abs(found.reshape(-1, 2) - [0.2, 1]).max(1) < 2e-3).mean() < 0.5


def test_totals_of_half_floats_scale_what_blocks_have():
    # which blending rounds, here once
    technique = moit.technique("slices24(table='pixel',resolution=4,total='half')")
    _, error = kit_cases.errors(technique, "glsl", case())
    assert np.quantile(error, 0.999) < 3e-3


@pytest.mark.parametrize(
    "name", ["avboit", "slices32", "anchors3(cells=5,gamma=1.0)", "neural-slices5(bits=6)"]
)
def test_nothing_hangs_on_the_order_of_fragments(name):
    technique, c = moit.technique(name), case()
    found, picture = kit_programs.through(technique, "glsl", c)
    turned = kit_cases.turned(c)
    again, _ = kit_programs.through(technique, "glsl", turned)
    order = kit_cases.order_of_turned(c)[: picture.fragments_there]
    np.testing.assert_array_equal(again, found[order])


@pytest.mark.parametrize("name", ["anchors3(cells=5,gamma=1.0)", "anchors1(cells=1)"])
def test_anchors_keep_and_count_what_the_core_does(name):
    _, error = kit_cases.errors(moit.technique(name), "glsl", case())
    # logarithms in floats may rank two fragments otherwise, and round steps of cells otherwise
    assert np.quantile(error, 0.99) < 1e-4 and np.quantile(error, 0.999) < 0.02


def test_what_is_kept_and_what_is_left_are_as_the_core_has_them():
    technique = moit.technique("strong2(gamma=1.0,normalize=False)")
    _, error = kit_cases.errors(technique, "glsl", case())
    # of half floats, in a pixel's own extent, of which a float of depth is more
    assert np.quantile(error, 0.999) < 3e-3 and np.quantile(error, 0.9) < 1e-4


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("front2", 5e-6),
        ("front3(key_bits=32,tail='power6')", 1e-4),
        ("front1(tail='trig2(exclude_self=True)')", 4e-4),
        ("front2(tail='power8',normalize=False)", 1e-4),
    ],
)
def test_what_is_left_of_moments_is_as_the_core_has_it_where_it_is_sound(name, most):
    technique = moit.technique(name)
    _, error = kit_cases.errors(technique, "glsl", case())
    assert len(error) > 200 and np.quantile(error, 0.999) < most
    # elsewhere rounding of what targets hold decides
    anywhere = kit_cases.gathered_errors(technique, "glsl", case(), everywhere=True)
    assert np.quantile(anywhere, 0.999) < 1e-2 and np.quantile(anywhere, 0.9) < 1e-4


@pytest.mark.parametrize(("name", "most"), [("front5", 1e-6), ("front5(key_bits=32)", 1e-3)])
def test_few_fragments_are_exact_and_those_of_one_depth_cover_what_they_do(name, most):
    # four of which two coincide, and one behind that is of no other depth
    random = np.random.default_rng(3)
    depth = np.exp(random.uniform(np.log(0.2), np.log(500), (40, 5)))
    depth[:, 1] = depth[:, 0]
    alpha = random.uniform(0.05, 0.9, depth.shape)
    alpha[:, 1] = alpha[:, 0]
    c = pixels_of(depth, alpha)
    found, _ = kit_programs.through(moit.technique(name), "glsl", c)
    exact = moit.transmittance(c.fragments(), "sorted").reshape(depth.shape)
    found = found.reshape(depth.shape)
    assert np.abs(found - exact)[:, 2:].max() < most
    both = exact[:, :2].mean(axis=1)
    assert np.abs(found[:, :2] - both[:, None]).max() < most


def pixels_of(depth: np.ndarray, alpha: np.ndarray) -> kit_cases.Case:
    """A case of pixels with as many fragments each, (P, k)."""
    pixels, each = depth.shape
    return kit_cases.Case(
        depth.ravel().astype(np.float32),
        alpha.ravel().astype(np.float32),
        np.ones((depth.size, 3), np.float32),
        np.arange(pixels + 1) * each,
        np.repeat(np.arange(pixels), each),
    )


def test_fragments_of_one_key_are_counted_once():
    # six coincident ones, of which four are kept and two are in a cell, and a faint one behind
    depth = np.repeat(np.geomspace(0.2, 400, 40)[:, None], 7, axis=1)
    depth[:, 6] *= 1.5
    alpha = np.full_like(depth, 0.4)
    alpha[:, 6] = 0.1
    _, error = kit_cases.errors(moit.technique("anchors4"), "glsl", pixels_of(depth, alpha))
    assert error.max() < 2e-3


def test_as_many_cells_are_joined_as_the_core_joins():
    # few slices, so that many are: powers of two, and the eighths between them
    random = np.random.default_rng(8)
    depth = np.exp(random.uniform(np.log(0.15), np.log(900), (80, 9)))
    alpha = random.uniform(0.05, 0.5, depth.shape)
    for slots in (5, 24):
        _, error = kit_cases.errors(
            moit.technique(f"slices{slots}"), "glsl", pixels_of(depth, alpha)
        )
        assert np.quantile(error, 0.99) < 1e-5, slots


@pytest.mark.parametrize("name", NAMES)
def test_the_table_says_what_each_pass_reads_and_changes(name, tmp_path):
    moit.export(name, tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert {one["name"]: one["clear"] for one in table["memory"]} == {
        "marks": 0,
        "places": None,
        "words": 0,
    }
    passes = {one["name"]: one for one in table["passes"]}
    order = [one for one in passes if one != "farthest"]
    assert order == ["mark", "count", "place", "deposit", "integrate", "shading", "resolve"]
    assert ("farthest" in passes) == (name == "avboit")
    assert passes["mark"]["targets"] == ["marks"] and passes["count"]["reads"] == ["marks"]
    assert passes["place"]["targets"] == ["places"]
    assert "words" in passes["deposit"]["targets"] and "words" not in passes["deposit"]["reads"]
    assert passes["integrate"]["reads"] == passes["integrate"]["targets"] == ["words"]
    assert set(passes["shading"]["reads"]) >= {"places", "words"}
    assert not set(passes["shading"]["targets"]) & {"marks", "places", "words"}
    own = name.endswith("'full')")
    assert ("target0" in passes["deposit"]["targets"]) == own
    assert ("target0" in passes["shading"]["reads"]) == own
    bound = [*table["bindings"].values(), *(one["binding"] for one in table["memory"])]
    assert sorted(bound) == list(range(len(bound)))
    page = (tmp_path / "README.md").read_text()
    assert "early_fragment_tests" in page and "MOIT_BINDING_MARKS" in page


def test_slices_of_an_extent_need_ends_before_and_sums_after(tmp_path):
    moit.export("neural-slices5(bits=6)", tmp_path)
    table = json.loads((tmp_path / "targets.json").read_text())
    assert [(one["name"], one["clear"]) for one in table["memory"]] == [("words", 0)]
    assert table["memory"][0]["elements"] == "7 * WIDTH * HEIGHT"
    assert table["bytes_a_pixel"] == 4 * 7 + 8 + 4
    passes = {one["name"]: one for one in table["passes"]}
    assert list(passes) == ["extend", "deposit", "integrate", "shading", "resolve"]
    assert passes["extend"]["targets"] == ["words"] and not passes["extend"]["reads"]
    assert passes["deposit"]["reads"] == passes["deposit"]["targets"] == ["words"]
    assert passes["shading"]["reads"] == ["words"]
    options = {one["name"]: float(one["value"]) for one in table["options"]}
    assert options["MOIT_SLOTS"] == 5 and options["MOIT_CODE_MOST"] == 63
    assert options["MOIT_CODE_SCALE"] == pytest.approx(63 / (6 * np.log(2)))


def test_bytes_a_pixel_are_of_words_as_they_are_added(tmp_path):
    for name, size in (
        ("avboit", 4 * 128 / 64 + 8 + 1),
        ("slices64", 4 * 64 + 8 + 4),
        ("slices32(resolution=4,total='full')", 4 * 32 / 16 + 4 + 8),
    ):
        moit.export(name, tmp_path)
        assert json.loads((tmp_path / "targets.json").read_text())["bytes_a_pixel"] == size


def test_web_shaders_look_at_depth_themselves(tmp_path):
    moit.export("avboit", tmp_path, "wgsl")
    page = (tmp_path / "README.md").read_text()
    calls = page.partition("## Calls")[2].partition("##")[0]
    assert calls.count("if (position.z >= textureLoad(opaque,") == 2  # as it marks and as it adds
    assert "early_fragment_tests" not in page


def test_metal_hands_arrays_on():
    kit = kits.include(moit.technique("slices64"), "metal")
    assert not re.search(r"\bmoit_\w+_(marks|places|words)\(", kit.text)
    assert "moit_load(mem.places, " in kit.text and "moit_add(mem.words, " in kit.text
    for name in ("mark", "count", "deposit", "integrate", "shading"):
        assert "(mem, " in kit_shaders.shaders(kit)[name].partition("void shader")[2]


@pytest.mark.parametrize("name", (*NAMES, "anchors4", "neural-slices5(bits=6)"))
def test_a_frame_is_predicted(name):
    pixels = 1920 * 1080
    technique = moit.technique(name)
    found = on_gpu("rx6800").frame(technique, 9 * pixels // 2, pixels)
    summed = set() if name == "anchors4" else {"factors"}
    assert set(found.milliseconds) == {"capture", "shade", "resolve"} | summed
    assert all(one > 0 for one in found.milliseconds.values())


def test_a_frame_of_blocks_costs_less_to_sum_up():
    pixels = 1920 * 1080
    full, blocks = (
        on_gpu("rx6800").frame(moit.technique(name), 9 * pixels // 2, pixels).milliseconds
        for name in ("slices32", "slices32(resolution=4)")
    )
    assert 8 * blocks["factors"] < full["factors"]
    small = on_gpu("rx6800").frame(moit.technique("avboit"), 9 * pixels // 2, pixels)
    assert 20 * small.milliseconds["capture"] < full["capture"]  # drawn at an eighth of the size
    # nothing is known of what bounds of moments cost beside
    assert on_gpu("rx6800").frame(moit.technique("slices32(inside='power4')"), 9, 9) is None
