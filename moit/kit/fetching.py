"""How an include reads a pixel's numbers from the targets, in each language: with bindings, and the
fetch itself, that an engine may replace."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from moit.catalog.targets import Target
from moit.kit.layout import laid_out
from moit.kit.small_targets import between, mean_of_block, size_of, size_told

Named = tuple[tuple[str, Target], ...]

_CHANNELS = {"r": ".x", "rg": ".xy", "rgba": ""}
_CHANNELS_OF = {"vec4": "", "float": ".x"}  # by the types of what resolve is given
_SOURCES = "// What passes before left of a pixel."
_RESOLVE = "// The resolve of a pixel, to be blended over the picture: one, one-minus-src-alpha."


@dataclasses.dataclass(frozen=True)
class Struct:
    """One that a function fetches: its members, their textures, and where the first is bound."""

    function: str
    name: str
    members: Named
    textures: Named
    first: int

    def filled(self, fetch: Callable[[int, str], str]) -> str:
        """Statements that set the members of `o`."""
        return "".join(
            f"o.{name} = {fetch(i, texture)}{_channels(target)}; "
            for i, ((name, target), (texture, _)) in enumerate(
                zip(self.members, self.textures, strict=True), self.first
            )
        )


@dataclasses.dataclass(frozen=True)
class Fetched:
    """What is read.

    summed : of pass 1; second : of a pass between; colours : of the pass that shades, () where
        pass 1 did; its targets are bound in this order.
    extents : of each pixel's own range of depth, bound behind these.
    small : the first two are of blocks of pixels, and pixels read between their texels.
    resolves : the types of what `resolve` is given.
    tight : how the text is laid out.
    means : of blocks, of the members of `summed`, which then is of each pixel; bound behind it.
    own_total : the texture of `summed` that means are scaled to; "" for none.
    """

    summed: Named
    second: Named
    colours: Named
    extents: Named
    small: bool
    resolves: tuple[str, ...]
    tight: int
    means: Named = ()
    own_total: str = ""

    @property
    def names(self) -> list[str]:
        parts = (self.summed, self.means, self.second, self.colours, self.extents)
        return [name for part in parts for name, _ in part]

    @property
    def structs(self) -> list[Struct]:
        """What functions fetch."""
        found = []
        if self.means:
            found.append(Struct("moit_of_pixel", "moit_sums", self.summed, self.summed, 0))
        textures = self.means or self.summed
        first = len(self.summed) if self.means else 0
        found.append(Struct("moit_fetched", "moit_sums", self.summed, textures, first))
        if self.second:
            place = first + len(textures)
            found.append(
                Struct("moit_fetched_second", "moit_seconds", self.second, self.second, place)
            )
        if self.extents:
            place = len(self.names) - len(self.extents)
            found.append(
                Struct("moit_fetched_extents", "moit_extents", self.extents, self.extents, place)
            )
        return found

    @property
    def own(self) -> list[tuple[int, str]]:
        """The texture of pixels' own totals, and its place."""
        return [(i, name) for i, (name, _) in enumerate(self.summed) if name == self.own_total]

    def resolved(self, fetch: Callable[[int, str], str], sums: str) -> str:
        """What the resolve calls: `fetch` reads a target, `sums` all of pass 1."""
        first = len(self.summed) + len(self.means) + len(self.second)
        if not self.colours:
            return f"moit_resolve_color({sums})"
        read = [fetch(first + i, one) for i, (one, _) in enumerate(self.colours)]
        read += [fetch(i, one) for i, one in self.own]
        given = [
            f"{read.pop(0)}{_CHANNELS_OF[type]}" if type in _CHANNELS_OF else sums
            for type in self.resolves
        ]
        return f"moit_resolve({', '.join(given)})"

    @property
    def small_one(self) -> str:
        """A texture that has a texel for each block."""
        return (self.means or self.summed)[0][0]

    @property
    def of_pixels(self) -> str:
        """One of the picture's size that blocks' means are of; "" where there are none."""
        return f"moit_{self.summed[0][0]}" if self.means else ""

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
    means: Named = (),
    own_total: str = "",
) -> str:
    """What fetches `sums` and, where there is a pass between, `seconds`; what resolves a pixel."""
    colours = shaded if held else ()
    summed = held or shaded
    read = Fetched(summed, second, colours, extents, small, resolves, tight, means, own_total)
    return _BY_LANGUAGE[language](read)


