"""Texts for engines keep to the subset that goes into other languages, and compile as Vulkan's
GLSL; what such a compiler may do to `fma` has nothing to work on."""

import itertools
import re
import shutil
import subprocess

import pytest
from readings import engine

import moit
from moit.gpu import texts
from moit.kit import memory, recipes

NAMES = sorted(
    path.stem
    for path in engine.FOLDER.glob("*.glsl")
    if re.search("struct (sums|state)", path.read_text(encoding="utf-8"))
    and path.stem not in ("kept_layers", "moment_words")  # of which others are made
)
OPTIONS = [{}, {"NOT_FUSED": 1}, {"EXCLUDE_SELF": 1}]
# What a program declares for a text.
GIVEN = {"neural": "layout(std140, binding = 0) uniform weights { vec4 NETWORK[201]; };\n"}
TYPES = {"float", "int", "uint", "bool", "vec2", "vec3", "vec4", "uvec2", "void"}
# Of what has no defaults, options and arrays of words are those of a technique's kit.
OF_KITS = {"avboit": "avboit", "slices": "slices64", "anchors": "anchors4", "strong": "strong5"}
OF_KITS["neural_slices"] = "neural-slices8"

# What HLSL, WGSL, Metal, Slang or C++ keep for themselves.
RESERVED = set(
    "half sample samples filter input output active common buffer shared line linear point "
    "triangle centroid vector matrix texture sampler fragment vertex kernel constant device thread "
    "ref loop fn let var ptr array self mod move target final new this class export module import "
    "property from get set become box match of off on pass priv super trait type union virtual "
    "where with yield typedef template typename operator namespace register unsigned signed char "
    "short long "
    "double auto static inline extern volatile enum interface smooth flat patch resource require "
    "premerge regardless mut meta nil null public private protected precision near far and or not "
    "pair min16float string".split()
)

FUNCTION = re.compile(r"^(\w+) (\w+)\(([^)]*)\) \{", re.MULTILINE)


def without_comments(text: str) -> str:
    return re.sub(r"//.*", "", text)


def code_of(name: str) -> str:
    """Without what it reads of kernels, which the core's compilers look at."""
    lines, own = [], True
    for line in texts.source(engine.FOLDER / f"{name}.glsl").splitlines():
        if line.startswith("#line"):
            own = "kernels/" not in line and "dialect" not in line
        elif own:
            lines.append(line)
    return without_comments("\n".join(lines))


def given_to(name: str) -> str:
    """What a program declares for a text, options first."""
    if name not in OF_KITS:
        return GIVEN.get(name, "")
    recipe = recipes.recipe_of(moit.technique(OF_KITS[name]), (0.5, 2.5))
    options = [f"#define {key} {value}" for key, value in recipe.fixed.items()]
    calls, text = [call for one in recipe.memory for call in one.functions], engine.text_of(name)
    for call in calls:  # kits give what is theirs a prefix
        text = re.sub(rf"\b{call}\b", f"moit_{call}", text)
    arrays = memory.declared("glsl", recipe.memory, text, 0)
    for call in calls:
        arrays = arrays.replace(f"moit_{call}", call)
    networks = [
        f"const float {one}[{len(numbers)}] = float[](" + ", ".join(map(str, numbers)) + ");"
        for one, numbers in recipe.arrays.items()
    ]
    return "\n".join([*options, arrays, *networks, ""])


def parts_of_calls(text: str, function: str) -> list[str]:
    """What stands between the parentheses of each call."""
    found = []
    for match in re.finditer(rf"\b{function}\(", text):
        depth, at = 1, match.end()
        while depth:
            depth += {"(": 1, ")": -1}.get(text[at], 0)
            at += 1
        found.append(text[match.end() : at - 1])
    return found


