"""What shaders cost by a driver's compiler: what is asked of it and read off it, and what of that
comes with moit."""

import importlib.util
import json
from pathlib import Path

import pytest

import moit
from moit.__main__ import main
from moit.benching import cost_measuring
from moit.benching.cost_measuring import digests, measured, texts
from moit.benching.gpu_costs import costs_table, fragment_cycles
from moit.checks.exceptions import GpuError
from moit.gpu_costs import compiling, stored
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.compiling import compiled, cost_of, understood
from moit.gpu_costs.cost import FAMILIES, WAVE, Cost
from moit.gpu_costs.frames import BETWEEN, MEANS, TURNS, Frame, predicted
from moit.gpu_costs.probes import FUNCTIONS, given_bytes, probes
from moit.gpu_costs.published import published_texts
from moit.gpu_costs.stored import COMMAND, ENGINE, EXACT, PUBLISHED
from moit.kit.recipe import DEPTH_RANGE
from moit.kit.recipes import names_with_kits, recipe_of

TOLD = {
    "subgroup": 64,
    "Driver pipeline hash": 1,
    "SGPRs": 128,
    "VGPRs": 24,
    "Spilled VGPRs": 2,
    "Instructions": 108,
    "Inverse Throughput": 190,
}
LINES = '{"device": "Null hardware (RADV NAVI21)", "driver": "22.3.6"}\n' + json.dumps(TOLD) + "\n"
PLAIN = """#version 450
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Numbers { float numbers[]; };
void main() { numbers[gl_GlobalInvocationID.x] *= 2.0; }
"""


def compiler_or_skip():
    try:
        return compiled({"doubled": PLAIN}, "navi21")
    except GpuError as error:
        pytest.skip(f"no compiler here: {error}")


# What a driver says


def test_statistics_are_read_by_the_driver_s_names():
    assert cost_of(TOLD) == Cost(cycles=190, instructions=108, registers=24, spilled=2)


def test_statistics_that_are_missing_are_named():
    few = {name: value for name, value in TOLD.items() if name != "Inverse Throughput"}
    with pytest.raises(GpuError, match=r"power4: the driver tells .*needed are Inverse Through"):
        cost_of(few, "power4")


def test_waves_of_another_size_are_no_cost():
    with pytest.raises(GpuError, match="waves of 64, the driver compiled for 32"):
        cost_of({**TOLD, "subgroup": 32})


def test_what_the_process_printed_is_understood():
    assert understood(LINES, "", 0, ["power4"], "navi21") == ("22.3.6", {"power4": TOLD})


@pytest.mark.parametrize(
    ("output", "errors", "code", "words"),
    [
        ("", "radv: Unknown family: navi12x", -6, "family: .*'navi21': radv: Unknown family"),
        (LINES, "", -11, "trig3: the driver's compiler for navi21 ended with -11"),
        (LINES, "", 0, "trig3: the driver's compiler for navi21 ended with 0"),
        (LINES + json.dumps(TOLD), "", -11, "the end: .* ended with -11"),
        ('{"error": "libvulkan.so.1 cannot be loaded: no"}', "", 0, "libvulkan.*apt-get install"),
        (LINES + '{"error": "vkCreateShaderModule failed with -3"}', "", 0, "failed with -3"),
    ],
)
def test_a_process_that_failed_is_told(output, errors, code, words):
    with pytest.raises(GpuError, match=words):
        understood(output, errors, code, ["power4", "trig3"], "navi21")


def test_without_a_driver_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(compiling, "FOLDERS", (str(tmp_path),))
    with pytest.raises(GpuError, match="apt-get install mesa-vulkan-drivers libvulkan1 glslang"):
        compiling.driver_file()


def test_without_glslang_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(compiling.shutil, "which", lambda name: None)
    with pytest.raises(GpuError, match=r"glslangValidator is not there.*apt-get install"):
        compiled({"doubled": PLAIN}, "navi21")


def test_a_family_is_a_name():
    with pytest.raises(ValueError, match="family: expected a name"):
        compiled({"doubled": PLAIN}, "navi 21; rm")


