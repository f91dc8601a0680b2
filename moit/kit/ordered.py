"""Kits whose fragments change a pixel one after the other: how an include declares, loads and
stores the words that a pixel keeps, in each language that has ordered access, and how shaders call
it.

GLSL has it by ARB_fragment_shader_interlock, HLSL and Slang by rasterizer-ordered views, Metal by
raster order groups; WGSL has none.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from moit.catalog.targets import Target
from moit.kit.layout import laid_out
from moit.kit.recipe import State

_CHANNELS = {"r": ".x", "rg": ".xy", "rgba": ""}
NO_ORDER = (
    "its fragments change a pixel one after the other, for which WGSL has no ordered access (and a "
    "lock of each pixel is not portable, as nothing promises that who waits makes way)"
)
BEGIN, END = "MOIT_BEGIN_ORDERED", "MOIT_END_ORDERED"
PIXELS = {
    "glsl": "ivec2(gl_FragCoord.xy)",
    "hlsl": "int2(position.xy)",
    "slang": "int2(position.xy)",
    "metal": "uint2(position.xy)",
}


@dataclasses.dataclass(frozen=True)
class Kept:
    """What an include keeps of a pixel.

    words : how many of 32 bits.
    tail : targets that what leaves is blended to, by their names.
    colours : the name of the target that the pass that shades has; "" where there is none.
    resolve : the function that resolves a pixel.
    """

    words: int
    tail: tuple[tuple[str, Target], ...]
    colours: str
    resolve: str

    @property
    def read(self) -> list[tuple[str, str]]:
        """Targets that a resolve reads beside words, with the channels that it takes."""
        found = [(name, _CHANNELS[one.format.rstrip("0123456789f")]) for name, one in self.tail]
        return [*found, *([(self.colours, "")] if self.colours else [])]


# Slang orders what HLSL and Metal read by itself; of GLSL and SPIR-V a shader has to say where.
_SLANG_START = f"""\
// The pass that inserts defines MOIT_INSERTS. GLSL and SPIR-V are told where order begins and ends.
#ifdef MOIT_INSERTS
#define MOIT_TOLD(how) __target_switch {{ case glsl: case spirv: how(); default: {{}} }}
#define {BEGIN} MOIT_TOLD(beginInvocationInterlock)
#define {END} MOIT_TOLD(endInvocationInterlock)
#endif"""


def start_of(language: str) -> str:
    """What has to stand before everything else of a shader."""
    if language == "slang":
        return _SLANG_START
    if language != "glsl":
        return ""
    return f"""\
// The pass that inserts defines MOIT_INSERTS; a pixel's fragments come in the order of triangles.
#ifdef MOIT_INSERTS
#ifndef {BEGIN}
#extension GL_ARB_fragment_shader_interlock : require
layout(pixel_interlock_ordered) in;
#define {BEGIN} beginInvocationInterlockARB();
#define {END} endInvocationInterlockARB();
#endif
layout(early_fragment_tests) in;
#endif"""


def keeping(language: str, kept: Kept, tight: int = 0) -> str:
    """What loads and stores the words of a pixel, and resolves it."""
    return "\n".join(_metal(kept, tight) if language == "metal" else _like_c(language, kept, tight))


def _like_c(language: str, kept: Kept, tight: int) -> list[str]:
    is_glsl = language == "glsl"
    vector, pixel, prefix = "float4", "int2", "REGISTER"
    if is_glsl:
        vector, pixel, prefix = "vec4", "ivec2", "BINDING"
    read, each = kept.read, _each(kept)
    numbers = range(1, len(read) + 1)
    places = [f"#define MOIT_{prefix}_{i} {'' if is_glsl else 't'}{i}" for i in (0, *numbers)]
    placed = [f"#ifndef MOIT_{prefix}_0", *places, "#endif"]
    if not is_glsl:
        unset = f"!defined(MOIT_{prefix}_0)"
        inserts = f"#define MOIT_{prefix}_0 u{len(kept.tail)}"
        placed = [f"#if defined(MOIT_INSERTS) && {unset}", inserts, f"#elif {unset}", *placed[1:]]
    if is_glsl:
        words = f"(binding = MOIT_{prefix}_0"
        changed = [
            f"layout{words}, r32ui) coherent uniform uimage2DArray moit_words;",
            "#define MOIT_LOAD(pixel, i) imageLoad(moit_words, ivec3(pixel, i)).x",
            "#define MOIT_STORE(pixel, i, w) imageStore(moit_words, ivec3(pixel, i), uvec4(w))",
        ]
        looked_at = [
            f"layout{words}) uniform usampler2DArray moit_words;",
            "#define MOIT_LOAD(pixel, i) texelFetch(moit_words, ivec3(pixel, i), 0).x",
        ]
        texture = "layout(binding = {0}) uniform sampler2D {1};"
        fetch = "texelFetch({0}, pixel, 0)"
    else:
        words = f"moit_words : register(MOIT_{prefix}_0);"
        changed = [
            "#ifndef MOIT_ORDERED_TEXTURE",
            "#define MOIT_ORDERED_TEXTURE RasterizerOrderedTexture2DArray<uint>",
            "#endif",
            f"MOIT_ORDERED_TEXTURE {words}",
            "#define MOIT_LOAD(pixel, i) moit_words[uint3(pixel, i)]",
            "#define MOIT_STORE(pixel, i, w) moit_words[uint3(pixel, i)] = w",
        ]
        looked_at = [
            f"Texture2DArray<uint> {words}",
            "#define MOIT_LOAD(pixel, i) moit_words.Load(int4(pixel, i, 0))",
        ]
        texture = "Texture2D<float4> {1} : register({0});"
        fetch = "{0}.Load(int3(pixel, 0))"
    return [
        f"// What a pixel keeps: {kept.words} words, in an array of as many textures of R32_UINT.",
        "// To keep them elsewhere define MOIT_LOAD(pixel, i) and MOIT_STORE(pixel, i, w).",
        "#ifndef MOIT_NO_FETCH",
        *placed,
        "#ifndef MOIT_LOAD",
        "#ifdef MOIT_INSERTS",
        *changed,
        "#else",
        *looked_at,
        "#endif",
        "#endif",
        *laid_out(
            f"moit_state moit_loaded({pixel} pixel) {{ moit_state o; {each} "
            "{ o.word[i] = MOIT_LOAD(pixel, i); } return o; }",
            tight,
        ),
        "#ifdef MOIT_INSERTS",
        *laid_out(
            f"void moit_store({pixel} pixel, moit_state held) {{ {each} "
            "{ MOIT_STORE(pixel, i, held.word[i]); } }",
            tight,
        ),
        "#else",
        *(["#ifndef MOIT_FETCH_1"] if read else []),
        *(texture.format(f"MOIT_{prefix}_{i}", f"moit_{read[i - 1][0]}") for i in numbers),
        *(
            f"#define MOIT_FETCH_{i}(pixel) {fetch.format(f'moit_{read[i - 1][0]}')}"
            for i in numbers
        ),
        *(["#endif"] if read else []),
        "// The resolve of a pixel, to be blended over the picture: one, one-minus-src-alpha.",
        *laid_out(
            f"{vector} moit_resolved({pixel} pixel) {{ "
            + _resolved(kept, "moit_loaded(pixel)", [f"MOIT_FETCH_{i}(pixel)" for i in numbers])
            + " }",
            tight,
        ),
        "#endif",
        "#endif",
    ]


