"""Kits of techniques whose states are those of blocks of pixels: means of what pixels add up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from moit.catalog.targets import Target, channels
from moit.kit.recipe import Recipe, no_kit

LEAST_SHADED = 2.0**-12
_LIMIT = (
    "Blocks share what their pixels add up: what is thin or small within one is seen in the mean "
    "of its pixels, and edges of shadows in transparent geometry are as wide as a block."
)
_LEAST = (
    "A fragment that its blocks hide altogether keeps 2.4e-4 of its light, so that pixels that "
    "nothing else covers are not black."
)
_WHERE = (
    "Means are of the picture's own pixels, so that pass 1 draws at its size: what shading reads "
    "shrinks, not what pass 1 writes. Its targets are free once `means` has run, but for a "
    "pixel's own total."
)


def check_blocks(technique: Any, plain: str) -> None:
    """ValueError where a technique's states are of blocks in a way that no kit has. plain : its
    name without options."""
    if technique.block_side == 1 or getattr(technique, "low_resolution", "") == "raster":
        return
    if technique.kind == "moment-transparency":
        why = (
            "a block's state is the mean of its pixels', which have to be drawn at their own "
            "size first; the text reads what a smaller target has by itself"
        )
        raise no_kit(technique, why, f"'{plain}'")
    if technique.upsampling != "bilinear":
        why = "the text reads blocks by their shares alone, not by the depth of what is opaque"
        raise no_kit(technique, why, f"'{plain}(resolution={technique.resolution})'")


def in_blocks(technique: Any, recipe: Recipe) -> Recipe:
    """The same text by means of blocks."""
    side, own = technique.resolution, technique.total == "full"
    text = recipe.made or f'#include "{recipe.text}"\n'
    let_through = Target("r32f", "multiply-complement", 1.0)
    made = f'{text}\n#include "engine/block_means.glsl"\n{_arithmetic(recipe.held, own)}'
    return replace(
        recipe,
        text=f"{recipe.text} of blocks",  # a name of its own, as it includes that
        made=made,
        shaded=recipe.shaded if own else (*recipe.shaded, let_through),
        fixed={
            **recipe.fixed,
            "MEANS_OF_BLOCKS": 1,
            "OWN_TOTAL": int(own),
            **({} if own else {"LEAST_SHADED": f"{LEAST_SHADED:.8g}"}),
        },
        values={**recipe.values, "RESOLUTION": side},
        limits=(*recipe.limits, _LIMIT, *([] if own else [_LEAST]), _WHERE),
        side=side,
        means=tuple(replace(one, blend="replace") for one in recipe.held),
        own_total=own,
    )


MOST_TARGETS = 8  # of a pass, as devices promise
_TYPES = {1: "float", 2: "vec2", 4: "vec4"}


def with_totals(technique: Any, recipe: Recipe, format: str) -> Recipe:
    """The text of waves or wavelets with each pixel's total absorbance in a target of its own, the
    last, as that is else a sum over coefficients. ValueError where that is one too many."""
    if len(recipe.held) == MOST_TARGETS:
        why = (
            f"with a pixel's own total {technique.coefficients} coefficients have nine targets, of "
            "which devices promise eight"
        )
        plain = f"{technique.base_name}(resolution={technique.resolution})"
        raise no_kit(technique, why, f"'{plain}'")
    names = [f"target{i}" for i in range(len(recipe.held))]
    total = f"target{len(names)}"
    renamed = ("sums", "accumulate", "factor", "transmittance_of_sums")
    made = [f"#define {one} {one.removesuffix('_of_sums')}_of_waves" for one in renamed]
    made += [recipe.made or f'#include "{recipe.text}"', *(f"#undef {one}" for one in renamed)]
    types = [_TYPES[channels(one.format)] for one in recipe.held]
    members = " ".join(f"{type} {name};" for type, name in zip(types, names, strict=True))
    of_sums = " ".join(f"o.{one} = t.{one};" for one in names)
    of_waves = " ".join(f"o.{one} = w.{one};" for one in names)
    made += [
        f"""
// What waves have; total absorbance.
struct sums {{ {members} float {total}; }};

sums_of_waves waves_of(sums t) {{ sums_of_waves o; {of_sums} return o; }}

sums accumulate(float z, float alpha) {{
    sums_of_waves w = accumulate_of_waves(z, alpha);
    sums o;
    {of_waves}
    o.{total} = absorbance(alpha);
    return o;
}}

float transmittance_of_sums(sums t, float z, float alpha) {{
    return transmittance_of_waves(waves_of(t), z, alpha);
}}
"""
    ]
    if recipe.text.endswith("wavelet.glsl"):
        made.append("factors factor(sums t) { return factor_of_waves(waves_of(t)); }\n")
    return replace(
        recipe,
        text=f"{recipe.text} with totals",  # a name of its own, as it includes that
        made="\n".join(made),
        held=(*recipe.held, Target(format, "add")),
    )


def _arithmetic(held: Sequence[Target], own: bool) -> str:
    """What adds and scales `sums`, member by member, and mixes four."""
    names = [f"target{i}" for i in range(len(held))]
    added = " ".join(f"o.{one} = a.{one} + b.{one};" for one in names)
    scaled = " ".join(f"o.{one} = s.{one} * scale;" for one in names)
    mixed = "\n".join(
        f"    o.{one} = {_mixed(one, t)};" for one, t in zip(names, held, strict=True)
    )
    text = f"""
// Of two pixels of a block.
sums added(sums a, sums b) {{ sums o; {added} return o; }}

sums scaled(sums s, float scale) {{ sums o; {scaled} return o; }}

// What a pixel reads of the four blocks around it.
sums between(sums a, sums b, sums c, sums d, vec4 share) {{
    sums o;
{mixed}
    return o;
}}
"""
    if not own:
        return text
    return f"""{text}
// With the pixel's own total.
sums scaled_to(sums s, float total) {{
    sums o = scaled(s, total / max(s.{names[-1]}, 1e-30));
    o.{names[-1]} = total;
    return o;
}}
"""


def _mixed(name: str, target: Target) -> str:
    """Of four texels, a member."""
    four = [f"{one}.{name}" for one in "abcd"]
    if channels(target.format) == 4:
        return f"four_weighed({', '.join(four)}, share)"
    if channels(target.format) == 1:
        return f"dot(vec4({', '.join(four)}), share)"
    shares = zip(four, "xyzw", strict=True)
    return " + ".join(f"{one} * share.{part}" for one, part in shares)
