"""How shaders of an engine call an include, in each language: for the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from moit.catalog.targets import Target
from moit.kit.gathered import SMALL, THREADS, called, program_lines, shading_lines
from moit.kit.including import Include
from moit.kit.ordered import ordered_usage
from moit.kit.rounds import usage_of
from moit.kit.small_targets import FARTHEST, MEANS, farthest_usage

_PIXELS = {
    "glsl": "ivec2(gl_FragCoord.xy)",
    "hlsl": "int2(position.xy)",
    "slang": "int2(position.xy)",
    "metal": "uint2(position.xy)",
    "wgsl": "vec2<i32>(position.xy)",
}


def usage(include: Include) -> dict[str, list[str]]:
    """What the fragment shaders of each pass have: they are given `depth`, `alpha` and `color` of a
    fragment, and set targets, or the `picture`."""
    if include.kept and include.state:
        return ordered_usage(include.language.name, include.kept, include.state)
    is_metal = include.language.name == "metal"
    colours = include.shaded[0][0]
    fetched = _fetched(include)
    read = [name for name, _ in include.shaded] if include.held and is_metal else []
    own = fetched if include.resolve_reads_sums else _PIXELS[include.language.name]
    totals = [include.own_total] if is_metal and include.own_total else []
    resolved = ", ".join([*read, *totals, own])
    resolve = {"resolve": [f"picture = moit_resolved({resolved});"]}
    if include.shape:
        name = include.language.name
        has_total = bool(include.held)
        return usage_of(include.shape, name, colours, resolve["resolve"], has_total)
    if include.programs:
        return _programs(include) | resolve
    if not include.held:
        call = "moit_accumulate_color(color, alpha, depth)"
        sums = [f"{name} = sums.{name};" for name, _ in include.shaded]
        return {"shading": [_let(include, "moit_sums", "sums", call), *sums], **resolve}
    call = f"moit_accumulate({_place(include)}, alpha)"
    sums = [f"{name} = sums.{name};" for name, _ in include.held]
    is_small = include.side > 1 and not include.means
    small = {FARTHEST: farthest_usage(include.language.name)} if is_small else {}
    return {
        **small,
        **({"extents": _extents(include)} if include.extents else {}),
        "absorbance": [*_own(include), _let(include, "moit_sums", "sums", call), *sums],
        **({MEANS: _means(include)} if include.means else {}),
        **({"second absorbance": _second(include)} if include.second else {}),
        "shading": [
            *_read(include),
            f"{colours} = moit_shaded(color, alpha, through);",
            *(f"{name} = alpha;" for name, _ in include.shaded[1:]),
        ],
        **resolve,
    }


def _extents(include: Include) -> list[str]:
    """The pass that finds each pixel's own range of depth."""
    found = _let(include, "moit_extents", "extents", "moit_extents_of(depth)")
    return [found, *(f"{name} = extents.{name};" for name, _ in include.extents)]


def _own(include: Include) -> list[str]:
    """What reads that range, where there is one."""
    if not include.extents:
        return []
    fetch = f"moit_fetched_extents({_given(include, include.extents)})"
    return [_let(include, "moit_extents", "own", fetch)]


def _place(include: Include) -> str:
    """A fragment's z."""
    return "moit_warped_within(own, depth)" if include.extents else "moit_warped(depth)"


def _programs(include: Include) -> dict[str, list[str]]:
    language = include.language.name
    held, shaded = ([name for name, _ in part] for part in (include.held, include.shaded))
    small = any(one.where == SMALL for one in include.programs)
    found = {FARTHEST: farthest_usage(language)} if small else {}
    for one in include.programs:
        found[one.name] = program_lines(language, one, include.touching, held, shaded)
    return found


_OF = {
    **{"resolve": "a pixel", "under": "a pixel"},
    **dict.fromkeys((FARTHEST, MEANS), "a texel of the small targets"),
}


def usage_text(include: Include) -> str:
    """The same in one."""
    parts = []
    threads = [one.name for one in include.programs if one.where == THREADS]
    for name, lines in usage(include).items():
        what = "a thread" if name in threads else _OF.get(name, "a fragment")
        parts.append("\n".join([f"// {name}, for {what}", *lines]))
    return "\n\n".join(parts)


def factors_call(include: Include) -> str:
    """What makes the factors of a pixel."""
    own = ", own" * include.factors_read_extents
    call = f"moit_factor(moit_fetched({_fetched(include)}){own})"
    if include.programs:
        call = _of_arrays(include, "factor({place}, size, {sums})")
    if include.state:
        words = "words, " if include.language.name == "metal" else ""
        call = f"moit_factor_of_words(moit_loaded({words}{_PIXELS[include.language.name]}))"
    if include.second:
        second = f"moit_fetched_second({_given(include, include.second)})"
        call = f"moit_factor_second(moit_fetched({_fetched(include)}), {second})"
    return _let(include, "moit_factors", "pixel", call)