def _each(kept: Kept) -> str:
    return f"for (int i = 0; i < {kept.words}; ++i)"


def _resolved(kept: Kept, loaded: str, fetches: Sequence[str]) -> str:
    """Statements that return the resolve of a pixel."""
    if kept.colours:
        return f"return {kept.resolve}({fetches[-1]}, {loaded});"
    if not kept.tail:
        return f"return {kept.resolve}({loaded});"
    sets = "".join(
        f"tail.{name} = {fetch}{channels}; "
        for (name, channels), fetch in zip(kept.read, fetches, strict=True)
    )
    return f"moit_sums tail; {sets}return {kept.resolve}({loaded}, tail);"


def _metal(kept: Kept, tight: int) -> list[str]:
    read, each = [name for name, _ in kept.read], _each(kept)
    listed = "".join(f"texture2d<float> {name}, " for name in read)
    return [
        f"// What a pixel keeps: {kept.words} words, in an array of as many textures of R32Uint,",
        "// an argument: [[texture(0), raster_order_group(0)]], access::read_write, where they",
        "// insert, which is [[early_fragment_tests]]. To keep them elsewhere define both macros.",
        "#ifndef MOIT_LOAD",
        "#define MOIT_LOAD(words, pixel, i) words.read(pixel, uint(i)).x",
        "#define MOIT_STORE(words, pixel, i, word) words.write(uint4(word), pixel, uint(i))",
        "#endif",
        "template <typename Words>",
        *laid_out(
            f"inline moit_state moit_loaded(Words words, uint2 pixel) {{ moit_state o; {each} "
            "{ o.word[i] = MOIT_LOAD(words, pixel, i); } return o; }",
            tight,
        ),
        "template <typename Words>",
        *laid_out(
            f"inline void moit_store(Words words, uint2 pixel, moit_state held) {{ {each} "
            "{ MOIT_STORE(words, pixel, i, held.word[i]); } }",
            tight,
        ),
        "// The resolve of a pixel, to be blended over the picture: one, one-minus-src-alpha.",
        "template <typename Words>",
        *laid_out(
            f"inline float4 moit_resolved(Words words, {listed}uint2 pixel) {{ "
            + _resolved(kept, "moit_loaded(words, pixel)", [f"{name}.read(pixel)" for name in read])
            + " }",
            tight,
        ),
    ]


def _transmittance(state: State, loaded: str, depth: str) -> str:
    if state.has_factors:
        return f"moit_transmittance_of_words({loaded}, {depth}, alpha)"
    return f"moit_transmittance({loaded}, {depth})"


def ordered_usage(language: str, kept: Kept, state: State) -> dict[str, list[str]]:
    """What the fragment shaders of each pass have (moit.kit.usage)."""
    is_metal = language == "metal"
    words = "words, " if is_metal else ""
    pixel = {"glsl": "ivec2", "metal": "uint2"}.get(language, "int2")
    place = f"{pixel} pixel = {PIXELS[language]};"
    depth = "moit_warped(depth)" if state.warps else "depth"
    given = f"{depth}, alpha{', color' * state.takes_color}"
    call = f"moit_inserted(moit_loaded({words}pixel), {given})"
    if kept.tail:
        lines = [f"moit_insertion found = {call};", f"moit_store({words}pixel, found.held);"]
    else:
        lines = [f"moit_store({words}pixel, {call});"]
    if language in ("glsl", "slang"):
        lines = [BEGIN, *lines, END]
    insert = [place, *lines, *(f"{name} = found.leaves.{name};" for name, _ in kept.tail)]
    found = {"insert": insert}
    if kept.colours:
        found["shading"] = [
            place,
            f"float through = {_transmittance(state, f'moit_loaded({words}pixel)', depth)};",
            f"{kept.colours} = moit_shaded(color, alpha, through);",
        ]
    textures = "".join(f"{name}, " for name, _ in kept.read) if is_metal else ""
    found["resolve"] = [f"picture = moit_resolved({words}{textures}{PIXELS[language]});"]
    return found
