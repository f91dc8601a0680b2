"""Techniques of moments as passes, exact or by texts for engines (shaders/engine)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from moit import _core
from moit.catalog import (
    BoundedNeural,
    PowerMoments,
    Technique,
    TrigonometricMoments,
    TwoMoments,
)
from moit.gpu.bindings import (
    BLOCK_SECOND,
    CAPTURE,
    EXTENT,
    FACTOR,
    KEEP,
    RANK,
    RATIO_PASS,
    SECOND,
    SEEN,
    TAKEN_SECOND,
    WARPED,
    WEIGH,
)
from moit.gpu.block_passes import KEPT, READ, TOTAL
from moit.gpu.described import CAPTURED_AND_FACTORED, Constants, Passes, Stage, passes_for

# Of each kind its name, at its number.
KINDS = [row["kind"] for row in _core.technique_facts()]

# Numbers in factors of texts for engines, by nodes, and b0 (shaders/arrays/engine_moments.glsl).
_ENGINE_FACTORS = {2: 9, 3: 9, 4: 11}
# That these texts know: MBOIT's wrapping zone, pi / 10, as `turns` of `Constants.moments`.
_ENGINE_TURNS = 0.25 - 0.1 / 8


def _reads_as_engines(c: Constants) -> bool:
    return not c.exact and c.fields["bits"] == 32 and not c.fields.get("halves")


def _moment_defines(c: Constants, engine: bool) -> dict[str, str | int]:
    return {
        "BITS": c.fields["bits"],
        "B0_IS_HALF": int(c.fields["b0_is_half"]),
        "ENGINE": int(engine),
        "EXCLUDE_SELF": int(c.fields.get("exclude_self", False)),
    }


def extents_are_words(fields: Mapping[str, Any]) -> bool:
    """Whether passes find each pixel's own range of depth, and hold it in words of 16 bits."""
    return bool(fields.get("halves") and fields.get("range_per_pixel"))