def _channels(target: Target) -> str:
    return _CHANNELS[target.format.rstrip("0123456789f")]


def _like_c(read: Fetched, binding: str, texture: str, fetch: str, vector: str, pixel: str) -> str:
    names = list(enumerate(read.names))
    prefix = "REGISTER" if binding else "BINDING"
    language = "hlsl" if binding else "glsl"
    size = [size_of(language, f"moit_{read.small_one}", read.of_pixels)] if read.small else []
    resolved = read.resolved(lambda i, _: f"MOIT_FETCH_{i}(pixel)", "moit_fetched(pixel)")
    told = [
        f"// MOIT_FETCH_0(pixel) to MOIT_FETCH_{len(names) - 1}(pixel), of {vector}; "
        "in passes that read nothing MOIT_NO_FETCH."
    ]
    return "\n".join(
        [
            f"{_SOURCES} To read it otherwise (subpass inputs, arrays) define",
            *told,
            *([size_told(pixel, read.of_pixels)] if read.small else []),
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
                for one in read.structs
                for line in _fetchers(
                    read,
                    f"{one.name} {{0}}({pixel} {{1}}) {{{{ {one.name} o; "
                    + one.filled(lambda i, _: f"MOIT_FETCH_{i}({{1}})")
                    + "return o; }}",
                    one,
                    language,
                )
            ),
            _RESOLVE,
            *laid_out(f"{vector} moit_resolved({pixel} pixel) {{ return {resolved}; }}"),
            "#endif",
        ]
    )


def _fetchers(read: Fetched, text: str, one: Struct, language: str) -> list[str]:
    """What fetches a pixel's struct; of small targets that of a texel and of a pixel; of pixels'
    own that make a block the mean of these."""
    if not read.small:
        return laid_out(text.format(one.function, "pixel"), read.tight)
    textures = [name for name, _ in one.textures] if language == "metal" else []
    if one.function == "moit_of_pixel":
        mean = mean_of_block(language, textures)
        pixel = text.format(one.function, "pixel")
        return [*laid_out(pixel, read.tight), *laid_out(mean, read.tight)]
    texel = text.format(f"{one.function}_texel", "texel")
    own = [name if textures else f"MOIT_FETCH_{i}(pixel)" for i, name in read.own]
    if language == "wgsl":
        own = [f"textureLoad(moit_{name}, pixel, 0)" for _, name in read.own]
    between_them = between(language, one.function, one.name, textures, own[0] if own else "")
    return [*laid_out(texel, read.tight), *laid_out(between_them, read.tight)]


def _glsl(read: Fetched) -> str:
    texture = "layout(binding = {0}) uniform sampler2D {1};"
    fetch = "texelFetch({0}, pixel, 0)"
    return _like_c(read, "", texture, fetch, "vec4", "ivec2")


def _hlsl(read: Fetched) -> str:
    texture = "Texture2D<float4> {1} : register({0});"
    fetch = "{0}.Load(int3(pixel, 0))"
    return _like_c(read, "t", texture, fetch, "float4", "int2")


def _metal(read: Fetched) -> str:
    own = [(name, one) for name, one in read.summed if name == read.own_total]
    given = (*read.colours, *(read.summed if read.resolve_reads_sums else own))
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
                for one in read.structs
                for line in _fetchers(
                    read,
                    f"inline {one.name} {{0}}("
                    + "".join(f"texture2d<float> {name}, " for name, _ in one.textures)
                    + f"uint2 {{1}}) {{{{ {one.name} o; "
                    + one.filled(lambda _, texture: f"MOIT_FETCH({texture}, {{1}})")
                    + "return o; }}",
                    one,
                    "metal",
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
    size = [size_of("wgsl", f"moit_{read.small_one}", read.of_pixels)] if read.small else []
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
                for one in read.structs
                for line in _fetchers(
                    read,
                    f"fn {{0}}({{1}}: vec2<i32>) -> {one.name} {{{{ var o: {one.name}; "
                    + one.filled(lambda _, texture: f"textureLoad(moit_{texture}, {{1}}, 0)")
                    + "return o; }}",
                    one,
                    "wgsl",
                )
            ),
            _RESOLVE,
            *laid_out(f"fn moit_resolved(pixel: vec2<i32>) -> vec4<f32> {{ return {resolved}; }}"),
        ]
    )


_BY_LANGUAGE = {"glsl": _glsl, "hlsl": _hlsl, "slang": _hlsl, "metal": _metal, "wgsl": _wgsl}