@pytest.mark.parametrize(
    ("says", "told"),
    [
        ("echo 'x'; echo 'ERROR: 0:3: one'; echo 'ERROR: 0:4: two'", "ERROR: 0:3: one"),
        ("echo 'out of memory' >&2", "out of memory"),
        ("true", "it says nothing, and ended with 3"),
    ],
)
def test_what_a_compiler_says_is_told_or_how_it_ended(says, told, tmp_path, monkeypatch):
    fake = tmp_path / "glslangValidator"
    fake.write_text(f'#!/bin/sh\ntest "$1" = --version && exit 0\n{says}\nexit 3\n')
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    with pytest.raises(GpuError) as caught:
        compiled({"doubled": PLAIN}, "navi21")
    assert str(caught.value) == f"doubled: glslang refuses it: {told}"


# With the compiler


def test_a_text_that_is_no_glsl_is_named():
    compiler_or_skip()
    with pytest.raises(GpuError, match=r"doubled: glslang refuses it: .*undeclared"):
        compiled({"doubled": PLAIN.replace("*= 2.0", "*= two")}, "navi21")


def test_a_family_that_is_not_known_is_an_error():
    compiler_or_skip()
    with pytest.raises(GpuError, match=r"family: .*'navi99'.*Unknown family"):
        compiled({"doubled": PLAIN}, "navi99")


def test_more_work_costs_more():
    compiler_or_skip()
    roots = PLAIN.replace(
        "*= 2.0", "*= " + " + ".join(f"sqrt({i}.0 + numbers[{i}])" for i in range(60))
    )
    found = compiled({"doubled": PLAIN, "roots": roots}, "navi21").costs
    assert found["roots"].cycles > 4 * found["doubled"].cycles
    assert found["roots"].instructions > 60 > found["doubled"].instructions


def test_the_stored_costs_are_what_the_compiler_says():
    here = compiler_or_skip()
    kept = stored.stored()
    if (here.driver, here.glslang) != (kept.driver, kept.glslang):
        pytest.skip(f"stored by Mesa {kept.driver} and glslang {kept.glslang}")
    again = measured(texts(["power4"]), ["navi21"], progress=False)
    for text in (ENGINE, PUBLISHED):
        assert again.passes("power4", "navi21", text) == kept.passes("power4", "navi21", text)


# What comes with moit


@pytest.mark.parametrize("family", FAMILIES)
def test_costs_are_stored_of_everything_that_can_be_exported(family):
    kept = stored.stored()
    missing = [one for one in names_with_kits() if not kept.passes(one, family)]
    assert not missing, f"make them anew: {COMMAND}"


def test_stored_costs_are_of_the_texts_that_there_are():
    assert dict(stored.stored().digests) == digests(texts()), f"make them anew: {COMMAND}"