@passes_for("power")
def power_moments(c: Constants) -> Passes:
    bias, least, safe, _, _ = c.moments
    count = c.fields["count"]
    engine = _reads_as_engines(c) and count > 2  # of two moments there is no text
    own = extents_are_words(c.fields)
    factors = _ENGINE_FACTORS[count // 2] if engine else 3 * (count // 2) + 2
    return Passes(
        "power_moments.glsl",
        {
            "NODES": count // 2,
            "BOUNDED": 0,
            "HALVES": int(c.fields["halves"]),
            "OWN_EXTENT": int(own),
            "OWN_UNITS": 0,
            "LAYERS": 0,
            **_moment_defines(c, engine),
        },
        state=count + 1,
        factors=factors + (2 if own else 0),
        stages=(
            *((Stage(EXTENT),) if own else ()),
            Stage(CAPTURE),
            Stage(FACTOR, double=not engine),
        ),
        uniforms={
            "bias": bias,
            "safe": safe[:count],
            "least": least,
            "beta": c.fields["overestimation"],
            "engine_max_alpha": c.max_alpha,
        },
        block_means=True,
        normalize=c.fields["normalize"],
        absorbs=True,
        engine=engine,
        coloured="curve",
    )


@passes_for("neural-bounded")
def bounded_neural(c: Constants) -> Passes:
    fields = {**c.fields, "b0_is_half": False, "overestimation": 0.0}
    units = bool(c.fields["range_per_pixel"]) and not extents_are_words(c.fields)
    # engines' text has four moments, in the image's range or in words
    exact = c.exact or c.fields["count"] != 4 or units
    moments = power_moments(dataclasses.replace(c, fields=fields, exact=exact))
    return dataclasses.replace(
        moments,
        defines={**moments.defines, "BOUNDED": 1, "OWN_UNITS": int(units)},
        factors=moments.factors + (8 if moments.engine else 11),
        iterations=64,
        units=units,
        network=c.fields["network"],
    )


@passes_for("strong")
def strong(c: Constants) -> Passes:
    """Moments of all that is not kept, as bounded networks read them, and what is."""
    kept, large = c.fields["count"], c.fields["large_keys"]
    dtype = np.dtype(np.float64 if c.double else np.float32)
    rest = BoundedNeural("power6", storage="half", depth_range="pixel").fields_for_core(dtype)
    bias, least, safe, _, _ = Constants.of(rest, c.double, c.span).moments
    return Passes(
        "strong.glsl",
        {"ANCHORS": kept, "LARGE_KEYS": int(large), "NODES": 3},
        state=7,
        factors=24 + 2 * kept,
        indices=2 + (1 + large) * kept,
        stages=(Stage(EXTENT), *(() if large else (Stage(KEEP),)), *CAPTURED_AND_FACTORED),
        iterations=60 + kept,
        uniforms={
            "bias": bias,
            "safe": safe[:6],
            "least": least,
            "importance_decay": c.fields["gamma"],
            "shrink": 1.0 - c.max_alpha,
        },
        network=c.fields["network"],
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


def _power_of(count: int) -> PowerMoments:
    return PowerMoments(count) if count > 2 else TwoMoments(storage=None)


@passes_for("front")
def front(c: Constants) -> Passes:
    """Moments of the fragments behind the nearest."""
    layers, count = c.fields["count"], c.fields["moment_count"]
    kind = KINDS[c.fields["tail"]]
    tail: Technique = _TAILS[kind](count)
    fields = tail.fields_for_core(np.dtype(np.float64 if c.double else np.float32))
    own = ("kind", "count")
    fields |= {name: c.fields[name] for name in fields if name in c.fields and name not in own}
    constants = Constants.of(fields, c.double, c.span)
    passes = passes_for[kind](constants)
    published = _core.bias(fields, "published")
    return dataclasses.replace(
        passes,
        defines={**passes.defines, "LAYERS": layers},
        doubles=2 * layers,
        indices=1,
        stages=(Stage(RANK), *CAPTURED_AND_FACTORED),
        iterations=max(passes.iterations, 2 * layers + 32),
        uniforms={
            **passes.uniforms,
            "safe": constants.moments[2][: passes.state - 1],
            "covering": published * (2e-8 if c.double else 1.0),
            "least_tail": 2.0 ** (-43 if c.double else -20),
            "scales_tail": int(c.fields["normalize"]),
        },
        keeps_nearest=True,
        absorbs=False,
    )


@passes_for("neural")
def neural_moments(c: Constants) -> Passes:
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


@passes_for("trig")
def trigonometric_moments(c: Constants) -> Passes:
    bias, least, _, (turns, edge, scale), middle = c.moments
    count = c.fields["count"]
    engine = _reads_as_engines(c) and abs(turns - _ENGINE_TURNS) < 1e-9
    if engine:  # whose angles are from z = 0, as sums are before they are turned
        middle = [1.0, 0.0] * count
    return Passes(
        "trigonometric_moments.glsl",
        {"NODES": count, "LAYERS": 0, **_moment_defines(c, engine)},
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
        block_means=True,
        normalize=c.fields["normalize"],
        absorbs=True,
        engine=engine,
        coloured="curve",
    )


# What reads so many moments behind the nearest.
_TAILS: dict[str, Callable[[int], Technique]] = {
    "power": _power_of,
    "trig": TrigonometricMoments,
    "neural-bounded": lambda count: BoundedNeural(f"power{count}"),
}


@passes_for("moment-transparency")
def moment_transparency(c: Constants) -> Passes:
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
        stages = (READ, Stage(FACTOR, double=True), TOTAL)
        of_blocks = (Stage(CAPTURE), KEPT)
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
            "BLOCK_SETS": f"{c.fields['passes']}u",
            "BLOCK_MEANS": 1,
            "FULL_TOTAL": 0,
        },
        state=5 * c.fields["passes"],
        factors=9,
        doubles=6 if by_fragment else 0,
        state_of_fragment=int(by_fragment),
        indices=2 if by_fragment else 0,
        stages=stages,
        block_stages=of_blocks,
        of_farthest_surface=True,
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
