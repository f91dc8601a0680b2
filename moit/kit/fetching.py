"""How an include reads a pixel's numbers from the targets, in each language: with bindings, and the
fetch itself, that an engine may replace."""

from __future__ import annotations

from moit.catalog.targets import Target
from moit.kit.layout import laid_out

Named = tuple[tuple[str, Target], ...]

_CHANNELS = {"r": ".x", "rg": ".xy", "rgba": ""}
_SOURCES = "// What passes before left of a pixel."
_RESOLVE = "// The resolve of a pixel, to be blended over the picture: one, one-minus-src-alpha."


def fetching(language: str, held: Named, shaded: Named, second: Named = (), tight: int = 0) -> str:
    """What fetches `sums` and, where there is a pass between, `seconds`; what resolves a pixel."""
    return _BY_LANGUAGE[language](held or shaded, shaded[0][0] if held else "", second, tight)


def _channels(target: Target) -> str:
    return _CHANNELS[target.format.rstrip("0123456789f")]


def _resolve(colours: str) -> str:
    return "moit_resolve" if colours else "moit_resolve_color"


def _names(summed: Named, colours: str, second: Named) -> list[str]:
    return [name for name, _ in (*summed, *second)] + ([colours] if colours else [])


def _fetchers(summed: Named, second: Named) -> list[tuple[str, str, Named, int]]:
    """Functions that fetch a struct each: their targets, and the first one's place."""
    found = [("moit_fetched", "moit_sums", summed, 0)]
    if second:
        found.append(("moit_fetched_second", "moit_seconds", second, len(summed)))
    return found


def _like_c(
    summed: Named,
    colours: str,
    second: Named,
    tight: int,
    binding: str,
    texture: str,
    fetch: str,
    vector: str,
    pixel: str,
) -> str:
    names = list(enumerate(_names(summed, colours, second)))
    colour = f"MOIT_FETCH_{len(names) - 1}(pixel), " if colours else ""
    prefix = "REGISTER" if binding else "BINDING"
    return "\n".join(
        [
            f"{_SOURCES} To read it otherwise (subpass inputs, arrays) define",
            f"// MOIT_FETCH_0(pixel) to MOIT_FETCH_{len(names) - 1}(pixel), of {vector}; "
            "in passes that read nothing MOIT_NO_FETCH.",
            "#ifndef MOIT_NO_FETCH",
            f"#ifndef MOIT_{prefix}_0",
            *(f"#define MOIT_{prefix}_{i} {binding}{i}" for i, _ in names),
            "#endif",
            "#ifndef MOIT_FETCH_0",
            *(texture.format(f"MOIT_{prefix}_{i}", f"moit_{name}") for i, name in names),
            *(f"#define MOIT_FETCH_{i}(pixel) {fetch.format(f'moit_{n}')}" for i, n in names),
            "#endif",
            *(
                line
                for function, struct, targets, first in _fetchers(summed, second)
                for line in laid_out(
                    f"{struct} {function}({pixel} pixel) {{ {struct} o; "
                    + "".join(
                        f"o.{name} = MOIT_FETCH_{i}(pixel){_channels(target)}; "
                        for i, (name, target) in enumerate(targets, first)
                    )
                    + "return o; }",
                    tight,
                )
            ),
            _RESOLVE,
            *laid_out(
                f"{vector} moit_resolved({pixel} pixel) {{ return {_resolve(colours)}({colour}"
                "moit_fetched(pixel)); }"
            ),
            "#endif",
        ]
    )


def _glsl(summed: Named, colours: str, second: Named, tight: int) -> str:
    texture = "layout(binding = {0}) uniform sampler2D {1};"
    fetch = "texelFetch({0}, pixel, 0)"
    return _like_c(summed, colours, second, tight, "", texture, fetch, "vec4", "ivec2")


def _hlsl(summed: Named, colours: str, second: Named, tight: int) -> str:
    texture = "Texture2D<float4> {1} : register({0});"
    fetch = "{0}.Load(int3(pixel, 0))"
    return _like_c(summed, colours, second, tight, "t", texture, fetch, "float4", "int2")


def _metal(summed: Named, colours: str, second: Named, tight: int) -> str:
    listed = ", ".join(f"texture2d<float> {name}" for name, _ in summed)
    also = f"texture2d<float> {colours}, " if colours else ""
    given = ", ".join(name for name, _ in summed)
    colour = f"MOIT_FETCH({colours}, pixel), " if colours else ""
    return "\n".join(
        [
            f"{_SOURCES} Textures come from an entry point's arguments;",
            "// where a pass reads what it draws to, fill moit_sums from its [[color(n)]].",
            "#ifndef MOIT_FETCH",
            "#define MOIT_FETCH(texture, pixel) texture.read(pixel)",
            "#endif",
            *(
                line
                for function, struct, targets, _ in _fetchers(summed, second)
                for line in laid_out(
                    f"inline {struct} {function}("
                    + "".join(f"texture2d<float> {name}, " for name, _ in targets)
                    + f"uint2 pixel) {{ {struct} o; "
                    + "".join(
                        f"o.{name} = MOIT_FETCH({name}, pixel){_channels(target)}; "
                        for name, target in targets
                    )
                    + "return o; }",
                    tight,
                )
            ),
            _RESOLVE,
            *laid_out(
                f"inline float4 moit_resolved({also}{listed}, uint2 pixel) {{ return "
                f"{_resolve(colours)}({colour}moit_fetched({given}, pixel)); }}"
            ),
        ]
    )


def _wgsl(summed: Named, colours: str, second: Named, tight: int) -> str:
    names = list(enumerate(_names(summed, colours, second)))
    colour = f"textureLoad(moit_{colours}, pixel, 0), " if colours else ""
    return "\n".join(
        [
            f"{_SOURCES} To read it otherwise change what follows. A pipeline",
            "// that calls neither function binds nothing.",
            "const MOIT_GROUP = 0;",
            *(f"const MOIT_BINDING_{i} = {i};" for i, _ in names),
            *(
                f"@group(MOIT_GROUP) @binding(MOIT_BINDING_{i}) var moit_{name}: texture_2d<f32>;"
                for i, name in names
            ),
            *(
                line
                for function, struct, targets, _ in _fetchers(summed, second)
                for line in laid_out(
                    f"fn {function}(pixel: vec2<i32>) -> {struct} {{ var o: {struct}; "
                    + "".join(
                        f"o.{name} = textureLoad(moit_{name}, pixel, 0){_channels(target)}; "
                        for name, target in targets
                    )
                    + "return o; }",
                    tight,
                )
            ),
            _RESOLVE,
            *laid_out(
                f"fn moit_resolved(pixel: vec2<i32>) -> vec4<f32> {{ return {_resolve(colours)}("
                f"{colour}moit_fetched(pixel)); }}"
            ),
        ]
    )


_BY_LANGUAGE = {"glsl": _glsl, "hlsl": _hlsl, "slang": _hlsl, "metal": _metal, "wgsl": _wgsl}
