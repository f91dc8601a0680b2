"""How an include reads a pixel's numbers from the targets, in each language: with bindings, and the
fetch itself, that an engine may replace."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from moit.catalog.targets import Target
from moit.kit.layout import laid_out
from moit.kit.small_targets import between, size_of, size_told

Named = tuple[tuple[str, Target], ...]

_CHANNELS = {"r": ".x", "rg": ".xy", "rgba": ""}
_CHANNELS_OF = {"vec4": "", "float": ".x"}  # by the types of what resolve is given
_SOURCES = "// What passes before left of a pixel."
_RESOLVE = "// The resolve of a pixel, to be blended over the picture: one, one-minus-src-alpha."


@dataclasses.dataclass(frozen=True)
class Fetched:
    """What is read.

    summed : of pass 1; second : of a pass between; colours : of the pass that shades, () where
        pass 1 did; its targets are bound in this order.
    extents : of each pixel's own range of depth, bound behind these.
    small : the first two are of blocks of pixels, and pixels read between their texels.
    resolves : the types of what `resolve` is given.
    tight : how the text is laid out.
    """

    summed: Named
    second: Named
    colours: Named
    extents: Named
    small: bool
    resolves: tuple[str, ...]
    tight: int

    @property
    def names(self) -> list[str]:
        return [name for name, _ in (*self.summed, *self.second, *self.colours, *self.extents)]

    @property
    def structs(self) -> list[tuple[str, str, Named, int]]:
        """Functions that fetch a struct each: their targets, and the first one's place."""
        found = [("moit_fetched", "moit_sums", self.summed, 0)]
        if self.second:
            found.append(("moit_fetched_second", "moit_seconds", self.second, len(self.summed)))
        if self.extents:
            place = len(self.names) - len(self.extents)
            found.append(("moit_fetched_extents", "moit_extents", self.extents, place))
        return found

    def resolved(self, fetch: Callable[[int, str], str], sums: str) -> str:
        """What the resolve calls: `fetch` reads a target, `sums` all of pass 1."""
        first = len(self.summed) + len(self.second)
        if not self.colours:
            return f"moit_resolve_color({sums})"
        read = [fetch(first + i, one) for i, (one, _) in enumerate(self.colours)]
        given = [
            f"{read.pop(0)}{_CHANNELS_OF[type]}" if type in _CHANNELS_OF else sums
            for type in self.resolves
        ]
        return f"moit_resolve({', '.join(given)})"

    @property
    def resolve_reads_sums(self) -> bool:
        return not self.colours or "moit_sums" in self.resolves


def fetching(
    language: str,
    held: Named,
    shaded: Named,
    second: Named = (),
    extents: Named = (),
    tight: int = 0,
    small: bool = False,
    resolves: tuple[str, ...] = (),
) -> str:
    """What fetches `sums` and, where there is a pass between, `seconds`; what resolves a pixel."""
    colours = shaded if held else ()
    read = Fetched(held or shaded, second, colours, extents, small, resolves, tight)
    return _BY_LANGUAGE[language](read)


def _channels(target: Target) -> str:
    return _CHANNELS[target.format.rstrip("0123456789f")]


def _like_c(read: Fetched, binding: str, texture: str, fetch: str, vector: str, pixel: str) -> str:
    names = list(enumerate(read.names))
    prefix = "REGISTER" if binding else "BINDING"
    language = "hlsl" if binding else "glsl"
    size = [size_of(language, f"moit_{read.names[0]}")] if read.small else []
    resolved = read.resolved(lambda i, _: f"MOIT_FETCH_{i}(pixel)", "moit_fetched(pixel)")
    told = [
        f"// MOIT_FETCH_0(pixel) to MOIT_FETCH_{len(names) - 1}(pixel), of {vector}; "
        "in passes that read nothing MOIT_NO_FETCH."
    ]
    return "\n".join(
        [
            f"{_SOURCES} To read it otherwise (subpass inputs, arrays) define",
            *told,
            *([size_told(pixel)] if read.small else []),
            "#ifndef MOIT_NO_FETCH",
            f"#ifndef MOIT_{prefix}_0",
            *(f"#define MOIT_{prefix}_{i} {binding}{i}" for i, _ in names),
            "#endif",
            "#ifndef MOIT_FETCH_0",
            *(texture.format(f"MOIT_{prefix}_{i}", f"moit_{name}") for i, name in names),
            *(f"#define MOIT_FETCH_{i}(pixel) {fetch.format(f'moit_{n}')}" for i, n in names),
            *size,
            "#endif",
            *(
                line
                for function, struct, targets, first in read.structs
                for line in _fetchers(
                    read,
                    f"{struct} {{0}}({pixel} {{1}}) {{{{ {struct} o; "
                    + "".join(
                        f"o.{name} = MOIT_FETCH_{i}({{1}}){_channels(target)}; "
                        for i, (name, target) in enumerate(targets, first)
                    )
                    + "return o; }}",
                    function,
                    between(language, function, struct),
                )
            ),
            _RESOLVE,
            *laid_out(f"{vector} moit_resolved({pixel} pixel) {{ return {resolved}; }}"),
            "#endif",
        ]
    )


