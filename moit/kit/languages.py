"""The languages of shaders that are like C: which words the subset has in each."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping

from moit.kit.memory import with_memory
from moit.kit.tokens import (
    TYPES,
    Item,
    Word,
    closing,
    following,
    is_sign,
    members_of,
    preceding,
    split,
    stripped,
    text_of,
    words_of,
)


@dataclasses.dataclass(frozen=True)
class Context:
    """What surrounds a declaration.

    structs : all of the text, by name.
    keeping : functions that an engine calls, as far as something precise is in them.
    begins : of structs what no pixel has below 0, {0} standing for one.
    touching : functions that read or change arrays which all fragments share (moit.kit.memory).
    """

    structs: Mapping[str, Item]
    keeping: Collection[str]
    begins: Mapping[str, str]
    touching: Collection[str] = ()


@dataclasses.dataclass(frozen=True)
class Language:
    """How one language spells the subset.

    ending : of its files.
    words : what becomes of types and functions.
    constant : what stands before constants of a text.
    function : what stands before functions.
    start : what its texts begin with.
    constructs : whether it has an expression for a struct made of its members.
    fused : whether fma rounds once for sure; None: an option, NOT_FUSED, decides.
    remark : what an engineer has to know of any text.
    digits : of texts that keep more digits than a float has, and what holds.
    keeps_digits : a word that such texts have.
    provided : functions of GLSL that the language lacks, by what declares them there.
    """

    name: str
    ending: str
    words: Mapping[str, str]
    constant: str
    fused: bool | None
    remark: str
    digits: str = ""
    keeps_digits: str = "precise"
    function: str = ""
    constructs: bool = False
    start: str = ""
    provided: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def lacking(self, text: str) -> str:
        """Declares what a text in this language calls and the language lacks."""
        return "\n".join(how for name, how in self.provided.items() if f"{name}(" in text)

    def option(self, name: str, value: str) -> str:
        """An option with its default."""
        return f"#ifndef {name}\n#define {name} {value}\n#endif"

    def item(self, item: Item, context: Context) -> str:
        """One declaration of the subset."""
        words = [Word(word.kind, word.text) for word in item.words]
        if not self.words:
            return text_of(words)
        text = text_of(_spelled(self, words, item, context.structs))
        if self.name == "metal" and context.touching and item.kind == "function":
            return with_memory(text, context.touching, item.names[0])
        return text

    def head(self, item: Item, context: Context) -> str:
        """A function's, in one line."""
        text = self.item(item, context)[len(text_of(item.words[: item.start])) :]
        return " ".join(text[: text.index("{")].split())

    def makes_structs(self, items: list[Item], struct: Item) -> bool:
        """Whether a text makes this struct of its members, and the language has no word for it."""
        if not self.words or self.constructs:
            return False
        name = struct.names[0]
        return any(
            word.text == name and is_sign(item.words, following(item.words, at), "(")
            for item in items
            for at, word in enumerate(item.words)
            if word.kind == "name"
        )

    def maker(self, item: Item) -> str:
        """What makes a struct of its members, where the language has no such expression."""
        members = members_of(item)
        listed = ", ".join(f"{self.words.get(one.type, one.type)} {one.name}" for one in members)
        name = item.names[0]
        sets = "".join(f"    o.{one.name} = {one.name};\n" for one in members)
        return f"{name} {made(name)}({listed}) {{\n    {name} o;\n{sets}    return o;\n}}"


def made(name: str) -> str:
    return f"{name}_made"


def _spelled(
    language: Language, words: list[Word], item: Item, structs: Mapping[str, Item]
) -> list[Word]:
    found: list[Word] = []
    at = 0
    if language.function and item.kind == "function":
        found = words[: item.start]
        found.append(Word("name", language.function))
        at = item.start
    if item.kind == "constant":
        found = words[: item.start]
        at = item.start
        while words[at].text in ("const", "precise") or not words[at].counts:
            at += 1
        found.append(Word("name", language.constant + " "))
    while at < len(words):
        word = words[at]
        after = following(words, at)
        if word.kind != "name":
            found.append(word)
        elif word.text in TYPES and is_sign(words, after, "["):
            # an array made of its members: float[3](...), of which braces are left
            opens = following(words, closing(words, after))
            end = closing(words, opens)
            inside = _spelled(language, words[opens + 1 : end], _NONE, structs)
            found += [Word("sign", "{"), *inside, Word("sign", "}")]
            at = end
        elif word.text in structs and is_sign(words, after, "(") and _is_use(words, at):
            if language.name == "metal":
                end = closing(words, after)
                inside = _spelled(language, words[after + 1 : end], _NONE, structs)
                found += [word, Word("sign", "{"), *inside, Word("sign", "}")]
                at = end
            else:
                found.append(Word("name", made(word.text)))
        elif language.name != "metal" and _is_splat(word, words, after):
            end = closing(words, after)
            inside = _spelled(language, words[after + 1 : end], _NONE, structs)
            spelled = language.words.get(word.text, word.text)
            found += [*words_of(f"(({spelled})("), *inside, *words_of("))")]
            at = end
        elif word.text == "precise" and "precise" in language.words:
            if words[at + 1].kind == "space":
                at += 1
        elif word.text == "atan" and is_sign(words, after, "("):
            two = len(split(words[after + 1 : closing(words, after)])) == 2
            found.append(Word("name", "atan2" if two else "atan"))
        else:
            is_member = is_sign(words, preceding(words, at), ".")
            text = word.text if is_member else language.words.get(word.text, word.text)
            found.append(Word("name", text))
        at += 1
    return found


