"""Targets of blocks of pixels, a texel each: how an include reads pixels between their texels, and
the depth of blocks, in each language."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

# Types of a place in a texture, of two floats, and what comes before a function's name.
_TYPES = {
    "glsl": ("ivec2", "vec2"),
    "hlsl": ("int2", "float2"),
    "metal": ("uint2", "float2"),
    "wgsl": ("vec2<i32>", "vec2<f32>"),
}
_SIZES = {
    "glsl": "#define MOIT_{2} textureSize({0}, 0)",
    "hlsl": "int2 moit_{1}() {{ uint2 size; {0}.GetDimensions(size.x, size.y); "
    "return int2(size); }}\n#define MOIT_{2} moit_{1}()",
    "wgsl": "fn moit_{1}() -> vec2<i32> {{ return vec2<i32>(textureDimensions({0})); }}",
}


def size_told(place: str, of_pixels: str = "") -> str:
    """Of macros that an engine may define, those of small targets alone."""
    if of_pixels:
        return (
            f"// With these go MOIT_TEXELS and MOIT_PIXELS ({place}), how many blocks and how many "
            "pixels\n// there are across and down."
        )
    return (
        f"// With these goes MOIT_TEXELS, how many texels moments have across and down ({place})."
    )


def size_of(language: str, texture: str, of_pixels: str = "") -> str:
    """What says how many texels there are across and down, and pixels, where means are of these."""
    sizes = [_SIZES[language].format(texture, "texels", "TEXELS")]
    if of_pixels:
        sizes.append(_SIZES[language].format(of_pixels, "pixels", "PIXELS"))
    return "\n".join(sizes)


def mean_of_block(language: str, textures: Sequence[str] = ()) -> str:
    """What makes the mean of a block's pixels, which `moit_of_pixel` reads: row by row.

    textures : in Metal, what both are given.
    """
    place, _ = _TYPES[language]
    given = "".join(f"{one}, " for one in textures)
    if language == "wgsl":
        return (
            f"fn moit_mean(texel: {place}) -> moit_sums {{ let side = i32(MOIT_RESOLUTION); "
            f"let first = texel * side; let size = min({place}(side), moit_pixels() - first); "
            "var o = moit_of_pixel(first); "
            "for (var k = 1; k < size.x * size.y; k++) { "
            f"o = moit_added(o, moit_of_pixel(first + {place}(k % size.x, k / size.x))); }} "
            "return moit_scaled(o, 1.0 / f32(size.x * size.y)); }"
        )
    start, listed, whole, pixels = "", "", "int", "MOIT_PIXELS"
    if language == "metal":
        start, whole = "inline ", "uint"
        listed = "".join(f"texture2d<float> {texture}, " for texture in textures)
        pixels = f"uint2({textures[0]}.get_width(), {textures[0]}.get_height())"
    side = f"{whole}(MOIT_RESOLUTION)"
    each = side if language == "hlsl" else f"{place}({side})"
    return (
        f"{start}moit_sums moit_mean({listed}{place} texel) {{ {place} first = texel * {side}; "
        f"{place} size = min({each}, {pixels} - first); "
        f"moit_sums o = moit_of_pixel({given}first); "
        f"for ({whole} k = 1; k < size.x * size.y; ++k) {{ "
        f"o = moit_added(o, moit_of_pixel({given}first + {place}(k % size.x, k / size.x))); }} "
        "return moit_scaled(o, 1.0 / float(size.x * size.y)); }"
    )


def between(
    language: str, function: str, struct: str, textures: Sequence[str] = (), own: str = ""
) -> str:
    """What reads a pixel's struct between four texels, which `function`_texel reads.

    textures : in Metal, what both are given.
    own : what reads the pixel's own total, to which the struct is scaled; in Metal its texture.
    """
    place, pair = _TYPES[language]
    mixed = "moit_between" + "_second" * function.endswith("_second")
    given = "".join(f"{one}, " for one in textures)
    texels = [
        f"{function}_texel({given}{one})"
        for one in ("a", f"{place}(d.x, a.y)", f"{place}(a.x, d.y)", "d")
    ]
    made = f"{mixed}({', '.join(texels)}, moit_shares_of_texels(p))"
    if own:
        total = f"MOIT_FETCH({own}, pixel)" if language == "metal" else own
        made = f"moit_scaled_to({made}, {total}.x)"
    if language == "wgsl":
        return (
            f"fn {function}(pixel: {place}) -> {struct} {{ let p = {pair}(pixel); "
            f"let low = {place}(moit_texel_before(p)); "
            f"let last = moit_texels() - 1; let a = min(low, last); let d = min(low + 1, last); "
            f"return {made}; }}"
        )
    size, one, start = "MOIT_TEXELS", "1", ""
    if language == "metal":
        size, one, start = (
            f"uint2({textures[0]}.get_width(), {textures[0]}.get_height())",
            "1u",
            "inline ",
        )
    read = [*textures, *([own] if language == "metal" and own else [])]
    listed = "".join(f"texture2d<float> {texture}, " for texture in read)
    return (
        f"{start}{struct} {function}({listed}{place} pixel) {{ {pair} p = {pair}(pixel); "
        f"{place} low = {place}(moit_texel_before(p)), last = {size} - {one}; "
        f"{place} a = min(low, last), d = min(low + {one}, last); return {made}; }}"
    )


# A picture's farthest depth in each block, by a texture `opaque` that the shader has.
_FARTHEST = {
    "glsl": (
        "float farthest = 0.0;",
        "for (int k = 0; k < MOIT_RESOLUTION * MOIT_RESOLUTION; ++k) {",
        "    ivec2 at = ivec2(gl_FragCoord.xy) * MOIT_RESOLUTION",
        "        + ivec2(k % MOIT_RESOLUTION, k / MOIT_RESOLUTION);",
        "    at = min(at, textureSize(opaque, 0) - 1);",
        "    farthest = max(farthest, texelFetch(opaque, at, 0).x);",
        "}",
        "gl_FragDepth = farthest;",
    ),
    "hlsl": (
        "uint2 size; opaque.GetDimensions(size.x, size.y);",
        "farthest = 0.0;",
        "for (int k = 0; k < MOIT_RESOLUTION * MOIT_RESOLUTION; ++k) {",
        "    int2 at = int2(position.xy) * MOIT_RESOLUTION",
        "        + int2(k % MOIT_RESOLUTION, k / MOIT_RESOLUTION);",
        "    at = min(at, int2(size) - 1);",
        "    farthest = max(farthest, opaque.Load(int3(at, 0)).x);",
        "}",
    ),
    "metal": (
        "uint2 last = uint2(opaque.get_width() - 1u, opaque.get_height() - 1u);",
        "farthest = 0.0;",
        "for (uint k = 0; k < MOIT_RESOLUTION * MOIT_RESOLUTION; ++k) {",
        "    uint2 at = uint2(position.xy) * MOIT_RESOLUTION;",
        "    at += uint2(k % MOIT_RESOLUTION, k / MOIT_RESOLUTION);",
        "    farthest = max(farthest, opaque.read(min(at, last)));",
        "}",
    ),
    "wgsl": (
        "farthest = 0.0;",
        "for (var k = 0; k < MOIT_RESOLUTION * MOIT_RESOLUTION; k++) {",
        "    let at = vec2<i32>(position.xy) * MOIT_RESOLUTION",
        "        + vec2<i32>(k % MOIT_RESOLUTION, k / MOIT_RESOLUTION);",
        "    let last = vec2<i32>(textureDimensions(opaque)) - 1;",
        "    farthest = max(farthest, textureLoad(opaque, min(at, last), 0));",
        "}",
    ),
}
_FARTHEST["slang"] = _FARTHEST["hlsl"]
FARTHEST, MEANS = "farthest", "means"  # passes


def farthest_usage(language: str) -> list[str]:
    """What the shader of the pass has that writes depths of blocks."""
    return list(_FARTHEST[language])


def farthest_pass() -> dict[str, Any]:
    """That pass, as the table has it."""
    return {
        "name": FARTHEST,
        "draws": "all of the small targets, once",
        "targets": [],
        "reads": [],
        "calls": [],
        "depth": {"test": "always", "write": True},
        "about": "Writes a depth target of the small targets' size, by the depth of the opaque "
        "picture: fragments of a block count in front of the farthest opaque surface of its "
        "pixels. Where depth is reversed that is the least.",
    }