def test_there_are_texts():
    assert {"power4", "power6", "power8", "trig3", "bounded", "weighted_blended"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_double_or_ends_when_data_say_so(name):
    code = code_of(name)
    assert not re.search(r"\bd?(double|dvec\d|float64_t)\b|\dlf\b", code)
    assert not re.search(r"\b(while|do|break|continue|discard|goto|switch)\b", code)
    loops = re.findall(r"for \((.*)\) \{|for \(([^)]*)\)", code)
    # which are known when compiling
    count = r"(\d+|[A-Z]+( [+/] \d)?|[A-Z]+ \+ [A-Z]+|int\([A-Z]+\))"
    up, down = rf"int (\w) = [012]; \1 < {count}; \+\+\1", r"int (\w) = [A-Z]+ - 1; \1 >= 0; --\1"
    for loop in (a or b.partition(") {")[0] for a, b in loops):
        assert re.fullmatch(up, loop) or re.fullmatch(down, loop), loop


@pytest.mark.parametrize("name", NAMES)
def test_a_text_keeps_to_what_other_languages_have(name):
    code = code_of(name)
    assert not re.search(r"\b(out|inout|uniform|layout|highp|mat\d)\b", code)
    functions = FUNCTION.findall(code)
    named = [function for _, function, _ in functions]
    distinct = {one for one in named if named.count(one) == 1}
    # what is there twice, under #if: one of pairs.glsl, and what words and floats differ in
    twice = {"left_of", "weight_of"}
    twice |= {"step_depth", "unpacked", "packed", "all_of", "inserted", "transmittance"}
    twice |= {"factor", "recurrence_packed", "transmittance_at", "resolve"}
    # of keys in one word and in two
    twice |= {"key_of", "word_of", "word_of_key", "absorbance_of_key", "is_kept"}
    # and in which slices of squares and of a picture, of runs and of single cells do
    twice |= {"square_of", "squares_of", "marks_of", "cells_of_trial", "ends_of", "slices_of"}
    twice |= {"read_at"}
    assert set(named) - distinct <= twice
    assert not re.search(r"\.[xyzwrgba]{2,} [-+*/]?= ", code)
    structs = re.findall(r"^struct (\w+) \{([^}]*)\};", code, re.MULTILINE)
    known = TYPES | {struct for struct, _ in structs}
    known |= {"pair", "whole_key"}  # which pairs.glsl and kept_keys.glsl have for types
    known |= set(re.findall(r"^STRUCT\((\w+)\)", engine.text_of(name), re.MULTILINE))
    words = {struct for struct, _ in structs} | set(named)
    for _, body in structs:
        for kind, member in re.findall(r"(\w+) (\w+);", body):
            assert kind in known
            words.add(member)
    for result, _, parameters in functions:
        assert result in known
        for one in filter(None, (part.strip() for part in parameters.split(","))):
            kind, parameter = one.split()
            assert kind in known
            words.add(parameter)
    words |= set(re.findall(rf"(?:\b(?:{'|'.join(known)})|,) (\w+) =", code))
    assert not words & RESERVED


@pytest.mark.parametrize("name", NAMES)
def test_parameters_are_not_assigned(name):
    code = code_of(name)
    places = [match.start() for match in FUNCTION.finditer(code)] + [len(code)]
    for start, end in itertools.pairwise(places):
        [(_, function, parameters), *_] = FUNCTION.findall(code[start:end])
        for one in filter(None, (part.strip() for part in parameters.split(","))):
            parameter = one.split()[1]
            written = re.search(rf"(?<![\w.]){parameter}(\.\w+)? [-+*/]?= ", code[start:end])
            assert not written, (function, parameter)


@pytest.mark.parametrize("name", NAMES)
def test_no_fma_takes_a_product_with_a_factor_in_common(name):
    # glslang does not say of fma that it is precise: a compiler may make fma(a, b, fma(a, c, d))
    # fma(a, b + c, d), and the low part is gone
    code = code_of(name)
    assert parts_of_calls(code, "fma") in ([], ["a, b, c"])  # that of `fused`
    taken = 0
    for function in re.split(r"^}", code, flags=re.MULTILINE):
        products = {}  # what a name holds, by the factors of its product
        for statement in re.split(r";|, (?=\w+ = )|\n", function.replace("float fused(", "")):
            for call in parts_of_calls(statement, "fused"):
                a, b, c = (one.strip().lstrip("-") for one in call.split(","))
                assert all(re.fullmatch(r"[\w.]+", one) for one in (a, b, c)), statement
                assert not {a, b} & products.get(c, set()), statement
                taken += 1
            made = re.search(r"(\w+) = (?:fused\(([^()]*)\)|([\w.]+) \* ([\w.]+))$", statement)
            if made:
                factors = made[2].split(",")[:2] if made[2] else [made[3], made[4]]
                products[made[1]] = {one.strip().lstrip("-") for one in factors}
    has_pairs = "vec2 pivot_of(" in code
    assert (taken > 3) == has_pairs


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("defines", OPTIONS, ids=lambda one: next(iter(one), "as it is"))
def test_glslang_takes_it_for_vulkan(name, defines, tmp_path):
    if not shutil.which("glslangValidator"):
        pytest.skip("glslangValidator is not installed")
    head = "".join(f"#define {key} {value}\n" for key, value in defines.items())
    path, made = tmp_path / "text.comp", tmp_path / "text.spv"
    head += given_to(name)
    path.write_text(f"#version 450\n{head}{engine.text_of(name)}\nvoid main() {{}}\n")
    # Half a minute: what is precise in structs takes glslang forever at times.
    check = subprocess.run(
        ["glslangValidator", "-V", path, "-o", made], capture_output=True, text=True, timeout=30
    )
    assert check.returncode == 0, check.stdout


def test_lines_are_at_most_100_long():
    for path in engine.FOLDER.iterdir():
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            assert len(line) <= 100 or line.startswith("|"), f"{path.name}:{number}"


def test_the_build_has_them():
    for name in NAMES:
        assert "struct s" in texts.source(f"engine/{name}.glsl")
