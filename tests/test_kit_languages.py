"""How texts of kits are written: words and layout of each language, and what is refused."""

import re

import pytest

from moit.gpu import texts
from moit.kit.fourier_text import fourier_text
from moit.kit.languages import HLSL, METAL, Context
from moit.kit.layout import first_sentence, laid_out
from moit.kit.tokens import SubsetError, items_of
from moit.kit.wgsl import WGSL


def spelled(text: str, language) -> str:
    """One declaration in another language."""
    items = items_of(text, "")
    structs = {item.names[0]: item for item in items if item.kind == "struct"}
    return language.item(items[-1], Context(structs, (), {}))


def test_wgsl_turns_declarations_round():
    text = """float f(float x, int n) {
    float sum = 0.0, most;
    for (int i = 0; i < n; ++i) sum += x;
    if (x < 0.0) x = -x; else most = 1.0;
    most = x > 1.0 ? x > 2.0 ? sum : 3.0 : most;
    return most;
}
"""
    assert (
        spelled(text, WGSL)
        == """fn f(x_given: f32, n: i32) -> f32 {
    var x = x_given;
    var sum = 0.0; var most: f32;
    for (var i = 0; i < n; i++) { sum += x; }
    if (x < 0.0) { x = -x; } else { most = 1.0; }
    most = select(most, select(3.0, sum, x > 2.0), x > 1.0);
    return most;
}"""
    )


def test_wgsl_keeps_what_is_precise():
    text = """float f(float x) {
    precise float a = x + 1.0; // rounded
    a = a - 1.0;
    float b[2];
    b[0] = floatBitsToUint(a) > 3 ? inversesqrt(x) : x;
    return b[0];
}
"""
    assert (
        spelled(text, WGSL)
        == """fn f(x: f32) -> f32 {
    var a = moit_kept(x + 1.0); // rounded
    a = moit_kept(a - 1.0);
    var b: array<f32, 2>;
    b[0] = select(x, inverseSqrt(x), bitcast<u32>(a) > 3);
    return b[0];
}"""
    )


def test_languages_like_c_spell_vectors_and_structs():
    text = (
        "struct two { vec2 a; float b; };\n"
        "two f(vec3 x) { return two(vec2(x.x), mix(x.y, 1.0, fma(x.z, 2.0, 1.0))); }\n"
    )
    assert spelled(text, HLSL) == (
        "two f(float3 x) { return two_made(((float2)(x.x)), lerp(x.y, 1.0, mad(x.z, 2.0, 1.0))); }"
    )
    assert spelled(text, METAL) == (
        "inline two f(float3 x) { return two{float2(x.x), mix(x.y, 1.0, fma(x.z, 2.0, 1.0))}; }"
    )


def test_short_statements_and_functions_share_lines():
    text = """// Twice.
float twice(float x) {
    float y = x;
    return y + y;
}

pair f(float x, int n) {
    float sum = 0.0; // so far
    // all of them
    for (int i = 0; i < n; ++i) {
        sum += x;
    }
    if (x < 0.0) x = -x; else sum = 1.0;
    pair o;
    o.h = sum;
    o.l = x;
    return o;
}
"""
    loose = """// Twice.
float twice(float x) { float y = x; return y + y; }
pair f(float x, int n) {
    float sum = 0.0; // so far
    // all of them
    for (int i = 0; i < n; ++i) { sum += x; }
    if (x < 0.0) x = -x;
    else sum = 1.0;
    pair o; o.h = sum; o.l = x; return o;
}"""
    assert "\n".join(laid_out(text)) == loose
    assert "\n".join(laid_out(text, 2)) == loose[:-2] + " }"
    for tight in range(3):
        assert "".join("".join(laid_out(text, tight)).split()) == "".join(text.split())


def test_what_one_word_of_type_declares_goes_on_with_it_on_the_next_line():
    text = """float f(float x) {
    float first = x + 1.0, second = first * first;
    precise float kept = second - first;
    float third = second * second + first, fourth = third * third + second * first + kept;
    return fourth;
}
"""
    assert (
        "\n".join(laid_out(text, 3))
        == """float f(float x) {
    float first = x + 1.0, second = first * first; precise float kept = second - first;
    float third = second * second + first, fourth = third * third + second * first + kept;
    return fourth; }"""
    )
    wide = text.replace("third = second", "third_of_all = second * second * second")
    assert (
        "\n".join(laid_out(wide, 3)).splitlines()[2:4]
        == """\
    float third_of_all = second * second * second * second + first;
    float fourth = third * third + second * first + kept; return fourth; }""".splitlines()
    )


@pytest.mark.parametrize("count", [7, 15])
def test_the_series_that_is_made_is_that_of_the_shipped_texts(count):
    def code(text):  # a list of declarations is the same as two
        return "".join(re.sub(r"//.*", "", text).split()).replace(";vec2p", ",p")

    assert code(fourier_text(count)) == code(texts.plain(f"engine/fourier{count}.glsl"))


def test_a_member_of_a_long_struct_stays_in_one_line():
    members = " ".join(f"vec4 target{i};" for i in range(12))
    lines = laid_out(f"struct sums {{ {members} }};\n")
    assert len(lines) > 2 and all(len(one) <= 100 for one in lines)
    assert all(one.endswith(";") for one in lines[1:])


def test_long_statements_break_where_the_fewest_brackets_are_open():
    long = "float f() { x = first(one, " + ", ".join(f"g(a, {i})" for i in range(12)) + ") * b; }"
    made = laid_out(long)
    assert max(len(line) for line in made) <= 100
    assert made[1].endswith(" g(a, 8),") and made[2] == "        g(a, 9), g(a, 10), g(a, 11)) * b;"


def test_a_comment_is_its_first_sentence_or_clause():
    assert first_sentence("One, e.g. two. Three.") == "One, e.g. two."
    assert first_sentence("What is wanted, in words; and more of it.", 30) == (
        "What is wanted, in words."
    )
    assert first_sentence("Twice 2 / (far - near), always.", 28) == (
        "Twice 2 / (far - near), always."
    )


def test_what_is_not_in_the_subset_is_refused():
    with pytest.raises(SubsetError, match="needed GLSL's subset"):
        items_of("float f() { return 1.0 @ 2.0; }\n", "")
    with pytest.raises(SubsetError, match="without a body"):
        items_of("float f(float x);\n", "")
