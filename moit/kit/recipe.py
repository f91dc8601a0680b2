"""What a recipe for a kit is: a text of shaders/engine, and all that is decided about it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

from moit.catalog import Technique
from moit.catalog.by_kind import ByKind
from moit.catalog.targets import Target
from moit.kit.gathered import THREADS, Program
from moit.kit.memory import Memory

# What an engine calls, in this order, as far as a text has it.
ENTRIES = (
    "warped",
    "extents_of",
    "warped_within",
    "accumulate",
    "accumulate_color",
    "inserted",
    "is_behind",
    "covered_samples",
    "factor",
    "accumulate_second",
    "factor_second",
    "transmittance",
    "transmittance_of_sums",
    "shaded",
    "resolve",
    "resolve_color",
    "resolve_layers",
)
_LAST = ("shaded", "resolve", "resolve_color")
# What interpolates between texels of small targets (moit.kit.small_targets).
BETWEEN = ("texel_before", "shares_of_texels", "between", "between_second")
# What makes means of blocks, and scales them (moit.kit.block_means).
MEANS = ("added", "scaled", "scaled_to")
# Shapes of techniques that the depth test sorts: by drawing again, by samples of a pixel, by what
# is left of all fragments.
PEELED, SAMPLED, HASHED = "peeled", "sampled", "hashed"
DEPTH_RANGE = (0.1, 1000.0)  # of a camera, where none is said


@dataclasses.dataclass(frozen=True)
class State:
    """What a pixel keeps that its fragments change one after the other.

    clears : of each word of 32 bits, what it is at first.
    takes_color : whether fragments bring their colours.
    warps : whether fragments bring `warped` depth; else depth as it is.
    has_factors : whether transmittance is read by factors, which a pass may make once a pixel.
    """

    clears: tuple[int, ...]
    takes_color: bool = False
    warps: bool = False
    has_factors: bool = False


@dataclasses.dataclass(frozen=True)
class Recipe:
    """A technique as a text for engines.

    text : below shaders/.
    held : targets of pass 1, in the order of the members of `sums`; () where one pass does all.
    shaded : of the pass that shades, likewise.
    second : of a pass between, which reads what pass 1 left; members of `seconds`.
    fixed : defines that are decided here.
    values : defaults of options, which an engine may set otherwise.
    arrays : constants that the text reads by name: of networks.
    buffers : the same of what is too much for constants, as rows of four (moit.kit.buffers).
    never_negative : of structs what no pixel has below 0, {0} standing for one (moit.kit.wgsl).
    factor_formats : of targets that a pass for factors writes, where they are not of 32-bit floats.
    limits : what an engineer has to know.
    depth_range : of a camera, which made defaults.
    made : the text itself, where there is no such file.
    shape, count : PEELED, in so many rounds; SAMPLED, so many samples; HASHED; "" where blending
        or order makes it.
    side : of blocks of pixels that have a texel each of `held` and `second`; 1: targets are of the
        picture's size.
    means : of blocks: `held` is of the picture's size, and these, with a texel for each block, take
        the means of its pixels in a pass between.
    own_total : whether pixels have their own total absorbance beside, the last of `held`.
    state : words that fragments change in order; `held` is then what leaves them is blended to.
    extents : of a pass before all others, of each pixel's own range of depth (moit.kit.own_range),
        which stands for the camera's.
    memory, programs : arrays that all fragments share and change by atomics, and the passes that
        do; () where blending, order or depth tests make it.
    """

    text: str
    held: tuple[Target, ...]
    shaded: tuple[Target, ...]
    fixed: Mapping[str, object] = dataclasses.field(default_factory=dict)
    values: Mapping[str, float | int] = dataclasses.field(default_factory=dict)
    arrays: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    buffers: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    never_negative: Mapping[str, str] = dataclasses.field(default_factory=dict)
    factor_formats: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    depth_range: tuple[float, float] = DEPTH_RANGE
    made: str = ""
    state: State | None = None
    shape: str = ""
    count: int = 0
    second: tuple[Target, ...] = ()
    side: int = 1
    means: tuple[Target, ...] = ()
    own_total: bool = False
    extents: tuple[Target, ...] = ()
    memory: tuple[Memory, ...] = ()
    programs: tuple[Program, ...] = ()

    @property
    def passes(self) -> int:
        """Over transparent geometry."""
        if self.programs:
            return sum(one.where != THREADS for one in self.programs)
        if self.shape:
            return 3 if self.shape == SAMPLED else self.count + bool(self.held)
        if self.state:
            return 2 if self.shaded else 1
        return 2 + bool(self.second) + bool(self.extents) if self.held else 1

    @property
    def by_factors(self) -> tuple[str, ...]:
        """What stands for the call of the pass that shades where another makes factors."""
        both = any("transmittance_of_sums" in one.functions for one in self.programs)
        return ("factor", "transmittance") if both else ()

    @property
    def fetching(self) -> tuple[str, ...]:
        """What the include itself calls where it fetches numbers of targets."""
        if self.means:
            return (*BETWEEN, *MEANS)
        return BETWEEN if self.side > 1 else ()

    @property
    def entries(self) -> tuple[str, ...]:
        """What an engine calls, as far as the text has it."""
        if self.programs:
            own = [function for one in self.programs for function in one.functions]
            return tuple(dict.fromkeys(("warped", *own, *self.by_factors, *_LAST)))
        if self.state is None:
            return tuple(one for one in ENTRIES if one != "warped" or not self.extents)
        first = (*(["warped"] if self.state.warps else []), "inserted")
        if self.state.has_factors:
            read = ("factor_of_words", "transmittance", "transmittance_of_words")
            return (*first, *read, "shaded", "resolve_words")
        second = ("transmittance", "shaded", "resolve") if self.shaded else ("resolve_layers",)
        return (*first, *second)


# Of each kind that has a kit what makes its recipe, for a camera's range of depth.
recipe_for: ByKind[Callable[[Any, tuple[float, float]], Recipe]] = ByKind()


def no_kit(technique: Technique, why: str, nearest: str, where: str = "") -> ValueError:
    return ValueError(f"technique: {technique} has no kit{where}: {why}; nearest is {nearest}")


def warp_constants(
    technique: Technique, depth_range: tuple[float, float]
) -> dict[str, float | int]:
    """The two constants that take depth to [-1, 1], and whether its logarithm is taken; none where
    the text takes depth as it is."""
    warp, unit = technique.depth_warp, technique.unit_range
    if warp is None:
        return {}
    near, far = unit if warp == "none" and unit else depth_range
    if warp != "log":
        scale = 2.0 / (far - near)
        return {"WARP_LOG": 0, "WARP_SCALE": scale, "WARP_OFFSET": -1.0 - scale * near}
    scale = 2.0 / math.log2(far / near)
    return {"WARP_LOG": 1, "WARP_SCALE": scale, "WARP_OFFSET": -1.0 - scale * math.log2(near)}
