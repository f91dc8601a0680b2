"""The techniques as passes over arrays of fragments: which shader, and what it is given.

A technique's shader (shaders/techniques/, one a file) has its passes under `#if PASS`; what all of
them share is in shaders/arrays/.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from moit import _core
from moit.catalog import Technique
from moit.checks.exceptions import GpuError
from moit.fragments.fragments import Fragments
from moit.gpu.bindings import (
    BLEND_TAIL,
    BLOCK_FIRST,
    BLOCK_SECOND,
    CAPTURE,
    COVER,
    EXTENT,
    FACTOR,
    FORM_AVERAGE,
    FORM_BLENDED,
    FORM_SUM,
    KEY,
    MIX,
    RANK,
    RATIO_PASS,
    SCALE_ALL,
    SCALE_EXCESS,
    SCALE_NOT,
    SECOND,
    SEEN,
    STEPS_LEVEL,
    STEPS_LINEAR,
    STEPS_LOG,
    STEPS_NONE,
    TAKEN_FIRST,
    TAKEN_SECOND,
    WARPED,
    WEIGH,
    WEIGHT_BLOG,
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
        take a thread, and a block.
    iterations : of loops that a thread runs for a fragment of its pixel, at most.
    uniforms : by name; those that a pass has no use for are passed over.
    double : whether questions are answered in double, whatever the fragments are.
    network : weights that it has, float32, as the core takes them; None: none.
    asks : which number of the fragments' precision stands for a depth that a curve is asked at:
        "nearest" to it; "from", none less, where depth is compared alone; "exact": that itself, as
        they are answered in double.
    normalize : whether weights are scaled to sum to what is covered.
    exceeds : whether weights may sum to more, and are scaled then.
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
    iterations: int = 16
    uniforms: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    double: bool = False
    network: Any = None
    asks: str = "nearest"
    normalize: bool = False
    exceeds: bool = False
    absorbs: bool = False
    engine: bool = False
    coloured: str = "channels"

    @property
    def scaling(self) -> int:
        if self.exceeds:
            return SCALE_EXCESS
        return SCALE_ALL if self.normalize else SCALE_NOT

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


def kinds() -> tuple[str, ...]:
    """The kinds of techniques that have passes."""
    return tuple(_FAMILIES)


def passes_of(technique: Technique, constants: Constants) -> Passes:
    """Raises GpuError where there are none."""
    make = _FAMILIES.get(technique.kind)
    if make is None:
        raise GpuError(
            f"technique: {technique} has no passes for device='gpu'; use device='cpu', or one of "
            f"{', '.join(_FAMILIES)}"
        )
    passes = make(constants)
    sizes = {
        "STATE_SIZE": passes.state,
        "FACTORS_SIZE": passes.factors,
        "DOUBLES_SIZE": passes.doubles,
        "INDICES_SIZE": passes.indices,
    }

    defines = {
        "ABSORBED": 0,
        **passes.defines,
        **{name: f"{size}u" for name, size in sizes.items()},
    }
    return dataclasses.replace(passes, defines=defines)


def has_engine_text(technique: Technique) -> bool:
    """Whether a device reads it by a text for engines unless exact passes are asked for."""
    if technique.engine != "core" or technique.kind not in _FAMILIES:
        return False
    empty = np.zeros(0, np.float32)
    none = Fragments([0, 0], empty, empty, np.zeros((0, 3), np.float32), depth_range=(1.0, 2.0))
    constants = Constants.of(technique.fields_for(none), False, none.depth_range, exact=False)
    return passes_of(technique, constants).engine


# Numbers in factors of texts for engines, by nodes, and b0 (shaders/arrays/engine_moments.glsl).
_ENGINE_FACTORS = {2: 9, 3: 9, 4: 11}
# That these texts know: MBOIT's wrapping zone, pi / 10, as `turns` of `Constants.moments`.
_ENGINE_TURNS = 0.25 - 0.1 / 8


def _reads_as_engines(c: Constants) -> bool:
    return not c.exact and c.fields["bits"] == 32


def _moment_defines(c: Constants, engine: bool) -> dict[str, str | int]:
    return {
        "BITS": c.fields["bits"],
        "B0_IS_HALF": int(c.fields["b0_is_half"]),
        "ENGINE": int(engine),
        "EXCLUDE_SELF": int(c.fields.get("exclude_self", False)),
    }


def _power_moments(c: Constants) -> Passes:
    bias, least, safe, _, _ = c.moments
    count = c.fields["count"]
    engine = _reads_as_engines(c)
    return Passes(
        "power_moments.glsl",
        {"NODES": count // 2, "BOUNDED": 0, **_moment_defines(c, engine)},
        state=count + 1,
        factors=_ENGINE_FACTORS[count // 2] if engine else 3 * (count // 2) + 2,
        stages=(Stage(CAPTURE), Stage(FACTOR, double=not engine)),
        uniforms={
            "bias": bias,
            "safe": safe[:count],
            "least": least,
            "beta": c.fields["overestimation"],
            "engine_max_alpha": c.max_alpha,
        },
        normalize=c.fields["normalize"],
        absorbs=True,
        engine=engine,
        coloured="curve",
    )


def _bounded_neural(c: Constants) -> Passes:
    fields = {**c.fields, "b0_is_half": False, "overestimation": 0.0}
    moments = _power_moments(dataclasses.replace(c, fields=fields, exact=True))
    return dataclasses.replace(
        moments,
        defines={**moments.defines, "BOUNDED": 1},
        factors=moments.factors + 11,
        iterations=64,
        network=c.fields["network"],
    )


def _neural_moments(c: Constants) -> Passes:
    return Passes(
        "neural.glsl",
        {"WORDS": int(c.fields["range_in_words"])},
        state_of_fragment=1,
        factors=8,
        stages=(Stage(EXTENT), *CAPTURED_AND_FACTORED, Stage(WEIGH)),
        network=c.fields["network"],
        normalize=c.fields["normalize"],
        coloured="curve",
    )


def _deep_fragments(c: Constants) -> Passes:
    return Passes(
        "dfa.glsl",
        state=18,
        factors=3,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE), Stage(BLEND_TAIL), Stage(MIX)),
        network=c.fields["network"],
    )


def _trigonometric_moments(c: Constants) -> Passes:
    bias, least, _, (turns, edge, scale), middle = c.moments
    count = c.fields["count"]
    engine = _reads_as_engines(c) and abs(turns - _ENGINE_TURNS) < 1e-9
    if engine:  # whose angles are from z = 0, as sums are before they are turned
        middle = [1.0, 0.0] * count
    return Passes(
        "trigonometric_moments.glsl",
        {"NODES": count, **_moment_defines(c, engine)},
        state=2 * count + 1,
        factors=_ENGINE_FACTORS[count] if engine else 5 * count + 4,
        stages=(Stage(CAPTURE), Stage(FACTOR, double=not engine)),
        uniforms={
            "half_angle": turns * (4.0 * math.pi),
            "quarter_angle": turns * math.pi,
            "middle": middle[: 2 * count],
            "zone_turns": turns,
            "zone_edge": edge,
            "zone_scale": scale,
            "bias": bias,
            "least": least,
            "beta": c.fields["overestimation"],
            "engine_max_alpha": c.max_alpha,
        },
        normalize=c.fields["normalize"],
        absorbs=True,
        engine=engine,
        coloured="curve",
    )


def _moment_transparency(c: Constants) -> Passes:
    bias, least, safe, _, _ = c.moments
    twice, blocks = c.fields["passes"] == 2, c.fields["resolution"] > 1
    by_fragment = twice and not blocks
    stages: tuple[Stage, ...] = CAPTURED_AND_FACTORED
    of_blocks: tuple[Stage, ...] = ()
    if by_fragment:
        # z of fragments; moments; what these leave of fragments; moments of that
        stages = (Stage(WARPED), Stage(CAPTURE, double=True), Stage(SEEN, double=True))
        stages += (Stage(SECOND, double=True), Stage(FACTOR, double=True))
    if blocks:
        of_blocks = (Stage(TAKEN_FIRST), Stage(BLOCK_FIRST, double=True))
        of_blocks += (Stage(TAKEN_SECOND), Stage(BLOCK_SECOND, double=True)) if twice else ()
    if twice:
        stages += (Stage(RATIO_PASS),)
    return Passes(
        "moment_transparency.glsl",
        {
            "PASSES": c.fields["passes"],
            "STORAGE": c.fields["storage"],
            "SYMMETRIC": int(c.fields["symmetric"]),
            "OF_BLOCKS": int(blocks),
        },
        state=5 * c.fields["passes"],
        factors=9,
        doubles=6 if by_fragment else 0,
        state_of_fragment=int(by_fragment),
        indices=2 if by_fragment else 0,
        stages=stages,
        block_stages=of_blocks,
        uniforms={
            "shrink": 1.0 - c.max_alpha,
            "bias": bias,
            "safe": safe[:4],
            "least": least,
            "beta": c.fields["overestimation"],
        },
        normalize=c.fields["normalize"],
        absorbs=not twice,
        coloured="curve",
    )


def _fourier_opacity(c: Constants) -> Passes:
    count = c.fields["count"]
    return Passes(
        "fourier_opacity.glsl",
        {"HARMONICS": count // 2, "BITS": c.fields["bits"]},
        state=count,
        factors=count,
        stages=CAPTURED_AND_FACTORED,
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


def _transmittance_function_map(c: Constants) -> Passes:
    count = c.fields["count"]
    return Passes(
        "transmittance_function_map.glsl",
        {"COSINES": count, "BITS": c.fields["bits"]},
        state=count,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        iterations=3 * count + 16,
        normalize=c.fields["normalize"],
        coloured="curve",
    )


def _sorted(c: Constants) -> Passes:
    return Passes(
        "sorted.glsl",
        state_of_fragment=1,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        asks="from",
    )


def _unsorted(c: Constants) -> Passes:
    return Passes("unsorted.glsl")


# weighted.glsl has all defines in each FORM.
def _weighted(form: int, c: Constants, stages: tuple[Stage, ...], **defines: int) -> Passes:
    near, far = c.span
    return Passes(
        "weighted.glsl",
        {"FORM": form, "WEIGHT": WEIGHT_BLOG, "BITS": 32, **defines},
        doubles=1,
        stages=stages,
        uniforms={
            "depth_scale": c.fields.get("depth_scale", 1.0),
            "depth_near": near,
            "buffer_scale": far / (far - near) if near < far else 0.0,
        },
        coloured="totals",
    )


def _weighted_sum(c: Constants) -> Passes:
    return _weighted(FORM_SUM, c, CAPTURED_AND_FACTORED)


def _weighted_average(c: Constants) -> Passes:
    return _weighted(FORM_AVERAGE, c, CAPTURED_AND_FACTORED)


def _weighted_blended(c: Constants) -> Passes:
    own = {"WEIGHT": c.fields["weight"], "BITS": c.fields["bits"]}
    return _weighted(FORM_BLENDED, c, CAPTURED, **own)


def _adaptive(c: Constants) -> Passes:
    nodes = c.fields["count"]
    return Passes(
        "adaptive.glsl",
        {"STEPS": nodes, "QUANTIZED": int(c.fields["quantized"])},
        state=2 * nodes,
        iterations=3 * nodes + 16,
        exceeds=True,
        coloured="totals",
    )


def _mlab(c: Constants) -> Passes:
    layers = c.fields["count"]
    least = c.fields["min_alpha"]
    return Passes(
        "mlab.glsl",
        {"STEPS": layers, "QUANTIZED": int(c.fields["quantized"])},
        state=5 * layers,
        factors=2 * layers,
        stages=(Stage(CAPTURE), Stage(FACTOR)),
        iterations=2 * layers + 16,
        uniforms={"least": least if c.double else _at_least(least)},
    )


def _depth_peeling(c: Constants) -> Passes:
    return Passes(
        "depth_peeling.glsl",
        {"LAYERS": c.fields["count"]},
        iterations=c.fields["count"] + 16,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        asks="from",
    )


def _hybrid(c: Constants) -> Passes:
    return Passes(
        "hybrid.glsl",
        {"LAYERS": c.fields["count"]},
        iterations=c.fields["count"] + 16,
        factors=1,
        doubles=2,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE), Stage(FACTOR, double=True)),
    )


def _kbuffer(c: Constants) -> Passes:
    return Passes(
        "kbuffer.glsl",
        {"LAYERS": c.fields["count"]},
        state_of_fragment=1,
        indices=1,
        stages=CAPTURED_AND_FACTORED,
        iterations=c.fields["count"] + 16,
    )


def _deep_shadow(c: Constants) -> Passes:
    return Passes(
        "deep_shadow.glsl",
        state=6,
        state_of_fragment=6,
        doubles=1,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE, double=True)),
        iterations=32,
        uniforms={"tolerance": c.fields["tolerance"]},
        double=True,
        asks="exact",
        normalize=c.fields["normalize"],
        coloured="curve",
    )


def _wavelet(c: Constants) -> Passes:
    coefficients = c.fields["count"]
    return Passes(
        "wavelet.glsl",
        {
            "LEVELS": coefficients.bit_length() - 1,
            "DENSITY": int(c.fields["density"]),
            "BITS": c.fields["bits"],
        },
        state=coefficients,
        factors=coefficients,
        stages=CAPTURED_AND_FACTORED,
        iterations=2 * coefficients + 8,
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


SAMPLED = (Stage(KEY), Stage(COVER), Stage(CAPTURE))


def _stochastic(c: Constants) -> Passes:
    samples = c.fields["count"]
    return Passes(
        "stochastic.glsl",
        {"SAMPLES": samples, "STRATIFIED": int(c.fields["stratified"]), "HASHED_ALPHA": 0},
        state=samples,
        indices=3,
        stages=SAMPLED,
        iterations=samples + 16,
        uniforms={"seed": c.fields["seed"]},
        asks="from",
        normalize=c.fields["normalize"],
        coloured="curve",
    )


def _hashed_alpha(c: Constants) -> Passes:
    return Passes(
        "stochastic.glsl",
        {"SAMPLES": 1, "STRATIFIED": 0, "HASHED_ALPHA": 1},
        state=1,
        indices=3,
        stages=SAMPLED,
        uniforms={"seed": c.fields["seed"]},
        asks="from",
    )


def _at_least(x: float) -> float:
    """The least float that is not below x."""
    near = np.float32(x)  # which NumPy would compare with x in float32
    return float(near if float(near) >= x else np.nextafter(near, np.float32(np.inf)))


_FAMILIES: dict[str, Callable[[Constants], Passes]] = {
    "sorted": _sorted,
    "unsorted": _unsorted,
    "weighted-sum": _weighted_sum,
    "weighted-average": _weighted_average,
    "wboit": _weighted_blended,
    "power": _power_moments,
    "neural": _neural_moments,
    "dfa": _deep_fragments,
    "neural-bounded": _bounded_neural,
    "moment-transparency": _moment_transparency,
    "trig": _trigonometric_moments,
    "fourier": _fourier_opacity,
    "transmittance-function-map": _transmittance_function_map,
    "adaptive": _adaptive,
    "mlab": _mlab,
    "depth-peeling": _depth_peeling,
    "hybrid": _hybrid,
    "kbuffer": _kbuffer,
    "deep-shadow": _deep_shadow,
    "wavelet": _wavelet,
    "stochastic": _stochastic,
    "hashed-alpha": _hashed_alpha,
}