def test_the_page_has_the_costs_that_are_stored():
    path = Path(__file__).parents[1] / "docs" / "gpu_costs.py"
    spec = importlib.util.spec_from_file_location("gpu_costs_page", path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    text = made.PAGE.read_text(encoding="utf-8")
    assert made.page(text) == text, "make it anew: python docs/gpu_costs.py"


def test_every_stored_row_is_one_of_a_digest_and_ours_spill_no_register():
    kept = stored.stored()
    rows = {(row["text"], row["technique"], row["pass"], row["family"]) for row in kept.rows}
    assert rows == {(*key.split(" "), f) for key in kept.digests for f in kept.families}
    assert all(row["cycles"] > 0 and row["registers"] > 0 for row in kept.rows)
    assert not [row for row in kept.rows if row["spilled"] and row["text"] == ENGINE]


DEAREST = 1.3  # of what the published pass costs
# What is dearer all the same: layers are packed into half floats, of which the yardstick knows
# nothing, and Vega converts one number at a time.
DEARER = {("mlab2", "vega10"): 1.45}
YARDSTICKS = {name for name, _ in published_texts()}


def yardstick_of(name: str) -> str:
    """Of moments in words it is that of sums, of which shading is made."""
    return moit.technique(name).base_name.removesuffix("-16")


WITH_YARDSTICKS = [n for n in names_with_kits() if yardstick_of(n) in YARDSTICKS]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", WITH_YARDSTICKS)
def test_ours_are_not_dearer_than_the_published_passes(name, family):
    """Of pixels with 4.5 fragments, as MBOIT's teapots have."""
    kept = stored.stored()
    published = kept.passes(yardstick_of(name), family, PUBLISHED)
    ours = kept.passes(name, family)
    most = DEARER.get((name, family), DEAREST)
    assert fragment_cycles(ours, 4.5) <= most * fragment_cycles(published, 4.5)
    if not name.endswith("-16"):  # which pack words; else mostly waits for memory
        assert ours["accumulate"].cycles <= 2 * published["accumulate"].cycles


def test_exact_passes_are_dearer_by_orders():
    """What doubles cost, for which there are texts for engines."""
    kept = stored.stored()
    for name in set(kept.techniques(EXACT)) & set(kept.techniques(ENGINE)):
        for family in FAMILIES:
            exact, ours = kept.passes(name, family, EXACT), kept.passes(name, family)
            # trig2's two nodes are roots of a quadratic: 22 times on Vega, others 78 or more
            least = 20 if name == "trig2" else 50
            assert exact["factor"].cycles > least * ours["factor"].cycles, name


def test_comments_and_layout_do_not_make_stored_costs_old():
    one = {("engine", "power4", "factor"): "float x; // a\n\n  x  =\n 1.0;\n"}
    other = {("engine", "power4", "factor"): "// b\nfloat x; x = 1.0;"}
    assert digests(one) == digests(other)
    assert digests(one) != digests({("engine", "power4", "factor"): "float x;\nx = 1.5;"})
    defines = [{("engine", "power4", "factor"): f"#define A{end}B"} for end in (" ", "\n")]
    assert digests(defines[0]) != digests(defines[1])


def test_written_costs_are_read_back(tmp_path):
    path = tmp_path / "costs.json"
    stored.write(path, stored.stored())
    assert stored.read(path) == stored.stored()
    assert path.read_bytes() == stored.FILE.read_bytes()
    path.write_text('{"rows": 3}')
    with pytest.raises(ValueError, match=r"costs\.json: no costs as moit writes them"):
        stored.read(path)


def test_names_find_the_costs_that_are_nearest():
    kept = stored.stored()
    for name, text, of in (
        ("power4", ENGINE, "power4"),
        ("power4(exclude_self=True)", ENGINE, "power4"),
        ("power4-16", ENGINE, "power4-16"),
        ("wboit-eq9", ENGINE, "wboit"),
        ("mlab2", ENGINE, "mlab2"),
        ("neural", PUBLISHED, "neural"),
    ):
        assert kept.nearest(moit.technique(name), "navi21")[:2] == (text, of)
    assert kept.nearest(moit.technique("sorted"), "navi21") is None
    assert kept.nearest(moit.technique("power4"), "navi99") is None


@pytest.mark.parametrize(
    ("name", "like"),
    [
        ("neural-bounded(resolution=8)", "power4(resolution=4,total='full')"),
        ("trig3(resolution=2,total='full')", "power6(resolution=4,total='full')"),
        ("trig4(resolution=3)", "power8(resolution=4,total='full')"),
        ("wavelet16(resolution=8)", "wavelet16(resolution=4)"),
    ],
)
def test_means_of_blocks_cost_what_those_of_as_many_numbers_do(name, like):
    kept, card = stored.stored(), CARDS["rx6800"]
    technique, frame = moit.technique(name), Frame(9e6, 2e6)
    costs = kept.nearest(technique, card.family)[2]
    for one in (MEANS, BETWEEN):
        assert costs[one] == kept.passes(like, card.family)[one]
    without = {one: cost for one, cost in costs.items() if one != MEANS}
    found, less = (predicted(technique, one, card, frame) for one in (costs, without))
    made = found.milliseconds["capture"] - less.milliseconds["capture"]
    cycles = frame.pixels * costs[MEANS].cycles / TURNS / WAVE
    assert made == pytest.approx(1e3 * cycles / (card.units * card.clock * 1e9))
    plain = moit.technique(technique.base_name)
    assert MEANS not in kept.nearest(plain, card.family)[2]


# Shaders around what is exported


TEXT = """
struct moit_sums { vec4 target0; float target1; };
moit_sums moit_accumulate(vec3 color, float alpha, float depth) {
    return moit_sums(vec4(color, alpha), depth);
}
vec4 moit_resolve(vec4 shaded_sum, moit_sums t) { return shaded_sum * t.target1; }
"""


def test_each_function_gets_a_shader():
    found = probes(TEXT)
    assert list(found) == ["accumulate", "resolve"]
    call = "moit_accumulate(at_0_[gl_GlobalInvocationID.x].rgb, at_1_[gl_GlobalInvocationID.x], "
    assert call in found["accumulate"]
    assert "binding = 3) writeonly buffer buffer_3_ { moit_sums at_3_[]; };" in found["accumulate"]
    assert "binding = 1) readonly buffer buffer_1_ { moit_sums at_1_[]; };" in found["resolve"]


def test_a_uniform_buffer_is_bound_behind_all_storage_buffers():
    (text,) = probes(
        "#ifndef MOIT_NETWORK_BINDING\n#define MOIT_NETWORK_BINDING 1\n#endif\n"
        "layout(std140, binding = MOIT_NETWORK_BINDING) uniform all_of_it { vec4 n[2]; };\n"
        "vec4 moit_resolve(vec4 shaded_sum) { return shaded_sum * n[1]; }\n"
    ).values()
    assert text.splitlines()[1] == "#define MOIT_NETWORK_BINDING 61"


def test_bytes_of_what_passes_give_are_counted():
    assert given_bytes(TEXT, "accumulate") == 20 and given_bytes(TEXT, "resolve") == 16
    exported = cost_measuring.exported("power4")
    kept = stored.stored().passes("power4", "navi21")
    assert kept["factor"].bytes == given_bytes(exported, "factor") >= 20
    assert kept["transmittance"].bytes == 4


def test_arguments_that_no_fragment_has_are_refused():
    with pytest.raises(ValueError, match="moit_accumulate: no fragment and no pixel has float hue"):
        probes(TEXT.replace("float depth)", "float hue)"))


@pytest.mark.parametrize("name", names_with_kits())
def test_every_pass_of_an_export_is_compiled(name):
    found = probes(cost_measuring.exported(name))
    assert "accumulate" in found and "resolve" in found
    second = {"transmittance", "fused"} & set(found)
    technique = moit.technique(name)
    recipe = recipe_of(technique, DEPTH_RANGE)
    assert bool(second) == (recipe.passes > 1 and not recipe.shape)
    gathered = bool(recipe.by_factors) or not recipe.programs
    by_factors = recipe.state.has_factors if recipe.state else gathered
    assert ("factor" in found) == ("transmittance" in found and by_factors)
    assert set(found) <= set(FUNCTIONS)


def test_products_are_split_on_families_whose_fma_rounds_twice(monkeypatch):
    given = {}

    def told(named, family):
        given[family] = named
        cost = Cost(1, 1, 1, 0)
        return compiling.Compiled("d", "g", dict.fromkeys(named, cost))

    monkeypatch.setattr(cost_measuring, "compiled", told)
    measured(texts(["power4"]), ["navi21", "vega10"], progress=False)
    of_factor = {family: named["engine power4 factor"] for family, named in given.items()}
    split = "#version 450\n#define MOIT_NOT_FUSED 1\n"
    assert of_factor["vega10"] == of_factor["navi21"].replace("#version 450\n", split, 1)
    assert split not in of_factor["navi21"]
    kept = {family: stored.stored().passes("power4", family)["factor"] for family in given}
    assert kept["vega10"].instructions > 1.5 * kept["navi21"].instructions


# The command


@pytest.mark.parametrize("count", [0, -5])
def test_a_frame_has_fragments(count, capsys):
    assert main(["bench", "--gpu-cost", "--stored", "-t", "power4", "--fragments", str(count)]) == 1
    out, err = capsys.readouterr()
    assert not out and f"--fragments: expected at least 1, got {count}" in err


def test_the_command_tells_what_is_stored(capsys):
    main(["bench", "--gpu-cost", "--stored", "-t", "power4", "--card", "rx7900xtx"])
    said = capsys.readouterr().out
    kept = stored.stored().passes("power4", "gfx1100")
    assert costs_table(stored.stored().only(["power4"], ["gfx1100"]), "gfx1100") in said
    assert f"| `power4` | engine | {kept['accumulate'].cycles} |" in said
    assert "## Predicted: a frame on a Radeon RX 7900 XTX" in said and "not measured" in said
    assert "`trig3`" not in said


def test_the_command_writes_rows_and_pages(tmp_path, capsys):
    rows, page = tmp_path / "costs.json", tmp_path / "costs.md"
    for path in (rows, page):
        asked = ["bench", "--gpu-cost", "--stored", "-t", "power4", "--family", "navi21"]
        main([*asked, "-o", str(path)])
    found = stored.read(rows)
    assert found.families == ("navi21",) and found.techniques() == ("power4",)
    assert {row["pass"] for row in found.rows} >= {"accumulate", "transmittance"}
    assert page.read_text().startswith("# What shaders cost")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("bench --gpu-cost --gpu", "--gpu-cost: expected without --gpu"),
        ("bench --family navi21", "expected with --gpu-cost alone"),
        ("bench --gpu-cost --stored --family navi12", "nothing stored of these; there are navi21"),
        ("bench --gpu-cost -t sorted", "sorted has no kit: it needs a list"),
        ("bench --gpu-cost --stored --card rx9999", "--card: unknown 'rx9999'"),
    ],
)
def test_the_command_refuses(line, words, capsys):
    assert main(line.split()) == 1
    assert words in capsys.readouterr().err


