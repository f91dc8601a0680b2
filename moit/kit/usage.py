"""How shaders of an engine call an include, in each language: for the page."""

from __future__ import annotations

from collections.abc import Callable

from moit.kit.including import Include

_PIXELS = {
    "glsl": "ivec2(gl_FragCoord.xy)",
    "hlsl": "int2(position.xy)",
    "slang": "int2(position.xy)",
    "metal": "uint2(position.xy)",
    "wgsl": "vec2<i32>(position.xy)",
}


def usage(include: Include) -> str:
    """Of the passes, what there is to write in their fragment shaders."""
    name = include.language.name
    is_wgsl = name == "wgsl"

    def let(type: str, variable: str, value: str) -> str:
        return f"let {variable} = {value};" if is_wgsl else f"{type} {variable} = {value};"

    textures = ", ".join(one for one, _ in include.held or include.shaded)
    pixel = _PIXELS[name]
    fetched = f"{textures}, {pixel}" if name == "metal" else pixel
    colours = include.shaded[0][0]
    resolved = f"{colours}, {fetched}" if name == "metal" and include.held else fetched
    lines = []
    if include.held:
        lines += [
            "// Pass 1, for each fragment",
            let("moit_sums", "sums", "moit_accumulate(moit_warped(depth), alpha)"),
            *(f"{one} = sums.{one};" for one, _ in include.held),
            "",
            "// Pass 2, for each fragment",
            let("float", "z", "moit_warped(depth)"),
            *_read(include, fetched, let),
            f"{colours} = moit_shaded(color, alpha, through);",
        ]
    else:
        lines += [
            "// The one pass, for each fragment",
            let("moit_sums", "sums", "moit_accumulate_color(color, alpha, depth)"),
            *(f"{one} = sums.{one};" for one, _ in include.shaded),
        ]
    lines += [
        "",
        "// Resolve, a triangle over the picture",
        f"picture = moit_resolved({resolved});",
    ]
    return "\n".join(lines)


def _read(include: Include, fetched: str, let: Callable[[str, str, str], str]) -> list[str]:
    if "moit_factor" not in include.calls:
        return [
            let("moit_sums", "pixel", f"moit_fetched({fetched})"),
            let("float", "through", "moit_transmittance_of_sums(pixel, z, alpha)"),
        ]
    return [
        let("moit_factors", "pixel", f"moit_factor(moit_fetched({fetched}))"),
        let("float", "through", "moit_transmittance(pixel, z, alpha)"),
    ]
