"""Kits of techniques that give each pixel the range of its own fragments' depths: one more pass, of
the least and the greatest, before all others."""

from __future__ import annotations

from dataclasses import replace

from moit.catalog import Technique
from moit.catalog.targets import Target
from moit.kit.recipe import Recipe, no_kit

# The greatest of -depth and of depth. It begins at less than any float that has a logarithm.
EXTENTS = (Target("rg32f", "max", -3e38),)
# Words are of the way from either end of depth.
WORDS = (Target("rg16", "max"),)
_CAMERAS = ("WARP_SCALE", "WARP_OFFSET")
LIMITS = (
    "Both passes over geometry that read a pixel's range have to give a fragment the depth that "
    "the pass `extents` gave it, to the last digit: by the same vertex shader, with positions that "
    "are invariant. What lies beyond the range counts as at its ends.",
    "A fragment that comes or goes moves the whole range of its pixel: where surfaces end, what "
    "moments cannot tell apart changes at once.",
)


def is_in_own_range(technique: Technique) -> bool:
    """Raises ValueError where that has no kit. What atomics gather says so itself."""
    if not technique.range_per_pixel or technique.uses_atomics:
        return False
    if technique.kind == "neural":  # its text has words for extents, which its network was fed
        return False
    plain = f"'{technique.base_name}'"
    if getattr(technique, "in_halves", False):
        why = (
            "the core rounds each pixel's own extent to words where moments are half floats; the "
            "text has extents of floats, for moments of floats"
        )
        raise no_kit(technique, why, plain)
    if technique.kind in ("power", "trig") and getattr(technique, "bits", 32) == 16:
        why = (
            "fragments change words in the order of triangles, by a text that takes z in the "
            "camera's range; each pixel's own extent goes with moments of floats"
        )
        name = technique.base_name.removesuffix("-16")
        raise no_kit(technique, why, f"\"{name}(depth_range='pixel')\"")
    return True


def in_own_range(recipe: Recipe, network: bool = False) -> Recipe:
    """The same text by each pixel's own range of depth.

    network : whether one reads factors, that knows deviations in the camera's range.
    """
    text = recipe.made or f'#include "{recipe.text}"\n'
    gone: tuple[str, ...] = _CAMERAS
    behind = '#include "engine/own_range.glsl"\n'
    if network:
        renamed = ("factor", "transmittance_of_sums")
        made = [*(f"#define {one} {one}_in_one" for one in renamed), text]
        text = "\n".join([*made, *(f"#undef {one}" for one in renamed), ""])
        factor = "factor_within(t" if recipe.text.endswith("6.glsl") else "factor_of(t, t.target1"
        gone, behind = _CAMERAS[1:], f"{behind}{_OF_NETWORKS.replace('FACTOR(t', factor)}"
    values = {name: one for name, one in recipe.values.items() if name not in gone}
    return replace(
        recipe,
        text=f"{recipe.text} in each pixel's own range",  # a name of its own, as it includes that
        made=f"{text}\n{behind}",
        values=values,
        extents=EXTENTS,
        limits=(*recipe.limits, *LIMITS),
    )


_OF_NETWORKS = """
// What the fragments of a pixel share, by their moments and its range.
factors factor(sums t, extents e) { return FACTOR(t, unit_of(e)); }

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, extents e, float z, float alpha) {
    return transmittance(factor(t, e), z, alpha);
}
"""
