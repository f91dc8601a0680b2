"""How a device makes a picture of triangles by a technique, settled before anything is drawn."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from moit.catalog import MomentTechnique
from moit.checks.exceptions import GpuError
from moit.gpu.bindings import SOFTWARE_ITERATIONS
from moit.gpu.described import Constants, Passes
from moit.gpu.drawn import Drawn, drawn_of
from moit.gpu.moment_passes import extents_are_words
from moit.gpu.passes import passes_of
from moit.gpu.slice_lists import SlicedPicture

if TYPE_CHECKING:
    from moit.catalog import Technique
    from moit.gpu.device import Device

FETCHES = "GL_EXT_shader_framebuffer_fetch"
INTERLOCKS = "GL_ARB_fragment_shader_interlock"
WAYS = ("interlock", "fetch", "replay")


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A way to make a picture, or why there is none.

    reason : why it cannot, and fragments have to be listed for passes over arrays, or the core;
        then there is no more in it. "" where it can.
    way : "add", or one of WAYS.
    passes, drawn : those over arrays, and over triangles where there are any.
    target : the format of colours.
    """

    reason: str = ""
    way: str = "replay"
    passes: Passes | None = None
    drawn: Drawn | None = None
    constants: Constants | None = None
    target: str = ""


def plan_of(
    device: Device,
    technique: Technique,
    fields: dict[str, Any],
    span: tuple[float, float],
    target: str,
    ordered: str | None,
    size: tuple[int, int],
    *,
    listed: bool,
    joined: bool,
    exact: bool,
) -> Plan:
    """listed : fragments have to be, as what of each light comes to them is known of lists only.
    joined : smaller pictures are added to targets.
    exact : passes compute with the core's kernels; else by texts for engines where there are any.

    Raises GpuError where the device lacks the way that is asked for.
    """
    if technique.engine != "core":
        return Plan("it has no passes of its own")
    if "weights" in fields:
        return Plan("weights are those of a function in Python")
    constants = Constants.of(fields, False, span, exact)
    try:
        passes = passes_of(technique, constants)
    except GpuError as error:
        return Plan(str(error))
    own = fields.get("range_per_pixel") and not extents_are_words(fields)
    if constants.warp == "extreme" or (constants.warp != "none" and own):
        return Plan("depth is warped by the core")
    if fields.get("small_keys"):
        return Plan("depth and alpha are rounded to keys by the core")
    drawn = drawn_of(technique, constants, target)
    way = "replay" if listed or drawn is None else _way(device, drawn, ordered)
    sliced = SlicedPicture(fields, *size) if passes.tables else None
    if way == "replay" and passes.block_stages and not sliced:
        return Plan("blocks of pixels have state of their own")
    if sliced and fields.get("depth_aware"):
        return Plan("blocks are weighted by opaque surfaces that the core finds")
    if joined and way != "add":
        return Plan("targets are joined, and lists of fragments are not")
    if way == "add" and isinstance(technique, MomentTechnique) and technique.bias is None:
        blended = {**fields, "bias": technique.blended_bias}
        constants = Constants.of(blended, False, span, exact)
        passes = passes_of(technique, constants)
    side = 1 if drawn is None or way == "replay" else drawn.block_side
    if device.software and side > 1 and side * side > SOFTWARE_ITERATIONS // 2:
        return Plan("loops are not sure to reach all pixels of a block")
    needed = picture_sizes(passes, size[0] * size[1])
    if sliced:
        needed |= sliced.sizes(passes)
    if drawn is not None and way == "interlock":
        needed["targets"] = 4 * size[0] * size[1] * drawn.numbers
    if drawn is not None and way == "add":
        needed["words"] = 4 * size[0] * size[1] * drawn.words
        needed["doubles"] = 8 * size[0] * size[1] * passes.doubles
    return Plan(too_large(device, needed), way, passes, drawn, constants, target)


def _way(device: Device, drawn: Drawn, asked: str | None) -> str:
    """How a pixel's numbers come about: they add up, or one of WAYS."""
    if asked == "replay":
        return "replay"
    if not drawn.ordered:
        return "add"
    has = {
        "interlock": INTERLOCKS in device.info["extensions"],
        "fetch": FETCHES in device.info["extensions"]
        and len(drawn.formats) <= device.info["color_targets"],
        "replay": True,
    }
    if asked is None:
        return next(way for way in WAYS if has[way])
    if not has[asked]:
        name = {"interlock": INTERLOCKS, "fetch": FETCHES}[asked]
        raise GpuError(
            f"ordered: {device.renderer} has no {name}, which {asked!r} needs; use "
            f"{next(way for way in WAYS if has[way])!r}"
        )
    return asked


def picture_sizes(passes: Passes, pixels: int) -> dict[str, int]:
    """Bytes of the buffers that each picture has."""
    return {
        "image": 16 * pixels,
        "state": 4 * pixels * passes.state,
        "factors": 4 * pixels * passes.factors,
        "totals": 32 * pixels,
    }


def replay_sizes(passes: Passes, pixels: int, count: int) -> dict[str, int]:
    """Bytes of the buffers of a picture that has so many fragments, listed."""
    return {
        "behind": 24 * pixels,
        "state": 4 * (passes.state * pixels + passes.state_of_fragment * count),
        "doubles": 8 * pixels * passes.doubles,
        "indices": 4 * count * passes.indices,
    }


def too_large(device: Device, needed: dict[str, int]) -> str:
    """Which buffer a pass could not see; "" where it sees all."""
    return next(
        (
            f"{name} takes {size} bytes"
            for name, size in needed.items()
            if size > device.storage_bytes
        ),
        "",
    )
