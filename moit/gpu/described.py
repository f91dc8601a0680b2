"""What a technique is as passes: its shader, the room that it needs, and its constants."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from moit import _core
from moit.catalog.by_kind import ByKind
from moit.gpu.bindings import (
    CAPTURE,
    FACTOR,
    SCALE_ALL,
    SCALE_EXCESS,
    SCALE_NOT,
    STEPS_LEVEL,
    STEPS_LINEAR,
    STEPS_LOG,
    STEPS_NONE,
    WEIGHTS_LOST_DOUBLE,
    WEIGHTS_LOST_SINGLE,
)

if TYPE_CHECKING:
    from moit.gpu.device import Device

# How arrays/warp.glsl warps depth; extreme ranges are warped before.
WARPS = {
    "none": STEPS_NONE,
    "level": STEPS_LEVEL,
    "linear": STEPS_LINEAR,
    "log": STEPS_LOG,
    "extreme": STEPS_NONE,
}


@dataclasses.dataclass(frozen=True)
class Stage:
    """One pass that makes a pixel's state, a pixel a thread or, from FRAGMENTS on, a fragment.

    double : whether it computes in double; where the fragments are double all passes do.
    """

    number: int
    double: bool = False


CAPTURED = (Stage(CAPTURE),)
CAPTURED_AND_FACTORED = (Stage(CAPTURE), Stage(FACTOR, double=True))


@dataclasses.dataclass(frozen=True)
class Passes:
    """A technique as its shader has it.

    shader : below shaders/techniques/.
    defines : its own, beside those of shaders/arrays/.
    state, factors : numbers that it keeps of a pixel, as stored and as fragments read them.
    doubles : numbers that it keeps in double while a question takes.
    state_of_fragment : numbers that a pixel's state has for each of its fragments, besides.
    indices : whole numbers that it keeps of a fragment while a question takes.
    stages : what makes them, in order.
    block_stages : what makes the state of blocks of pixels before: in turn, a pixel that blocks
        take a thread, and a block. With block_words a fragment of the image a thread, then a block.
    block_words : whole numbers that a block has, to which all fragments of the image add; 0: blocks
        have a state of the technique's numbers.
    block_means, block_weights : how arrays make states of blocks where a technique has the option
        (`in_blocks`): of numbers that are means; or of those that add up, with these weights to the
        total absorbance, or of maps to what is taken of light. Without either there are none.
    of_farthest_surface : of blocks: the farthest opaque surface of a block's pixels hides what is
        behind it from the block; else from each pixel its own.
    iterations : of loops that a thread runs for a fragment of its pixel, at most.
    uniforms : by name; those that a pass has no use for are passed over.
    double : whether questions are answered in double, whatever the fragments are.
    network : weights that it has, float32, as the core takes them; None: none.
    tables : whether passes are given tables of where slices stand, which the core makes.
    units : whether passes are given how long each pixel's own range of depth is, half of it in the
        image's, which goes from -1 to 1.
    asks : which number of the fragments' precision stands for a depth that a curve is asked at:
        "nearest" to it; "from", none less, where depth is compared alone; "exact": that itself, as
        they are answered in double.
    normalize : whether weights are scaled to sum to what is covered.
    exceeds : whether weights may sum to more, and are scaled then.
    keeps_nearest : whether they find the nearest fragments, opaque ones too, by warped depth.
    absorbs : whether passes can give what is absorbed in front of fragments, too (ABSORBED).
    engine : whether it reads by a text for engines (shaders/engine), in floats alone.
    coloured : with transmission, "curve": fragments are seen through the net coverage and the
        background through products of each channel; "totals": the same, with the technique's own
        totals for each channel; "channels": each channel is an image of its own.
    """

    shader: str
    defines: Mapping[str, str | int] = dataclasses.field(default_factory=dict)
    state: int = 0
    factors: int = 0
    doubles: int = 0
    state_of_fragment: int = 0
    indices: int = 0
    stages: tuple[Stage, ...] = CAPTURED
    block_stages: tuple[Stage, ...] = ()
    block_words: int = 0
    block_means: bool = False
    block_weights: Sequence[float] | None = None
    of_farthest_surface: bool = False
    iterations: int = 16
    uniforms: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    double: bool = False
    network: Any = None
    tables: bool = False
    units: bool = False
    asks: str = "nearest"
    normalize: bool = False
    exceeds: bool = False
    keeps_nearest: bool = False
    absorbs: bool = False
    engine: bool = False
    coloured: str = "channels"

    @property
    def scaling(self) -> int:
        if self.normalize:
            return SCALE_ALL
        return SCALE_EXCESS if self.exceeds else SCALE_NOT

    def defines_on(self, device: Device) -> Mapping[str, str | int]:
        """Those of its texts on a device: engines' have to know whether its fma rounds once."""
        if not self.engine:
            return self.defines
        return {**self.defines, "NOT_FUSED": int(not device.fuses)}

    def absorbed(self) -> Passes:
        """These with what is absorbed in front of fragments for their transmittance, or where they
        cannot, as if all were seen alike."""
        return dataclasses.replace(
            self, defines={**self.defines, "ABSORBED": 1 if self.absorbs else 2}
        )


@dataclasses.dataclass(frozen=True)
class Constants:
    """What the core computes of a technique's fields, for numbers of one precision.

    exact : passes compute what the core computes, to the bit where the device rounds as it does.
        Else those that have a text for engines take that.
    """

    fields: Mapping[str, Any]
    span: tuple[float, float]
    double: bool
    warp: str
    warp_steps: tuple[float, float, float, float, float]
    max_alpha: float
    moments: Any
    exact: bool = True

    @classmethod
    def of(
        cls, fields: dict[str, Any], double: bool, span: tuple[float, float], exact: bool = True
    ) -> Constants:
        constants = _core.pass_constants(fields, double, *span)
        return cls(fields, span, double, *constants, exact=exact or double)

    def uniforms(self, passes: Passes, warped_before: bool = False) -> dict[str, Any]:
        """What all passes are given, whatever they go over."""
        near, low, high, scale, inverse = self.warp_steps
        single = passes.absorbs and not self.double
        lost = WEIGHTS_LOST_SINGLE if single else WEIGHTS_LOST_DOUBLE
        return {
            "max_alpha": self.max_alpha,
            "scaling": passes.scaling,
            "marks": 0,
            "marks_overflows": 0,
            "least_weight": math.ldexp(1.0, -int(lost)),
            "exclude_self": int(self.fields.get("exclude_self", False)),
            "warp": STEPS_NONE if warped_before else WARPS[self.warp],
            "warp_near": near,
            "warp_low": low,
            "warp_high": high,
            "warp_scale": scale,
            "warp_inverse": inverse,
            **passes.uniforms,
        }


# What has passes over arrays: of each kind what makes them of its constants.
passes_for: ByKind[Callable[[Constants], Passes]] = ByKind()