def _fetchers(read: Fetched, text: str, function: str, interpolated: str) -> list[str]:
    """What fetches a pixel's struct; of small targets that of a texel and of a pixel."""
    if not read.small:
        return laid_out(text.format(function, "pixel"), read.tight)
    texel = text.format(f"{function}_texel", "texel")
    return [*laid_out(texel, read.tight), *laid_out(interpolated, read.tight)]


def _glsl(read: Fetched) -> str:
    texture = "layout(binding = {0}) uniform sampler2D {1};"
    fetch = "texelFetch({0}, pixel, 0)"
    return _like_c(read, "", texture, fetch, "vec4", "ivec2")


def _hlsl(read: Fetched) -> str:
    texture = "Texture2D<float4> {1} : register({0});"
    fetch = "{0}.Load(int3(pixel, 0))"
    return _like_c(read, "t", texture, fetch, "float4", "int2")


def _metal(read: Fetched) -> str:
    given = (*read.colours, *(read.summed if read.resolve_reads_sums else ()))
    listed = "".join(f"texture2d<float> {name}, " for name, _ in given)
    sums = "".join(f"{name}, " for name, _ in read.summed)
    resolved = read.resolved(
        lambda _, name: f"MOIT_FETCH({name}, pixel)", f"moit_fetched({sums}pixel)"
    )
    return "\n".join(
        [
            f"{_SOURCES} Textures come from an entry point's arguments;",
            "// where a pass reads what it draws to, fill moit_sums from its [[color(n)]].",
            "#ifndef MOIT_FETCH",
            "#define MOIT_FETCH(texture, pixel) texture.read(pixel)",
            "#endif",
            *(
                line
                for function, struct, targets, _ in read.structs
                for line in _fetchers(
                    read,
                    f"inline {struct} {{0}}("
                    + "".join(f"texture2d<float> {name}, " for name, _ in targets)
                    + f"uint2 {{1}}) {{{{ {struct} o; "
                    + "".join(
                        f"o.{name} = MOIT_FETCH({name}, {{1}}){_channels(target)}; "
                        for name, target in targets
                    )
                    + "return o; }}",
                    function,
                    between("metal", function, struct, [name for name, _ in targets]),
                )
            ),
            _RESOLVE,
            *laid_out(f"inline float4 moit_resolved({listed}uint2 pixel) {{ return {resolved}; }}"),
        ]
    )


def _wgsl(read: Fetched) -> str:
    names = list(enumerate(read.names))
    resolved = read.resolved(
        lambda _, name: f"textureLoad(moit_{name}, pixel, 0)", "moit_fetched(pixel)"
    )
    size = [size_of("wgsl", f"moit_{read.names[0]}")] if read.small else []
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
            *size,
            *(
                line
                for function, struct, targets, _ in read.structs
                for line in _fetchers(
                    read,
                    f"fn {{0}}({{1}}: vec2<i32>) -> {struct} {{{{ var o: {struct}; "
                    + "".join(
                        f"o.{name} = textureLoad(moit_{name}, {{1}}, 0){_channels(target)}; "
                        for name, target in targets
                    )
                    + "return o; }}",
                    function,
                    between("wgsl", function, struct),
                )
            ),
            _RESOLVE,
            *laid_out(f"fn moit_resolved(pixel: vec2<i32>) -> vec4<f32> {{ return {resolved}; }}"),
        ]
    )


_BY_LANGUAGE = {"glsl": _glsl, "hlsl": _hlsl, "slang": _hlsl, "metal": _metal, "wgsl": _wgsl}
