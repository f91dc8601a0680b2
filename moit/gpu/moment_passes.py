"""Techniques of moments as passes, exact or by texts for engines (shaders/engine)."""

from __future__ import annotations

import dataclasses
import math

from moit.gpu.bindings import (
    BLOCK_SECOND,
    CAPTURE,
    EXTENT,
    FACTOR,
    RATIO_PASS,
    SECOND,
    SEEN,
    TAKEN_SECOND,
    WARPED,
    WEIGH,
)
from moit.gpu.block_passes import KEPT, READ, TOTAL
from moit.gpu.described import CAPTURED_AND_FACTORED, Constants, Passes, Stage

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


def power_moments(c: Constants) -> Passes:
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


def bounded_neural(c: Constants) -> Passes:
    fields = {**c.fields, "b0_is_half": False, "overestimation": 0.0}
    exact = c.exact or c.fields["count"] != 4  # as engines' text has four moments
    moments = power_moments(dataclasses.replace(c, fields=fields, exact=exact))
    return dataclasses.replace(
        moments,
        defines={**moments.defines, "BOUNDED": 1},
        factors=moments.factors + (8 if moments.engine else 11),
        iterations=64,
        network=c.fields["network"],
    )


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


def trigonometric_moments(c: Constants) -> Passes:
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