def factors_made(include: Include) -> list[str]:
    """What the pass for factors has before it writes them."""
    own = _own(include) if include.factors_read_extents else []
    return [*own, factors_call(include)]


# How a pixel of a texture is read, and what a camera's depth is in perspective.
_TEXELS = {
    "glsl": "texelFetch({0}, ivec2(gl_FragCoord.xy), 0)",
    "hlsl": "{0}.Load(int3(position.xy, 0))",
    "slang": "{0}.Load(int3(position.xy, 0))",
    "metal": "{0}.read(uint2(position.xy))",
    "wgsl": "textureLoad({0}, vec2<i32>(position.xy), 0)",
}
_DX = "position.w` in Direct3D, `1.0 / position.w` in Vulkan"
DEPTHS = {
    **{"glsl": "1.0 / gl_FragCoord.w`", "metal": "1.0 / position.w`", "wgsl": "1.0 / position.w`"},
    **{"hlsl": _DX, "slang": _DX},
}
_CHANNELS = {"float": ".x", "vec2": ".xy", "vec4": ""}


def _of_arrays(include: Include, call: str) -> str:
    """A call of what reads arrays, too."""
    held = [name for name, _ in include.held]
    return called(include.language.name, call, include.touching, held)


def factors_read(include: Include) -> list[str]:
    """What reads the factors of a pixel from textures of their names."""
    name = include.language.name
    declared = "var pixel: moit_factors;" if name == "wgsl" else "moit_factors pixel;"
    return [
        declared,
        *(
            f"pixel.{one.name} = {_TEXELS[name].format(one.name)}{_CHANNELS[one.type]};"
            for one in include.factors
        ),
    ]


def factors_shade(include: Include) -> list[str]:
    """The pass that shades a fragment by the factors of its pixel."""
    lines = usage(include)["shading"]
    if include.programs:
        shading = include.programs[-1]
        call = _of_arrays(include, shading.call.replace("_of_sums", "").replace("{sums}", "pixel"))
        shaded = [name for name, _ in include.shaded]
        made = shading_lines(include.language.name, shading, call, shaded)
        return [*factors_read(include), *made]
    if include.state is None:
        return [*factors_read(include), *(one for one in lines if " pixel = " not in one)]
    through = "float through = moit_transmittance(pixel, moit_warped(depth), alpha);"
    return [*factors_read(include), through, lines[-1]]


def _fetched(include: Include) -> str:
    return _given(include, include.read_by_shading)


def _given(include: Include, targets: Iterable[tuple[str, Target]]) -> str:
    """What a fetch from these is given."""
    textures = [name for name, _ in targets] if include.language.name == "metal" else []
    return ", ".join([*textures, _PIXELS[include.language.name]])


def _means(include: Include) -> list[str]:
    """The pass that makes means of blocks."""
    call = f"moit_mean({_given(include, include.held)})"
    members = zip(include.means, include.held, strict=True)
    return [
        _let(include, "moit_sums", "mean", call),
        *(f"{target} = mean.{name};" for (target, _), (name, _) in members),
    ]


def _second(include: Include) -> list[str]:
    """The pass between, of what the first lets through."""
    call = f"moit_accumulate_second(first, {_place(include)}, alpha)"
    fetch = "moit_fetched_texel" if include.side > 1 else "moit_fetched"  # that of the texel itself
    return [
        _let(include, "moit_factors", "first", f"moit_factor({fetch}({_fetched(include)}))"),
        *_own(include),
        _let(include, "moit_seconds", "seconds", call),
        *(f"{name} = seconds.{name};" for name, _ in include.second),
    ]


def _let(include: Include, type: str, variable: str, value: str) -> str:
    if include.language.name == "wgsl":
        return f"let {variable} = {value};"
    return f"{type} {variable} = {value};"


def _read(include: Include) -> Iterator[str]:
    has_factors = "moit_factor" in include.calls
    name = "moit_transmittance" if has_factors else "moit_transmittance_of_sums"
    yield from _own(include)
    if has_factors:
        yield factors_call(include)
    else:
        yield _let(include, "moit_sums", "pixel", f"moit_fetched({_fetched(include)})")
    yield _let(include, "float", "through", f"{name}(pixel, {_place(include)}, alpha)")