_NONE = Item("", (), [], 0, "")


def _is_use(words: list[Word], at: int) -> bool:
    """Whether a struct's name before a bracket makes one: nothing else in the subset can be."""
    return words[preceding(words, at)].text != "struct" if preceding(words, at) >= 0 else True


def _is_splat(word: Word, words: list[Word], after: int) -> bool:
    """Whether all members of a vector are made of one expression."""
    if "vec" not in word.text or word.text not in TYPES or not is_sign(words, after, "("):
        return False
    return len(split(stripped(words[after + 1 : closing(words, after)]))) == 1


def _vectors(float_: str, int_: str, uint: str, bool_: str) -> dict[str, str]:
    kinds = {"": float_, "i": int_, "u": uint, "b": bool_}
    return {
        f"{kind}vec{size}": f"{name}{size}" for kind, name in kinds.items() for size in (2, 3, 4)
    }


_HALVES = {"packHalf2x16": "moit_packHalf2x16", "unpackHalf2x16": "moit_unpackHalf2x16"}
_HLSL = {
    **_vectors("float", "int", "uint", "bool"),
    **_HALVES,
    "fma": "mad",
    "mix": "lerp",
    "fract": "frac",
    "inversesqrt": "rsqrt",
    "floatBitsToUint": "asuint",
    "floatBitsToInt": "asint",
    "bitCount": "countbits",
    "uintBitsToFloat": "asfloat",
    "intBitsToFloat": "asfloat",
}
_HLSL_HALVES = {
    "moit_packHalf2x16": "uint moit_packHalf2x16(float2 v) { return f32tof16(v.x) | (f32tof16(v.y) "
    "<< 16u); }",
    "moit_unpackHalf2x16": "float2 moit_unpackHalf2x16(uint w) { return float2(f16tof32(w), "
    "f16tof32(w >> 16u)); }",
}
_METAL_HALVES = {
    "moit_packHalf2x16": "inline uint moit_packHalf2x16(float2 v) "
    "{ return as_type<uint>(half2(v)); }",
    "moit_unpackHalf2x16": "inline float2 moit_unpackHalf2x16(uint w) "
    "{ return float2(as_type<half2>(w)); }",
}
_METAL = {
    **_vectors("float", "int", "uint", "bool"),
    **_HALVES,
    "inversesqrt": "rsqrt",
    "floatBitsToUint": "as_type<uint>",
    "floatBitsToInt": "as_type<int>",
    "bitCount": "popcount",
    "uintBitsToFloat": "as_type<float>",
    "intBitsToFloat": "as_type<float>",
    "precise": "",
}

GLSL = Language(
    "glsl",
    "glsl",
    {},
    "const",
    None,
    "GLSL 4.2 and up (`precise`, `fma`, `layout(binding)`).",
    "`precise` keeps sums as they are written. `fma` may round twice, as llvmpipe's does: set "
    "MOIT_NOT_FUSED to 1 there, and where you have not asked. To ask, look once whether "
    "fma(x, x, -x * x) is 0 for x = 1.000244140625 from a buffer: 0 means that it rounds twice.",
    "NOT_FUSED",
)
HLSL = Language(
    "hlsl",
    "hlsl",
    _HLSL,
    "static const",
    False,
    "Shader model 5 and up.",
    "`precise` keeps sums as they are written; `mad` may round twice, so "
    "exact products are split into halves, which holds on every device.",
    provided=_HLSL_HALVES,
)
METAL = Language(
    "metal",
    "metal",
    _METAL,
    "constant",
    True,
    "`fma` rounds once. Metal's fast math, which is on unless you say otherwise, drops digits that "
    "pairs of floats keep: the text asks for the safe mode by a pragma, which Metal 3.2 knows; "
    "before, compile with -fno-fast-math (MTLCompileOptions.fastMathEnabled = NO).",
    function="inline ",
    constructs=True,
    provided=_METAL_HALVES,
    start="""\
#include <metal_stdlib>
using namespace metal;
// Sums as they are written: fast math, which is on by default, would regroup them. Metal before 3.2
// does not know the mode: compile with -fno-fast-math there.
#if __METAL_VERSION__ >= 320
#pragma METAL fp math_mode(safe)
#endif
#pragma METAL fp contract(off)""",
)
SLANG = Language(
    "slang",
    "slang",
    _HLSL,
    "static const",
    False,
    "For Metal and WGSL take those kits.",
    "`precise` keeps sums as they are written where the target has such a word (SPIR-V, HLSL, "
    "GLSL); `mad` may round twice, so exact products are split into halves.",
    provided=_HLSL_HALVES,
)