def test_options_of_techniques_are_compiled_as_they_are_exported():
    given = texts(["power4(exclude_self=True)", "mlab2", "trig3"])
    own = {key for key in given if key[1] == "power4(exclude_self=True)"}
    assert {text for text, _, _ in own} == {ENGINE} and len(own) == 5
    assert {text for text, name, _ in given if name == "mlab2"} == {ENGINE, PUBLISHED}
    assert {text for text, name, _ in given if name == "trig3"} == {ENGINE, PUBLISHED, EXACT}
    plain = {(text, "power4", name) for text, _, name in own}
    assert plain <= set(texts(["power4"]))
    assert (
        given[ENGINE, "power4(exclude_self=True)", "transmittance"]
        != (texts(["power4"])[ENGINE, "power4", "transmittance"])
    )


# Cycles a wave on RDNA 2: of pixels with 4.5 fragments what the codes take that the papers' authors
# give away (power8: a little more, for what it is more exact), and of a pixel with a single one.
FLOORS = {"power4": 567, "power6": 1827, "power8": 2926, "trig3": 4347, "trig4": 7020}
SINGLE = {"power4": 250, "power6": 900}


def test_ours_take_no_more_than_the_codes_that_authors_give_away():
    for name, most in FLOORS.items():
        assert fragment_cycles(stored.stored().passes(name, "navi21"), 4.5) <= most, name
    for name, most in SINGLE.items():
        assert fragment_cycles(stored.stored().passes(name, "navi21"), 1) <= most, name


def test_the_bounded_network_takes_a_quarter_of_the_published_one():
    ours = stored.stored().passes("neural-bounded", "navi21")
    published = stored.stored().passes("neural", "navi21", PUBLISHED)
    assert ours["factor"].cycles <= 350
    assert ours["transmittance"].cycles <= published["transmittance"].cycles / 4


def test_a_frame_touches_no_more_pixels_than_it_has_fragments():
    assert Frame(10, 100).touched == 10 and Frame(1000, 100).touched == 100
    assert Frame(1000, 100, covered=7).touched == 7


def test_each_round_of_a_hybrid_captures_all_fragments(monkeypatch):
    hybrid = moit.technique("hybrid4")
    costs, frame = stored.stored().passes("hybrid4", "navi21"), Frame(1000, 100)
    twice = predicted(hybrid, costs, CARDS["rx580"], frame).milliseconds["capture"]
    monkeypatch.setattr(type(hybrid), "geometry_passes", 1)
    once = predicted(hybrid, costs, CARDS["rx580"], frame).milliseconds["capture"]
    assert twice == pytest.approx(2 * once)
